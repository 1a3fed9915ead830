#include "frontends/synchronizer/survey.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/frontends/synchronizer/listed_source.h"

namespace lodestone {
namespace {

TEST(SurveyTest, PutsReadingsWhereTheirSensorWasAndTurnsThemToTheMap) {
  SensorSuite suite;
  suite.magnetometers.push_back({"front", {Quaternion::Identity(), Vector3(1, 0, 0)}, 0.5});
  suite.magnetometers.push_back({"rear", {so3::exp(Vector3(0, 0, M_PI)), Vector3(-1, 0, 0)}, 2.0});
  const Quaternion left = so3::exp(Vector3(0, 0, M_PI / 2));
  const Trajectory trajectory{{0, {left, {0, 0, 0}}}, {100, {left, {10, 0, 0}}}, {900, {left, {10, 0, 0}}}};
  testing::ListedSource source({MagneticSample{50, 0, {3, 4, 5}}, ImuSample{60}, MagneticSample{50, 1, {3, 4, 5}},
                                MagneticSample{500, 0, {3, 4, 5}}, MagneticSample{950, 0, {3, 4, 5}}});
  const FieldSurvey survey = read_survey(source, trajectory, suite, 200);
  ASSERT_EQ(survey.observations.size(), 2U);
  EXPECT_EQ(survey.without_pose, 2);  // in a gap of the trajectory, and after its end
  EXPECT_LT((survey.observations[0].position - Vector3(5, 1, 0)).norm(), 1e-12);
  EXPECT_LT((survey.observations[0].field_ut - Vector3(-4, 3, 5)).norm(), 1e-12);
  EXPECT_LT((survey.observations[1].position - Vector3(5, -1, 0)).norm(), 1e-12);
  EXPECT_LT((survey.observations[1].field_ut - Vector3(4, -3, 5)).norm(), 1e-12);
  EXPECT_EQ(survey.observations[1].noise_ut, 2.0);
  EXPECT_EQ(survey.observations[1].time, 50);
}

FieldSurvey drive_with_times(std::vector<Time> times) {
  FieldSurvey drive;
  drive.without_pose = 2;
  for (const Time time : times) drive.observations.push_back({{0, 0, 0}, {20, 0, -40}, 1.0, time});
  return drive;
}

std::vector<Time> times_in(const FieldSurvey& survey) {
  std::vector<Time> times;
  for (const FieldObservation& observation : survey.observations) times.push_back(observation.time);
  return times;
}

TEST(SurveyTest, DrivesThatOverlapInTimeAreMovedBehindEachOther) {
  FieldSurvey survey;
  append_drive(survey, drive_with_times({100, 200}));
  append_drive(survey, drive_with_times({10, 20}));
  append_drive(survey, drive_with_times({300, 400}));
  EXPECT_EQ(times_in(survey), (std::vector<Time>{100, 200, 10, 20, 300, 400}))
      << "drives one after the other keep theirs";
  EXPECT_EQ(survey.without_pose, 6);
  append_drive(survey, drive_with_times({150, 170}));
  const std::vector<Time> times = times_in(survey);
  EXPECT_GT(times[6], 400);
  EXPECT_EQ(times[7] - times[6], 20);
}

TEST(SurveyTest, SplitsInBlocksOfWay) {
  std::vector<FieldObservation> observations(100);
  for (int i = 0; i < 100; ++i) {
    observations[i].time = from_seconds(1000.0 + i);
    observations[i].position.x() = i;
  }
  const HeldOutBlocks blocks(observations, 5.0, 10, 5);
  std::vector<Time> held_out;
  for (const FieldObservation& one : observations) {
    if (blocks.contain(one)) held_out.push_back(one.time);
  }
  ASSERT_EQ(held_out.size(), 10U);
  EXPECT_EQ(held_out.front(), from_seconds(1025.0));  // block 5 of 0..9
  EXPECT_EQ(held_out.back(), from_seconds(1079.0));
  // After thinning, each part contains only its own readings.
  const SurveySplit split = split_survey(observations, 0.5, blocks);
  ASSERT_EQ(split.held_out.size(), 10U);
  EXPECT_EQ(split.training.size(), 90U);
  EXPECT_EQ(split.held_out.front().position.x(), 25.0);
  EXPECT_EQ(split.held_out.front().count, 1);
  EXPECT_EQ(split.held_out.front().time, from_seconds(1025.0));
}

}  // namespace
}  // namespace lodestone
