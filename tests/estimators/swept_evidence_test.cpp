#include "estimators/ieskf/swept_evidence.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>
#include <vector>

namespace lodestone {
namespace {

constexpr double scan_step_s = 0.5;
constexpr int scan_points = 300;

/// A scan of a box around the robot, with one turn of the LiDAR per step.
class SweptEvidence : public ::testing::Test {
 protected:
  void SetUp() override {
    std::mt19937_64 generator(7);
    std::normal_distribution<double> normal;
    const auto vector = [&](double scale) {
      const double x = normal(generator);
      const double y = normal(generator);
      return Vector3(scale * Vector3(x, y, normal(generator)));
    };
    state_.T_map_imu = {so3::exp(vector(1.0)), vector(3.0)};
    state_.velocity = vector(1.0);
    // The basis of the tangent plane is discontinuous at the pole.
    state_.gravity = 9.80665 * Vector3(0.3, -0.2, -1.0).normalized();
    deskewing_.step_s = scan_step_s;
    deskewing_.velocity = state_.T_map_imu.rotation.conjugate() * state_.velocity;
    deskewing_.gyroscope_density = 1e-7;
    deskewing_.accelerometer_density = 1e-5;
    planes_.resize(scan_points);
    for (int i = 0; i < scan_points; ++i) {
      const double share = (i + 0.5) / scan_points;
      const Vector3 point(10.0 * std::cos(2.0 * M_PI * share), 10.0 * std::sin(2.0 * M_PI * share),
                          i % 2 == 0 ? -1.0 : 2.0);
      Plane& plane = planes_[static_cast<std::size_t>(i)];
      plane.normal = (state_.T_map_imu.rotation * Vector3(Vector3::Unit(i % 3))).cast<float>();
      plane.major = plane.normal.unitOrthogonal();
      plane.center = (state_.T_map_imu * point).cast<float>();
      Correspondence match{point.cast<float>(), &plane, 1e-4F};
      match.age_s = static_cast<float>(scan_step_s * (1.0 - share));
      matches_.push_back(match);
    }
    cost_ = condense(matches_, state_.T_map_imu);
  }

  StateEvidence evidence(const NavState& state, const Matrix6& mask = Matrix6::Identity()) const {
    return swept_evidence(cost_, matches_, state_.T_map_imu, state_, deskewing_, state, mask);
  }

  /// Jᵀ Σ⁻¹ J of all points, with the IMU's noise back from the end of the step computed point by point.
  Matrix17 information_by_force() const {
    const Matrix3 to_map = state_.T_map_imu.rotation.toRotationMatrix();
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(scan_points, 17);
    Eigen::MatrixXd turning(scan_points, 3), normals(scan_points, 3), covariance(scan_points, scan_points);
    for (int i = 0; i < scan_points; ++i) {
      const Correspondence& match = matches_[static_cast<std::size_t>(i)];
      const double age_s = static_cast<double>(match.age_s);
      const Vector3 n = match.plane->normal.cast<double>();
      turning.row(i) = match.point.cast<double>().cross(to_map.transpose() * n);
      normals.row(i) = n;
      jacobian.block<1, 3>(i, tangent::rotation) =
          turning.row(i) - age_s * n.transpose() * to_map * so3::hat(deskewing_.velocity);
      jacobian.block<1, 3>(i, tangent::position) = n;
      jacobian.block<1, 3>(i, tangent::velocity) = -age_s * n;
      jacobian.block<1, 3>(i, tangent::gyroscope_bias) = age_s * turning.row(i);
      jacobian.block<1, 3>(i, tangent::accelerometer_bias) = -0.5 * age_s * age_s * n.transpose() * to_map;
      jacobian.block<1, 2>(i, tangent::gravity) =
          0.5 * age_s * age_s * n.transpose() * s2::boxplus_jacobian(state_.gravity);
    }
    for (int i = 0; i < scan_points; ++i) {
      for (int j = 0; j < scan_points; ++j) {
        const double a = static_cast<double>(matches_[static_cast<std::size_t>(i)].age_s);
        const double b = static_cast<double>(matches_[static_cast<std::size_t>(j)].age_s);
        const double less = std::min(a, b);
        covariance(i, j) = (i == j ? 1e-4 : 0.0) +
                           deskewing_.gyroscope_density * less * turning.row(i).dot(turning.row(j)) +
                           deskewing_.accelerometer_density * less * less * (3.0 * std::max(a, b) - less) / 6.0 *
                               normals.row(i).dot(normals.row(j));
      }
    }
    return jacobian.transpose() * covariance.llt().solve(jacobian);
  }

  NavState state_;
  Deskewing deskewing_;
  std::vector<Plane> planes_;
  std::vector<Correspondence> matches_;
  CondensedCost cost_;
};

TEST_F(SweptEvidence, KnowsOfTheStateWhatAPointByPointCovarianceKnows) {
  const Matrix17 regular = 1e-3 * Matrix17::Identity();  // gravity and the acceleration bias are not distinguishable
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix17> ratio(evidence(state_).information + regular,
                                                                 information_by_force() + regular);
  EXPECT_GT(ratio.eigenvalues().minCoeff(), 0.95);
  EXPECT_LT(ratio.eigenvalues().maxCoeff(), 1.1);
}

TEST_F(SweptEvidence, ItsGradientIsThatOfItsInformation) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  EXPECT_LT(evidence(state_).gradient.norm(), 1.0);  // points lie on their planes, up to float rounding
  for (int trial = 0; trial < 5; ++trial) {
    Vector17 step;
    for (int i = 0; i < 17; ++i) step[i] = 1e-4 * normal(generator);
    const Vector17 expected = evidence(state_).information * step;
    const Vector17 change = evidence(state_.boxplus(step)).gradient - evidence(state_).gradient;
    EXPECT_LT((change - expected).norm(), 1e-2 * expected.norm()) << trial;
  }
}

TEST_F(SweptEvidence, SaysNothingOfDirectionsThatTheMaskHides) {
  Matrix6 mask = Matrix6::Identity();
  const Vector3 hidden = Vector3(1.0, 2.0, -0.5).normalized();
  mask.bottomRightCorner<3, 3>() -= hidden * hidden.transpose();
  const Matrix17 information = evidence(state_, mask).information;
  const double before = evidence(state_).information.norm();
  EXPECT_LT((information.block<17, 3>(0, tangent::position) * hidden).norm(), 1e-9 * before);
  EXPECT_LT((information.block<17, 3>(0, tangent::velocity) * hidden).norm(), 1e-9 * before);
}

TEST_F(SweptEvidence, OfPointsThatNeededNoDeskewingIsOfThePoseAlone) {
  deskewing_ = {};
  const StateEvidence found = evidence(state_);
  EXPECT_TRUE((found.information.topLeftCorner<6, 6>() == cost_.hessian(state_.T_map_imu)));
  EXPECT_TRUE((found.information.bottomRightCorner<11, 11>().isZero(0.0)));
}

}  // namespace
}  // namespace lodestone
