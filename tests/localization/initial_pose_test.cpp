#include "localization/initial_pose.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace lodestone {
namespace {

TEST(InitialPose, IsReadFromText) {
  const Pose pose = parse_initial_pose("1 2.5 -3e-1, 0 0 0.6 0.8");
  EXPECT_EQ(pose.position, Vector3(1.0, 2.5, -0.3));
  EXPECT_NEAR(pose.rotation.z(), 0.6, 1e-15);
  EXPECT_NEAR(pose.rotation.w(), 0.8, 1e-15);
}

TEST(InitialPose, RefusesWhatIsNoPose) {
  for (const char* text : {"", "1 2 3", "1 2 3 0 0 0 1 9", "1 2 3 0 0 0 one", "1 2 3 0 0 0 0", "nan 0 0 0 0 0 1"}) {
    EXPECT_THROW(parse_initial_pose(text), InputError) << text;
  }
}

TEST(InitialPose, IsInterpolatedInATrajectory) {
  const Trajectory trajectory{{from_seconds(10.0), {Quaternion::Identity(), {1.0, 0.0, 0.0}}},
                              {from_seconds(10.5), {Quaternion::Identity(), {2.0, 0.0, 0.0}}}};
  EXPECT_NEAR(initial_pose_from(trajectory, "t.tum", from_seconds(10.1)).position.x(), 1.2, 1e-12);
  // The trajectory may begin a little later than the log, because the robot stands still.
  EXPECT_EQ(initial_pose_from(trajectory, "t.tum", from_seconds(9.5)).position.x(), 1.0);
  EXPECT_THROW(initial_pose_from(trajectory, "t.tum", from_seconds(8.9)), InputError);
  EXPECT_THROW(initial_pose_from(trajectory, "t.tum", from_seconds(10.6)), InputError);
}

TEST(InitialPose, OfATrajectoryHasItsVelocity) {
  Trajectory trajectory;
  for (int i = 0; i <= 40; ++i) {
    const double t = 0.05 * i;
    trajectory.push_back({from_seconds(10.0 + t), {Quaternion::Identity(), {1.0 + 0.4 * t, -0.3 * t * t, 0.0}}});
  }
  // Over a constant acceleration, a mean about the middle is exact.
  EXPECT_TRUE(initial_velocity_from(trajectory, from_seconds(11.0)).isApprox(Vector3(0.4, -0.6, 0.0), 1e-9));
  // At its ends, the mean is of one side.
  EXPECT_TRUE(initial_velocity_from(trajectory, from_seconds(10.0)).isApprox(Vector3(0.4, -0.075, 0.0), 1e-9));
  // Before, the robot stands still; a single pose says nothing.
  EXPECT_EQ(initial_velocity_from(trajectory, from_seconds(9.5)), Vector3::Zero());
  EXPECT_EQ(initial_velocity_from({trajectory.front()}, from_seconds(10.0)), Vector3::Zero());
}

}  // namespace
}  // namespace lodestone
