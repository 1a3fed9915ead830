#include "frontends/lidar/association.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/observability/robust_weight.h"
#include "core/parallel.h"

namespace lodestone {

namespace {

constexpr std::size_t kChunk = 1024;

// A scan meets most planes more than once, and a smoothed estimate averages twice as many scans as a causal one.
constexpr double kFewestRepeats = 2.0;

using Matrix6f = Eigen::Matrix<float, 6, 6>;
using Vector6f = Eigen::Matrix<float, 6, 1>;

struct Noise {
  float range_variance;
  float angle_variance;
  float roughness_variance;
  float most_repeats;
  float max_distance;
  Matrix6f pose_covariance;  // φ, p
  Matrix6f covariance;  // of the pose, as it is averaged; zero: not known
  Matrix6f repeated_covariance;
  float gate_squared;
  double huber_sigmas;
};

/// J P Jᵀ of a residual, by direction: what is not known along a tunnel opens no gate across it.
float variance_by_pose(const Vector6f& jacobian, const Matrix6f& covariance) {
  return std::max(0.0F, jacobian.dot(covariance.selfadjointView<Eigen::Lower>() * jacobian));
}

/// How many scans are averaged along a residual.
float repeats(const Vector6f& jacobian, const Noise& noise) {
  const float once = variance_by_pose(jacobian, noise.covariance);
  return once > 0.0F ? variance_by_pose(jacobian, noise.repeated_covariance) / once : noise.most_repeats;
}

/// P times how many scans are averaged in each direction: the eigenvalues of P by those of S, kept within what is sensible. What
/// one scan does not see counts the most times, and no more: S is without bounds there, and noisy normals all look there a little.
Matrix6 repeated_covariance(const ScanAveraging& averaging, double most) {
  const Matrix6 root = averaging.covariance.llt().matrixL();
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(root.transpose() * averaging.information_of_scan * root);
  const double fewest = std::min(kFewestRepeats, most);
  const Vector6 scans = solver.eigenvalues().unaryExpr(
      [&](double share) { return share * most > 1.0 ? std::max(1.0 / share, fewest) : most; });
  const Matrix6 directions = root * solver.eigenvectors();
  return directions * scans.asDiagonal() * directions.transpose();
}

void associate_part(std::span<const Eigen::Vector3f> points, std::span<const float> ages_s, const Pose& T_map_imu, const Eigen::Vector3f& beam_origin,
                    const PlaneMap& map, const Noise& noise, std::vector<Correspondence>& result) {
  const Eigen::Matrix3f rotation = T_map_imu.rotation.toRotationMatrix().cast<float>();
  // Doubles for the position: far from the map's origin floats lose millimetres, which the sum would keep.
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f& point = points[i];
    const Eigen::Vector3f turned = rotation * point;
    const Eigen::Vector3f place = (turned.cast<double>() + T_map_imu.position).cast<float>();
    const Plane* plane = map.match(place, noise.max_distance);
    if (plane == nullptr) continue;
    const float distance = plane->distance(place);
    const Eigen::Vector3f beam = rotation * (point - beam_origin);
    const float range_squared = beam.squaredNorm();
    const float along_normal = plane->normal.dot(beam);
    const float cosine_squared = along_normal * along_normal / range_squared;
    Vector6f jacobian;
    jacobian << point.cross(rotation.transpose() * plane->normal), plane->normal;
    const float variance = noise.range_variance * cosine_squared +
                           noise.angle_variance * range_squared * (1.0F - cosine_squared) + noise.roughness_variance +
                           repeats(jacobian, noise) * plane->variance_at(place);
    const float expected = variance + variance_by_pose(jacobian, noise.pose_covariance);
    if (distance * distance > noise.gate_squared * expected) continue;
    const double sigmas = std::abs(distance) / std::sqrt(expected);
    result.push_back({point, plane, variance, static_cast<float>(huber_weight(sigmas, noise.huber_sigmas)),
                      ages_s.empty() ? 0.0F : ages_s[i]});
  }
}

}  // namespace

std::vector<Correspondence> associate(std::span<const Eigen::Vector3f> points, const Pose& T_map_imu,
                                      const Matrix6& pose_covariance, const PlaneMap& map, const LidarModel& lidar,
                                      const AssociationOptions& options, std::span<const float> ages_s,
                                      const ScanAveraging& averaging) {
  const auto square = [](double value) { return static_cast<float>(value * value); };
  const Noise noise{square(lidar.range_noise_m),
                    square(lidar.direction_noise_rad),
                    square(options.surface_roughness_m),
                    static_cast<float>(options.map_error_repeats),
                    static_cast<float>(options.max_distance_m),
                    pose_covariance.cast<float>(),
                    averaging.covariance.cast<float>(),
                    repeated_covariance(averaging, options.map_error_repeats).cast<float>(),
                    square(options.gate_sigmas),
                    options.huber_sigmas};
  const Eigen::Vector3f beam_origin = lidar.T_imu_lidar.position.cast<float>();
  const std::size_t chunks = (points.size() + kChunk - 1) / kChunk;
  std::vector<std::vector<Correspondence>> parts(chunks);
  parallel_for(std::size_t{0}, chunks, [&](std::size_t i) {
    const std::size_t begin = i * kChunk;
    parts[i].reserve(kChunk);
    const std::size_t count = std::min(kChunk, points.size() - begin);
    associate_part(points.subspan(begin, count), ages_s.empty() ? ages_s : ages_s.subspan(begin, count), T_map_imu,
                   beam_origin, map, noise, parts[i]);
  });
  std::vector<Correspondence> result;
  result.reserve(points.size());
  for (const auto& part : parts) result.insert(result.end(), part.begin(), part.end());
  return result;
}

Matrix6 unit_hessian(std::span<const Correspondence> correspondences, const Pose& T_map_imu) {
  const Matrix3 map_to_imu = T_map_imu.rotation.toRotationMatrix().transpose();
  Matrix6 sum = Matrix6::Zero();
  for (const Correspondence& match : correspondences) {
    const Vector3 normal = match.plane->normal.cast<double>();
    Vector6 jacobian;
    jacobian.head<3>() = match.point.cast<double>().cross(map_to_imu * normal);
    jacobian.tail<3>() = normal;
    sum.selfadjointView<Eigen::Lower>().rankUpdate(jacobian);
  }
  return sum.selfadjointView<Eigen::Lower>();
}

}  // namespace lodestone
