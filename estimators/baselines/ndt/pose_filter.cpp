#include "estimators/baselines/ndt/pose_filter.h"

namespace lodestone {

namespace {

// Offsets in the state.
constexpr int kPositionAt = 0;
constexpr int kVelocityAt = 3;
constexpr int kQuaternionAt = 6;
constexpr int kAccelerometerBiasAt = 10;
constexpr int kGyroscopeBiasAt = 13;
constexpr int kStateSize = 16;

// Variances of the authors' program, pose_estimator.cpp. Process noise grows with time.
constexpr double kPositionNoise_m2_per_s = 1.0;
constexpr double kVelocityNoise_m2_per_s3 = 1.0;
constexpr double kQuaternionNoise_per_s = 0.5;
constexpr double kBiasNoise_per_s = 1e-6;
constexpr double kMeasuredPosition_m2 = 0.01;
constexpr double kMeasuredQuaternion = 0.001;

Eigen::Vector4d coefficients_of(const Quaternion& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}

Quaternion quaternion_of(const Eigen::Vector4d& wxyz) {
  return Quaternion(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized();
}

/// Columns: the derivatives of q ⊗ [1, φ/2] by φ, w x y z.
Eigen::Matrix<double, 4, 3> quaternion_by_rotation(const Quaternion& q) {
  Eigen::Matrix<double, 4, 3> result;
  result.row(0) = -0.5 * q.vec().transpose();
  result.bottomRows<3>() = 0.5 * (q.w() * Matrix3::Identity() + so3::hat(q.vec()));
  return result;
}

Eigen::VectorXd moved_state(const Eigen::VectorXd& x, const ImuInterval& imu, const Vector3& gravity,
                            double duration_s) {
  const Quaternion rotation = quaternion_of(x.segment<4>(kQuaternionAt));
  const Vector3 acceleration = rotation * (imu.linear_acceleration - x.segment<3>(kAccelerometerBiasAt)) + gravity;
  const Vector3 turn = duration_s * (imu.angular_velocity - x.segment<3>(kGyroscopeBiasAt));
  Eigen::VectorXd next = x;
  next.segment<3>(kPositionAt) += duration_s * x.segment<3>(kVelocityAt);
  next.segment<3>(kVelocityAt) += duration_s * acceleration;
  const Quaternion change = Quaternion(1.0, 0.5 * turn.x(), 0.5 * turn.y(), 0.5 * turn.z()).normalized();
  next.segment<4>(kQuaternionAt) = coefficients_of((rotation * change).normalized());
  return next;
}

Eigen::VectorXd expected_pose(const Eigen::VectorXd& x) {
  Eigen::VectorXd result(7);
  result << x.segment<3>(kPositionAt), x.segment<4>(kQuaternionAt).normalized();
  return result;
}

}  // namespace

PoseFilter::PoseFilter(const InitialState& start) : gravity_(start.state.gravity) {
  const NavState& state = start.state;
  state_.mean.resize(kStateSize);
  state_.mean << state.T_map_imu.position, state.velocity, coefficients_of(state.T_map_imu.rotation),
      state.accelerometer_bias, state.gyroscope_bias;
  const Vector17 variance = start.covariance.diagonal();
  Eigen::VectorXd own(kStateSize);
  // A quaternion changes by half the angle. The same along its length, so that the covariance is not singular.
  own << variance.segment<3>(tangent::position), variance.segment<3>(tangent::velocity),
      Eigen::Vector4d::Constant(0.25 * variance.segment<3>(tangent::rotation).maxCoeff()),
      variance.segment<3>(tangent::accelerometer_bias), variance.segment<3>(tangent::gyroscope_bias);
  state_.covariance = own.asDiagonal();
}

void PoseFilter::predict(const ImuInterval& imu, double duration_s) {
  Eigen::VectorXd noise(kStateSize);
  noise << Vector3::Constant(kPositionNoise_m2_per_s), Vector3::Constant(kVelocityNoise_m2_per_s3),
      Eigen::Vector4d::Constant(kQuaternionNoise_per_s), Vector6::Constant(kBiasNoise_per_s);
  state_ = unscented_prediction(
      state_, [&](const Eigen::VectorXd& x) { return moved_state(x, imu, gravity_, duration_s); },
      Eigen::MatrixXd((duration_s * noise).asDiagonal()));
}

void PoseFilter::correct(const Pose& measured) {
  Eigen::Vector4d quaternion = coefficients_of(measured.rotation);
  if (quaternion.dot(state_.mean.segment<4>(kQuaternionAt)) < 0.0) quaternion = -quaternion;  // the same rotation
  Eigen::VectorXd z(7);
  z << measured.position, quaternion;
  Eigen::VectorXd noise(7);
  noise << Vector3::Constant(kMeasuredPosition_m2), Eigen::Vector4d::Constant(kMeasuredQuaternion);
  state_ = unscented_update(state_, expected_pose, z, Eigen::MatrixXd(noise.asDiagonal()));
}

Quaternion PoseFilter::rotation() const {
  return quaternion_of(state_.mean.segment<4>(kQuaternionAt));
}

NavState PoseFilter::state() const {
  NavState state;
  state.T_map_imu = {rotation(), state_.mean.segment<3>(kPositionAt)};
  state.velocity = state_.mean.segment<3>(kVelocityAt);
  state.gyroscope_bias = state_.mean.segment<3>(kGyroscopeBiasAt);
  state.accelerometer_bias = state_.mean.segment<3>(kAccelerometerBiasAt);
  state.gravity = gravity_;
  return state;
}

Matrix6 PoseFilter::pose_covariance() const {
  // φ = 4 Dᵀ δq / |q| with the derivatives D of the quaternion, whose columns are orthogonal and half a unit long.
  const double length = state_.mean.segment<4>(kQuaternionAt).norm();
  Eigen::Matrix<double, 6, kStateSize> by_state = Eigen::Matrix<double, 6, kStateSize>::Zero();
  by_state.block<3, 4>(0, kQuaternionAt) = 4.0 / length * quaternion_by_rotation(rotation()).transpose();
  by_state.block<3, 3>(3, kPositionAt).setIdentity();
  return by_state * state_.covariance * by_state.transpose();
}

}  // namespace lodestone
