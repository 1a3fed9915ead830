#include "tools/check/rotation_fit.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <span>

#include "tools/check/step_search.h"
#include "tools/check/turn_integral.h"
#include "tools/check/vector_series.h"

namespace lodestone {
namespace {

constexpr double largest_offset_s = 5.0;
constexpr double coarse_step_s = 0.02;
constexpr double fine_step_s = 0.002;
constexpr double least_overlap = 0.6;  // share of intervals; a few may agree by chance
constexpr std::size_t fewest_turns = 20;
constexpr std::size_t least_rotation_side = 5;

struct Turn {
  Time begin;
  Time end;
  Vector3 rate;  // rad/s, lidar frame
};

struct Pair {
  Vector3 gyroscope;
  Vector3 lidar;
  Time time;
};

std::vector<Pair> pairs_at(const std::vector<Turn>& turns, const TurnIntegral& gyroscope, double offset_s) {
  const Time shift = from_seconds(offset_s);
  std::vector<Pair> pairs;
  for (const Turn& turn : turns) {
    const auto turned = gyroscope.over(turn.begin + shift, turn.end + shift);
    if (turned) pairs.push_back({*turned / to_seconds(turn.end - turn.begin), turn.rate, turn.end});
  }
  return pairs;
}

struct Moments {
  Matrix3 cross = Matrix3::Zero();  // Σ (gyroscope − mean)(lidar − mean)ᵀ
  Matrix3 lidar = Matrix3::Zero();
  Matrix3 gyroscope = Matrix3::Zero();
};

Moments moments_of(const std::vector<Pair>& pairs) {
  Vector3 gyroscope = Vector3::Zero();
  Vector3 lidar = Vector3::Zero();
  for (const Pair& pair : pairs) {
    gyroscope += pair.gyroscope / static_cast<double>(pairs.size());
    lidar += pair.lidar / static_cast<double>(pairs.size());
  }
  Moments result;
  for (const Pair& pair : pairs) {
    result.cross += (pair.gyroscope - gyroscope) * (pair.lidar - lidar).transpose();
    result.lidar += (pair.lidar - lidar) * (pair.lidar - lidar).transpose();
    result.gyroscope += (pair.gyroscope - gyroscope) * (pair.gyroscope - gyroscope).transpose();
  }
  return result;
}

/// The rotation that maps the LiDAR's turns best to the gyroscope's (Kabsch), with the singular values of the cross
/// moments.
struct BestRotation {
  Quaternion R_imu_lidar;
  double along = 0.0;   ///< the largest singular value
  double across = 0.0;  ///< the other two: they determine the rotation about the main axis
};

BestRotation best_rotation(const Matrix3& cross) {
  const Eigen::JacobiSVD<Matrix3> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3 hand = Matrix3::Identity();
  hand(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  const Vector3& values = svd.singularValues();
  return {Quaternion(Matrix3(svd.matrixU() * hand * svd.matrixV().transpose())), values[0],
          values[1] + hand(2, 2) * values[2]};
}

double correlation_at(const std::vector<Turn>& turns, const TurnIntegral& gyroscope, double offset_s) {
  const std::vector<Pair> pairs = pairs_at(turns, gyroscope, offset_s);
  if (static_cast<double>(pairs.size()) < least_overlap * static_cast<double>(turns.size())) return 0.0;
  const Moments moments = moments_of(pairs);
  const double size = std::sqrt(moments.gyroscope.trace() * moments.lidar.trace());
  if (!(size > 0.0)) return 0.0;
  const BestRotation best = best_rotation(moments.cross);
  return (best.along + best.across) / size;
}

double best_offset(const std::vector<Turn>& turns, const TurnIntegral& gyroscope) {
  double best_s = 0.0;
  double best = correlation_at(turns, gyroscope, 0.0);
  const auto look = [&](double from_s, double until_s, double step_s) {
    for (double offset_s = from_s; offset_s <= until_s + 1e-9; offset_s += step_s) {
      const double found = correlation_at(turns, gyroscope, offset_s);
      if (found > best) {
        best = found;
        best_s = offset_s;
      }
    }
  };
  look(-largest_offset_s, largest_offset_s, coarse_step_s);
  look(best_s - coarse_step_s, best_s + coarse_step_s, fine_step_s);
  return best_s;
}

/// Compares the main turning axis of both sensors. `R_imu_lidar` is then corrected by the smallest rotation that aligns
/// the axes.
void compare_axes(const Moments& moments, const Quaternion& R_imu_lidar, RotationFit& fit) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(moments.lidar);
  const Vector3 axis = solver.eigenvectors().col(2);
  const Vector3 seen = moments.cross * axis;
  // Noise of the LiDAR decreases the first ratio; noise of the gyroscope increases the second.
  fit.scale_least = seen.norm() / solver.eigenvalues()[2];
  fit.scale_most = seen.normalized().dot(moments.gyroscope * seen.normalized()) / seen.norm();
  fit.scale = std::sqrt(fit.scale_least * fit.scale_most);
  fit.axis_error_rad = angle_between_rad(R_imu_lidar * axis, seen);
  fit.axis_error_inverse_rad = angle_between_rad(R_imu_lidar.conjugate() * axis, seen);
  fit.R_imu_lidar = Quaternion::FromTwoVectors(R_imu_lidar * axis, seen) * R_imu_lidar;
}

/// Estimates the rotation about that axis. Its variance is Σ (unexplained)·(turns across): with noise on both sides and
/// no turns across, the rotation is unobservable.
void compare_turns(const Moments& moments, const Quaternion& R_imu_lidar, RotationFit& fit) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(moments.lidar);
  const double lidar_across = solver.eigenvalues()[0] + solver.eigenvalues()[1];
  const BestRotation best = best_rotation(moments.cross);
  const double across = best.across / fit.scale;
  const double unexplained = moments.gyroscope.trace() / (fit.scale * fit.scale) -
                             2.0 * (best.along / fit.scale + across) + moments.lidar.trace();
  const double variance = std::max(0.0, unexplained) / (3.0 * fit.intervals);
  if (!(across > 0.0)) return;
  fit.turn_sigma_rad = std::sqrt(variance * lidar_across) / across;
  const Vector3 axis = best.R_imu_lidar * solver.eigenvectors().col(2);
  const auto about_axis = [&](const Quaternion& given) {
    const Quaternion error = best.R_imu_lidar * given.conjugate();
    return std::remainder(2.0 * std::atan2(error.vec().dot(axis), error.w()), 2.0 * M_PI);
  };
  fit.turn_about_axis_rad = about_axis(R_imu_lidar);
  fit.turn_about_axis_inverse_rad = about_axis(R_imu_lidar.conjugate());
  if (!fit.turn_observable()) return;
  // With two strong axes, noise mixes them slightly. The complete rotation does not have this error.
  const Vector3 axis_lidar = best.R_imu_lidar.conjugate() * axis;
  fit.axis_error_rad = angle_between_rad(R_imu_lidar * axis_lidar, axis);
  fit.axis_error_inverse_rad = angle_between_rad(R_imu_lidar.conjugate() * axis_lidar, axis);
  fit.R_imu_lidar = best.R_imu_lidar;
}

void find_step(const std::vector<Pair>& pairs, const Quaternion& R_imu_lidar, double scale, RotationFit& fit) {
  std::vector<Vector3> differences;
  for (const Pair& pair : pairs) differences.push_back(pair.gyroscope / scale - R_imu_lidar * pair.lidar);
  const LargestStep step = largest_step(differences, least_rotation_side);
  if (step.index == 0) return;
  // The median: single wrong turns of the odometry shift a mean, but not the median.
  const std::span<const Vector3> all(differences);
  const Vector3 middles = component_medians(all.subspan(step.index)) - component_medians(all.first(step.index));
  if (middles.dot(step.step) < 0.5 * step.step.squaredNorm()) return;
  fit.bias_step_rad_s = step.step.norm();
  fit.bias_step_sigma_rad_s = step.sigma;
  fit.bias_step_time = pairs[step.index].time;
}

}  // namespace

std::optional<RotationFit> fit_rotation(const Trajectory& lidar_poses, const std::vector<ImuSample>& imu,
                                        const Quaternion& R_imu_lidar) {
  std::vector<Turn> turns;
  for (std::size_t i = 1; i < lidar_poses.size(); ++i) {
    const StampedPose& before = lidar_poses[i - 1];
    const StampedPose& after = lidar_poses[i];
    const double step_s = to_seconds(after.time - before.time);
    if (step_s > 0.5) continue;
    // Exp(φ) is the rotation of the moving frame. φ is the same in the frames before and after the rotation.
    turns.push_back(
        {before.time, after.time, so3::log(before.pose.rotation.conjugate() * after.pose.rotation) / step_s});
  }
  const TurnIntegral gyroscope(imu);
  if (turns.size() < fewest_turns || pairs_at(turns, gyroscope, 0.0).size() < fewest_turns) return std::nullopt;
  RotationFit fit;
  fit.correlation_unshifted = correlation_at(turns, gyroscope, 0.0);
  fit.offset_s = best_offset(turns, gyroscope);
  fit.correlation = correlation_at(turns, gyroscope, fit.offset_s);
  const std::vector<Pair> pairs = pairs_at(turns, gyroscope, fit.offset_s);
  fit.intervals = static_cast<int>(pairs.size());
  const Moments moments = moments_of(pairs);
  fit.excitation_rad_s = std::sqrt(moments.lidar.trace() / static_cast<double>(pairs.size()));
  compare_axes(moments, R_imu_lidar, fit);
  compare_turns(moments, R_imu_lidar, fit);
  // With a slightly wrong axis, turns look like a bias.
  find_step(fit.axis_observable() ? pairs : pairs_at(turns, gyroscope, 0.0),
            fit.axis_observable() ? fit.R_imu_lidar : R_imu_lidar, fit.axis_observable() ? fit.scale : 1.0, fit);
  return fit;
}

}  // namespace lodestone
