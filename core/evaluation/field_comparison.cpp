#include "core/evaluation/field_comparison.h"

#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

constexpr Time kLargestGap = from_seconds(0.5);  // between poses; in longer gaps the path is unknown
constexpr double kMoved_m = 0.02;
constexpr double kTurned_rad = 0.03;

/// Completes ∂B/∂z from the slopes along x and y. The field has no curl and no divergence.
void complete_gradient(Matrix3& gradient) {
  gradient(0, 2) = gradient(2, 0);
  gradient(1, 2) = gradient(2, 1);
  gradient(2, 2) = -gradient(0, 0) - gradient(1, 1);
}

FieldDifference difference_of(const FieldComparison& comparison, const ArrayLog::Reading& reading, int magnetometer,
                              const Pose& T_map_imu, const Matrix6& covariance, FieldValue map) {
  const MagnetometerModel& model = comparison.suite.magnetometers[static_cast<std::size_t>(magnetometer)];
  const Matrix3 R_map_imu = T_map_imu.rotation.toRotationMatrix();
  FieldDifference result;
  result.magnetometer = magnetometer;
  result.position = T_map_imu * model.T_imu_mag.position;
  result.R_map_mag = R_map_imu * model.T_imu_mag.rotation.toRotationMatrix();
  result.difference_ut = result.R_map_mag * reading.field_ut.cast<double>() - map.field_ut;
  result.noise_variance = model.noise_ut * model.noise_ut * ArrayLog::median_variance / reading.samples;
  result.map_variance = std::pow(std::max(map.sigma_ut, kMapSigmaFloor_ut), 2);
  if (comparison.only_height_m) {
    complete_gradient(map.gradient);
    const double above = result.position.z() - *comparison.only_height_m;
    result.pose_variance = above * above * map.gradient.col(2) * map.gradient.col(2).transpose();
  }
  // d = R B − M(p + R ℓ), in the tangent φ (right), p.
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian.leftCols<3>() = -R_map_imu * so3::hat(R_map_imu.transpose() * map.field_ut) +
                           map.gradient * R_map_imu * so3::hat(model.T_imu_mag.position);
  jacobian.rightCols<3>() = -map.gradient;
  if (covariance.allFinite()) result.pose_variance += jacobian * covariance * jacobian.transpose();
  return result;
}

}  // namespace

FieldComparison comparison_with(const MagneticMap& map, FieldInterpolation interpolation, const ArrayLog& readings,
                                const SensorSuite& suite, const Trajectory& trajectory,
                                const std::vector<Matrix6>& covariances) {
  const auto field_at = [&map, interpolation](const Vector3& position) { return map.query(position, interpolation); };
  const std::vector<double>& heights = map.grid().heights_m;
  return {readings,    suite,    trajectory,
          covariances, field_at, heights.size() == 1 ? std::optional<double>(heights.front()) : std::nullopt};
}

void compare_field(const FieldComparison& comparison, const std::function<void(const ComparedArray&)>& visit) {
  const Trajectory& trajectory = comparison.trajectory;
  std::optional<Pose> last_moved;
  ComparedArray array;
  for (std::size_t i = 0; i < comparison.readings.size(); ++i) {
    array.time = comparison.readings.time(i);
    const std::optional<Pose> pose = interpolate(trajectory, array.time, kLargestGap);
    if (!pose || !pose->position.allFinite() || !pose->rotation.coeffs().allFinite()) continue;
    while (trajectory[array.pose_index].time < array.time) ++array.pose_index;
    array.moved = !last_moved || (pose->position - last_moved->position).norm() > kMoved_m ||
                  pose->rotation.angularDistance(last_moved->rotation) > kTurned_rad;
    if (array.moved) last_moved = pose;
    array.differences.clear();
    for (std::size_t j = 0; j < comparison.readings.magnetometers(); ++j) {
      const ArrayLog::Reading& reading = comparison.readings.reading(i, j);
      if (reading.samples == 0) continue;
      const auto field = comparison.map(*pose * comparison.suite.magnetometers[j].T_imu_mag.position);
      if (!field) continue;
      array.differences.push_back(difference_of(comparison, reading, static_cast<int>(j), *pose,
                                                comparison.covariances[array.pose_index], *field));
    }
    visit(array);
  }
}

}  // namespace lodestone
