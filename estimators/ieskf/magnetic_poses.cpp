#include "estimators/ieskf/magnetic_poses.h"

#include <Eigen/LU>
#include <cmath>

#include "core/magnetometer/localization.h"

namespace lodestone {

namespace {

/// ∂(T_map_t)/∂(T_map_end) in their tangents, for T_map_t = T_map_end · T_end_t.
Matrix6 carry_jacobian(const Pose& T_map_end, const Pose& T_end_t) {
  Matrix6 jacobian = Matrix6::Identity();
  jacobian.topLeftCorner<3, 3>() = T_end_t.rotation.toRotationMatrix().transpose();
  jacobian.bottomLeftCorner<3, 3>() = -T_map_end.rotation.toRotationMatrix() * so3::hat(T_end_t.position);
  return jacobian;
}

struct FieldAlone {
  Vector6 step = Vector6::Zero();         // from the prediction to the pose from the field alone
  Matrix6 information = Matrix6::Zero();  // zero in unobservable directions
};

/// Subtracts the prior from a localization, so that the filter does not use its own prediction twice.
FieldAlone without_prior(const MagneticLocalization& found, const Pose& predicted, double unseen_gain) {
  const Matrix6 to_directions = found.directions.inverse();
  Vector6 step = to_directions * found.T_map_imu.boxminus(predicted);
  Vector6 gain = found.gain;
  for (int i = 0; i < 6; ++i) {
    const bool seen = gain[i] >= unseen_gain;
    step[i] = seen ? step[i] * (1.0 + gain[i]) / gain[i] : 0.0;
    if (!seen) gain[i] = 0.0;
  }
  return {found.directions * step, to_directions.transpose() * gain.asDiagonal() * to_directions};
}

}  // namespace

MagneticPoses localize_samples(std::span<const MagneticArraySample> samples, const ScanMotion& motion,
                               const Matrix6& covariance, const SensorSuite& suite, const MagneticMap& map,
                               FieldInterpolation interpolation, bool map_sigma) {
  MagneticLocalizationOptions options;
  options.interpolation = interpolation;
  options.map_sigma = map_sigma;
  MagneticPoses result;
  const Pose T_map_end = motion.pose(motion.end_time());
  std::vector<Vector6> steps;
  double squared = 0.0;
  for (const MagneticArraySample& sample : samples) {
    const Pose T_end_t = motion.relative_pose(sample.time);
    const Pose predicted = T_map_end * T_end_t;
    const Matrix6 carry = carry_jacobian(T_map_end, T_end_t);
    const Matrix6 prior = carry * covariance * carry.transpose();
    const MagneticLocalization found =
        localize(predicted, 0.5 * (prior + prior.transpose()), sample, suite, map, options);
    result.off_map += found.off_map;
    if (found.used == 0 || !found.converged) continue;
    const FieldAlone field = without_prior(found, predicted, options.unseen_gain);
    MagneticPose pose;
    pose.T_map_imu = predicted.boxplus(field.step) * T_end_t.inverse();
    pose.information = carry.transpose() * field.information * carry;
    steps.push_back(pose.T_map_imu.boxminus(T_map_end));
    squared += found.residual_rms_ut * found.residual_rms_ut;
    result.poses.push_back(pose);
  }
  if (result.poses.empty()) return result;
  const double count = static_cast<double>(result.poses.size());
  result.residual_rms_ut = std::sqrt(squared / count);
  if (result.poses.size() < 2) return result;

  Vector6 mean = Vector6::Zero();
  for (const Vector6& step : steps) mean += step / count;
  Matrix6 spread = Matrix6::Zero();
  for (const Vector6& step : steps) spread += (step - mean) * (step - mean).transpose() / (count - 1.0);
  for (MagneticPose& pose : result.poses) {
    // R_n = I_n⁻¹ + spread; its inverse holds where I_n is singular, too.
    const Matrix6 information = pose.information * (Matrix6::Identity() + spread * pose.information).inverse();
    pose.information = 0.5 * (information + information.transpose());
  }
  return result;
}

}  // namespace lodestone
