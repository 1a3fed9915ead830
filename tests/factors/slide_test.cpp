// Masks and priors do not constrain the slide of a trajectory along an unobservable direction.
#include <gtest/gtest.h>

#include "factors/condensed_lidar_factor.h"
#include "factors/prior_factor.h"
#include "tests/factors/bend.h"
#include "tests/factors/gradients.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

Pose random_pose(Random& random) {
  return {so3::exp(random.vector()), random.vector(5.0)};
}

TEST(PoseMask, HidesExactlyTheNullSpaceOfItsProjector) {
  Random random(3);
  const Pose reference = random_pose(random);
  Vector6 diagonal;
  diagonal << 1, 1, 1, 0, 1, 1;
  const PoseMask mask(Matrix6(diagonal.asDiagonal()), reference);
  Vector6 step;
  step << 0.01, -0.02, 0.03, 0.7, 0.2, -0.1;
  const Vector6 seen = mask.apply(reference.boxplus(step), nullptr).boxminus(reference);
  EXPECT_NEAR(seen[3], 0.0, 1e-14);
  step[3] = 0.0;
  EXPECT_LT((seen - step).norm(), 1e-12);
}

TEST(PoseMask, HidesABendAsFarAsItIsACircle) {
  Random random(31);
  const Pose reference = random_pose(random);
  const PoseMask mask = bend_mask(reference);
  for (const double distance_m : {-2.0, 0.5, 5.0}) {
    const Vector6 seen = mask.apply(slid_along_bend(reference, distance_m), nullptr).boxminus(reference);
    // The tangent is 31 mm off the bend after 5 m.
    EXPECT_LT(seen.norm(), 1e-10) << distance_m;
  }
}

// Once the states had slid, a departure from the deskewed motion in map axes got a part across the bore, and a map
// error added before the slide was straightened rotated with the bend (docs/design/010).
TEST(CondensedLidarFactor, FeelsNoCommonSlideWhateverCalibrationAndMapErrorAre) {
  Random random(34);
  const Pose reference = random_pose(random);
  Scan points = scan(reference, room_normals(random), 60, 0.01, 5.0, 0.0, random);
  for (std::size_t i = 0; i < points.matches.size(); ++i) points.matches[i].age_s = 1.5e-3F * static_cast<float>(i);
  Deskewing deskewing;
  deskewing.turn = so3::exp(random.vector(0.05));
  deskewing.velocity = random.vector();
  deskewing.before_position = random.vector(0.1);
  deskewing.before_velocity = random.vector();
  deskewing.step_s = 0.1;
  deskewing.gyroscope_density = 1e-6;
  deskewing.accelerometer_density = 4e-4;
  CondensedScan condensed = condense_scan(points.matches, reference, deskewing);
  condensed.by_lidar = true;
  condensed.beam_origin_m = random.vector(0.3);
  const CondensedLidarFactor factor(condensed, bend_mask(reference),
                                    {.before = true, .calibration = true, .map_error = true});
  Eigen::Matrix<double, 7, 1> calibration;
  calibration << random.vector(0.01), random.vector(0.02), 0.003;
  Vector6 map_error;
  map_error << random.vector(0.005), random.vector(0.05);
  const Pose end = reference.boxplus(0.02 * Vector6::Random());
  const Pose before = end * Pose{deskewing.turn.conjugate() * so3::exp(random.vector(0.01)), random.vector(0.1)};
  const Vector3 velocity = random.vector();
  const Vector3 velocity_before = random.vector();
  const auto residual = [&](double distance_m) {
    const Pose motion = slid_along_bend(reference, distance_m) * reference.inverse();
    const PoseBlock end_block = block_of(motion * end);
    const PoseBlock before_block = block_of(motion * before);
    MotionBlock end_motion{};
    MotionBlock before_motion{};
    Eigen::Map<Vector3>(end_motion.data()) = motion.rotation * velocity;
    Eigen::Map<Vector3>(before_motion.data()) = motion.rotation * velocity_before;
    const double* parameters[] = {end_block.data(),     end_motion.data(),  before_block.data(),
                                  before_motion.data(), calibration.data(), map_error.data()};
    Vector25 result;
    factor.Evaluate(parameters, result.data(), nullptr);
    return result;
  };
  const Vector25 there = residual(0.0);
  for (const double distance_m : {-2.0, 0.5, 5.0}) {
    EXPECT_LT((residual(distance_m) - there).norm(), 1e-6) << distance_m << " of " << there.norm();
  }
}

TEST(PriorFactor, HoldsNothingAgainstASlideAlongABendThatItDidNotSee) {
  Random random(32);
  const Pose pose = random_pose(random);
  const Vector3 velocity(0.7, -0.4, 0.1);
  const PoseBlock pose_block = block_of(pose);
  std::vector<double> motion(9, 0.01);
  Eigen::Map<Vector3>(motion.data()) = velocity;
  // Full information except for the slide, which rotates the velocity as well.
  Eigen::VectorXd hidden = Eigen::VectorXd::Zero(15);
  hidden.head<6>() = along_bend(pose);
  hidden.segment<3>(6) = (pose.rotation * Vector3(hidden.head<3>())).cross(velocity);
  hidden.normalize();
  const Eigen::MatrixXd known = 1e4 * Eigen::MatrixXd::Random(15, 15);
  const PriorFactor factor({{BlockKind::pose, {pose_block.begin(), pose_block.end()}}, {BlockKind::motion, motion}},
                           known - known * hidden * hidden.transpose(), Eigen::VectorXd::Zero(15),
                           Slide::along(along_bend(pose), pose));
  for (const double distance_m : {-2.0, 0.5, 5.0}) {
    const Pose there = slid_along_bend(pose, distance_m);
    const PoseBlock there_block = block_of(there);
    Eigen::Map<Vector3>(motion.data()) = there.rotation * (pose.rotation.conjugate() * velocity);
    Eigen::VectorXd residual(15);
    const double* parameters[] = {there_block.data(), motion.data()};
    factor.Evaluate(parameters, residual.data(), nullptr);
    // The residual is 1 for a tenth of a millimetre across the bend; the tangent is 31 mm off the bend after 5 m.
    EXPECT_LT(residual.norm(), 1e-5) << distance_m;
  }
}

TEST(PriorFactor, KnowsOfANewSlideWhatItKnewOfTheOldOneAndOfAllElseTheSame) {
  Random random(33);
  const Pose pose = random_pose(random);
  const PoseBlock pose_block = block_of(pose);
  std::vector<double> motion(9, 0.3);
  const Vector3 velocity(motion.data());
  const Eigen::MatrixXd known = Eigen::MatrixXd::Random(15, 15);
  const Slide before = Slide::along(along_bend(pose), pose);
  // 1° off, and another bend; the sign of a slide is arbitrary.
  Vector6 hidden;
  hidden << Vector3(0.0, 1e-3, -4e-3), -(so3::exp(Vector3(0.0, 0.0, 0.017)) * before.direction);
  const Slide now = Slide::along(hidden, pose);
  const auto step_of = [&](const Slide& slide, double sign) {
    Eigen::VectorXd step = Eigen::VectorXd::Zero(15);
    step.head<3>() = sign * (pose.rotation.conjugate() * slide.turn);
    step.segment<3>(3) = sign * slide.direction;
    step.segment<3>(6) = sign * slide.turn.cross(velocity);
    return step;
  };
  PriorFactor factor({{BlockKind::pose, {pose_block.begin(), pose_block.end()}}, {BlockKind::motion, motion}}, known,
                     Eigen::VectorXd::Zero(15), before);
  factor.follow(now);
  EXPECT_LT((factor.root() * step_of(now, -1.0) - known * step_of(before, 1.0)).norm(), 1e-12);
  Eigen::VectorXd across = Eigen::VectorXd::Random(15);
  across.segment<3>(3) -= now.direction * now.direction.dot(Vector3(across.segment<3>(3)));
  EXPECT_LT((factor.root() * across - known * across).norm(), 1e-12);
  // Far off it is another slide: the information stays.
  PriorFactor other({{BlockKind::pose, {pose_block.begin(), pose_block.end()}}, {BlockKind::motion, motion}}, known,
                    Eigen::VectorXd::Zero(15), before);
  Vector6 far;
  far << Vector3::Zero(), pose.rotation * Vector3::UnitY();
  other.follow(Slide::along(far, pose));
  EXPECT_EQ(other.root(), known);
}

TEST(PriorFactor, KnowsTheSameOfStatesThatAreMovedWithIt) {
  Random random(34);
  const Pose pose = random_pose(random);
  const PoseBlock pose_block = block_of(pose);
  const std::vector<double> motion(9, 0.3);
  for (const Slide& slide : {Slide{}, Slide::along(along_bend(pose), pose)}) {
    PriorFactor factor({{BlockKind::pose, {pose_block.begin(), pose_block.end()}}, {BlockKind::motion, motion}},
                       Eigen::MatrixXd::Random(15, 15), Eigen::VectorXd::Random(15), slide);
    const auto residual = [&](const Pose& at, const Vector3& velocity) {
      const PoseBlock block = block_of(at);
      std::vector<double> moving(9, 0.1);
      Eigen::Map<Vector3>(moving.data()) = velocity;
      const double* parameters[] = {block.data(), moving.data()};
      Eigen::VectorXd result(15);
      factor.Evaluate(parameters, result.data(), nullptr);
      return result;
    };
    const Pose there = pose.boxplus(0.1 * Vector6::Random());
    const Vector3 velocity(0.7, -0.4, 0.1);
    const Eigen::VectorXd before = residual(there, velocity);
    const Pose T_new_old{so3::exp({0.05, -0.1, 0.8}), {3.0, -2.0, 0.5}};
    factor.move(T_new_old);
    EXPECT_LT((residual(T_new_old * there, T_new_old.rotation * velocity) - before).norm(), 1e-9);
    EXPECT_GT((residual(there, velocity) - before).norm(), 0.1);
  }
}

TEST(PriorFactor, PassesTheGradientChecker) {
  Random random(9);
  const PoseManifold pose_manifold;
  const GravityManifold gravity_manifold;
  const ceres::EuclideanManifold<9> motion_manifold;
  const Pose pose = random_pose(random);
  const PoseBlock pose_block = block_of(pose);
  const Vector3 gravity(0.1, 0.2, -9.79);
  MotionBlock motion{};
  motion[0] = 0.8;
  std::vector<PriorBlock> blocks{{BlockKind::pose, {pose_block.begin(), pose_block.end()}},
                                 {BlockKind::motion, {motion.begin(), motion.end()}},
                                 {BlockKind::gravity, {gravity.x(), gravity.y(), gravity.z()}}};
  const PoseBlock moved = block_of(pose.boxplus(0.3 * Vector6::Ones()));
  const Vector3 turned = s2::boxplus(gravity, Vector2(0.2, -0.1));
  MotionBlock other{};
  other.fill(0.3);
  for (const Slide& slide : {Slide{}, Slide::along(along_bend(pose), pose)}) {
    const PriorFactor factor(blocks, Eigen::MatrixXd::Random(17, 17), Eigen::VectorXd::Random(17), slide);
    expect_gradients(factor, {&pose_manifold, &motion_manifold, &gravity_manifold},
                     {moved.data(), other.data(), turned.data()});
  }
}

}  // namespace
}  // namespace lodestone
