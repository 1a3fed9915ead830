#include <gtest/gtest.h>

#include <random>

#include "core/geometry/nav_state.h"
#include "core/geometry/pose_spacing.h"
#include "core/geometry/slide.h"
#include "core/geometry/trajectory.h"

namespace lodestone {
namespace {

Vector3 random_vector(std::mt19937_64& generator, double scale) {
  std::normal_distribution<double> normal;
  return scale * Vector3(normal(generator), normal(generator), normal(generator));
}

TEST(So3, LogInvertsExpFromTinyToLargeAngles) {
  std::mt19937_64 generator(1);
  for (double angle : {1e-12, 1e-8, 1e-5, 1e-4, 1e-3, 0.1, 1.0, 3.0, 3.14159}) {
    for (int i = 0; i < 20; ++i) {
      const Vector3 phi = angle * random_vector(generator, 1.0).normalized();
      EXPECT_LT((so3::log(so3::exp(phi)) - phi).norm(), 1e-12 + 1e-10 * angle) << angle;
      EXPECT_NEAR(so3::exp(phi).norm(), 1.0, 1e-15);
    }
  }
}

TEST(So3, LogTakesTheShortWayForBothSignsOfTheQuaternion) {
  const Quaternion q = so3::exp(Vector3(0.3, -0.2, 0.5));
  const Quaternion minus_q(-q.w(), -q.x(), -q.y(), -q.z());
  EXPECT_LT((so3::log(q) - so3::log(minus_q)).norm(), 1e-14);
}

TEST(So3, RightJacobianIsTheDerivativeOfExp) {
  std::mt19937_64 generator(2);
  for (double scale : {1e-6, 1e-3, 2e-2, 0.5, 2.0}) {
    const Vector3 phi = scale * random_vector(generator, 1.0).normalized();
    Matrix3 numeric;
    const double step = 1e-6;
    for (int i = 0; i < 3; ++i) {
      const Vector3 delta = step * Vector3::Unit(i);
      const Quaternion inverse = so3::exp(phi).conjugate();
      numeric.col(i) =
          (so3::log(inverse * so3::exp(phi + delta)) - so3::log(inverse * so3::exp(phi - delta))) / (2 * step);
    }
    EXPECT_LT((numeric - so3::right_jacobian(phi)).norm(), 1e-8) << scale;
    EXPECT_LT((so3::right_jacobian(phi) * so3::right_jacobian_inverse(phi) - Matrix3::Identity()).norm(), 1e-10);
  }
}

Pose random_pose(std::mt19937_64& generator) {
  return {so3::exp(random_vector(generator, 1.0)), random_vector(generator, 5.0)};
}

/// Along a bend of 400 m, and along a straight tunnel.
std::vector<Vector6> hidden_directions(const Pose& pose) {
  Vector6 bend;
  bend << Vector3(0.0, 0.0, 1.0 / 400.0), pose.rotation * Vector3::UnitX();
  Vector6 straight;
  straight << Vector3::Zero(), pose.rotation * Vector3::UnitX();
  return {bend, straight};
}

/// The whole map moves as `slide` moves a pose at its place by `distance_m`.
Pose slid(const Slide& slide, const Pose& pose, double distance_m) {
  const Vector3 turn = distance_m * slide.turn;
  const Pose motion{so3::exp(turn), so3::right_jacobian(-turn) * (distance_m * slide.direction)};
  return {motion.rotation * pose.rotation, slide.at + motion * (pose.position - slide.at)};
}

TEST(Slide, APoseComesBackFromWhereverItSlidTo) {
  std::mt19937_64 generator(20);
  const Pose x0 = random_pose(generator);
  for (const Vector6& hidden : hidden_directions(x0)) {
    const Slide slide = Slide::along(hidden, x0);
    const Vector3 across = x0.rotation * Vector3(0.0, 0.3, -0.2);
    const Pose level{x0.rotation * so3::exp(random_vector(generator, 0.2)), x0.position + across};
    for (const double distance_m : {-20.0, -0.3, 0.0, 1e-6, 5.0, 60.0}) {
      const Unslid back = unslide(slide, slid(slide, level, distance_m));
      EXPECT_NEAR(back.distance_m, distance_m, 1e-10);
      EXPECT_LT(back.pose.boxminus(level).norm(), 1e-10) << distance_m;
    }
  }
}

TEST(Slide, ItsDifferenceChangesInTheHiddenDirectionAlone) {
  std::mt19937_64 generator(21);
  const Pose x0 = random_pose(generator);
  for (const Vector6& hidden : hidden_directions(x0)) {
    const Slide slide = Slide::along(hidden, x0);
    const Pose x = x0.boxplus(0.1 * Vector6::Ones());
    const Vector6 value = difference_along(slide, x, x0).value;
    for (const double distance_m : {-20.0, 0.3, 5.0}) {
      const Vector6 moved = difference_along(slide, slid(slide, x, distance_m), x0).value;
      EXPECT_LT((moved - value - distance_m * hidden).norm(), 1e-10) << distance_m;
    }
  }
}

TEST(Slide, ItsDifferenceIsTheTangentAtTheStartAndItsJacobianTheDerivative) {
  std::mt19937_64 generator(22);
  const Pose x0 = random_pose(generator);
  std::vector<Slide> slides{Slide{}};
  for (const Vector6& hidden : hidden_directions(x0)) slides.push_back(Slide::along(hidden, x0));
  for (const Slide& slide : slides) {
    EXPECT_LT((difference_along(slide, x0, x0).by_tangent - Matrix6::Identity()).norm(), 1e-12);
    Vector6 step;
    step << 0.2, -0.1, 0.3, 2.0, -0.4, 0.3;
    const Pose x = x0.boxplus(step);
    const SlideDifference difference = difference_along(slide, x, x0);
    const double h = 1e-6;
    for (int i = 0; i < 6; ++i) {
      const Vector6 delta = h * Vector6::Unit(i);
      const Vector6 numeric =
          (difference_along(slide, x.boxplus(delta), x0).value - difference_along(slide, x.boxplus(-delta), x0).value) /
          (2.0 * h);
      EXPECT_LT((numeric - difference.by_tangent.col(i)).norm(), 1e-7) << i;
    }
  }
}

TEST(S2, BasisIsOrthonormalAndTangent) {
  std::mt19937_64 generator(3);
  for (int i = 0; i < 100; ++i) {
    const Vector3 g = random_vector(generator, 9.8);
    const auto basis = s2::basis(g);
    EXPECT_LT((basis.transpose() * basis - Eigen::Matrix2d::Identity()).norm(), 1e-14);
    EXPECT_LT((basis.transpose() * g).norm(), 1e-12);
  }
}

TEST(S2, BoxminusInvertsBoxplusAndKeepsLength) {
  std::mt19937_64 generator(4);
  for (int i = 0; i < 100; ++i) {
    const Vector3 g = random_vector(generator, 9.8);
    const Vector2 delta = random_vector(generator, 0.5).head<2>();
    const Vector3 moved = s2::boxplus(g, delta);
    EXPECT_NEAR(moved.norm(), g.norm(), 1e-12);
    EXPECT_LT((s2::boxminus(moved, g) - delta).norm(), 1e-10);
    EXPECT_LT(s2::boxminus(g, g).norm(), 1e-14);
  }
}

TEST(S2, BoxplusJacobianMatchesDifferences) {
  const Vector3 g(0.3, -0.2, -9.79);
  const double step = 1e-6;
  Eigen::Matrix<double, 3, 2> numeric;
  for (int i = 0; i < 2; ++i) {
    const Vector2 delta = step * Vector2::Unit(i);
    numeric.col(i) = (s2::boxplus(g, delta) - s2::boxplus(g, -delta)) / (2 * step);
  }
  EXPECT_LT((numeric - s2::boxplus_jacobian(g)).norm(), 1e-8);
}

TEST(S2, BoxminusJacobianMatchesDifferences) {
  std::mt19937_64 generator(6);
  for (double away : {0.0, 1e-6, 1e-3, 0.1, 1.0}) {
    const Vector3 reference = 9.8 * random_vector(generator, 1.0).normalized();
    const Vector3 g = s2::boxplus(reference, away * Vector2(0.6, -0.8));
    const double step = 1e-6;
    Eigen::Matrix2d numeric;
    for (int i = 0; i < 2; ++i) {
      const Vector2 delta = step * Vector2::Unit(i);
      numeric.col(i) =
          (s2::boxminus(s2::boxplus(g, delta), reference) - s2::boxminus(s2::boxplus(g, -delta), reference)) /
          (2 * step);
    }
    EXPECT_LT((numeric - s2::boxminus_jacobian(g, reference)).norm(), 1e-7) << away;
  }
}

TEST(NavStateTest, BoxminusInvertsBoxplus) {
  std::mt19937_64 generator(5);
  std::normal_distribution<double> normal;
  NavState state;
  state.T_map_imu = {so3::exp(Vector3(0.1, 2.0, -0.4)), Vector3(1, 2, 3)};
  for (int i = 0; i < 50; ++i) {
    Vector17 delta;
    for (int k = 0; k < 17; ++k) delta[k] = 0.3 * normal(generator);
    EXPECT_LT((state.boxplus(delta).boxminus(state) - delta).norm(), 1e-10);
  }
}

TEST(PoseTest, InverseAndCompositionAgree) {
  const Pose a{so3::exp(Vector3(0.3, 0.1, -2.0)), Vector3(1, -2, 3)};
  const Pose b{so3::exp(Vector3(-0.2, 0.7, 0.4)), Vector3(-4, 0.5, 2)};
  const Vector3 point(0.2, -0.7, 5.0);
  EXPECT_LT(((a * b) * point - a * (b * point)).norm(), 1e-12);
  EXPECT_LT((a.inverse() * (a * point) - point).norm(), 1e-12);
}

TEST(TrajectoryTest, InterpolatesWithinAndRefusesOutsideAndAcrossGaps) {
  Trajectory trajectory{{0, {Quaternion::Identity(), Vector3(0, 0, 0)}},
                        {100, {so3::exp(Vector3(0, 0, 1)), Vector3(1, 0, 0)}},
                        {1000, {Quaternion::Identity(), Vector3(9, 0, 0)}}};
  const auto pose = interpolate(trajectory, 25, 200);
  ASSERT_TRUE(pose);
  EXPECT_NEAR(pose->position.x(), 0.25, 1e-12);
  EXPECT_NEAR(so3::log(pose->rotation).z(), 0.25, 1e-12);
  EXPECT_FALSE(interpolate(trajectory, -1, 200));
  EXPECT_FALSE(interpolate(trajectory, 1001, 200));
  EXPECT_FALSE(interpolate(trajectory, 500, 200));
  EXPECT_TRUE(interpolate(trajectory, 1000, 200));
}

TEST(TrajectoryTest, AGapDoesNotChangeTheSpacing) {
  EXPECT_EQ(pose_spacing({}), 0);
  EXPECT_EQ(pose_spacing({{7, {}}}), 0);
  EXPECT_EQ(pose_spacing({{0, {}}, {10, {}}, {20, {}}, {1000, {}}}), 10);
}

}  // namespace
}  // namespace lodestone
