#include "core/mapping/survey_errors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "drifting_survey.h"

namespace lodestone {
namespace {

using testing::SteelFloor;

/// Largest error of the horizontal offsets, µT.
double worst_horizontal(const std::vector<Vector3>& found, const std::vector<Vector3>& truth) {
  double worst = 0.0;
  for (std::size_t j = 0; j < truth.size(); ++j) {
    worst = std::max(worst, (found[j] - truth[j]).head<2>().cwiseAbs().maxCoeff());
  }
  return worst;
}

class SurveyOffsets : public ::testing::TestWithParam<int> {
 protected:
  /// Offsets of 2 µT, drawn anew for each seed, in a drive whose poses err by 1 cm.
  const SteelFloor floor_{static_cast<std::uint64_t>(100 + GetParam())};
  std::vector<Vector3> truth_;
  const std::vector<FieldObservation> readings_ =
      testing::drive_over(floor_, static_cast<std::uint64_t>(GetParam()), {0.01, 2.0, 1.0}, 0.0, &truth_);
};

TEST_P(SurveyOffsets, AreFoundInTheMagnetometersOwnAxes) {
  const std::vector<Vector3> found = survey_errors(readings_, {3.0, 0.0}).offsets_ut;
  EXPECT_LT(worst_horizontal(found, truth_), 0.3);
  // On a flat floor, passes show the vertical offsets of magnetometers relative to each other only.
  double square = 0.0;
  for (std::size_t j = 0; j < 3; ++j) {
    const Vector3 error = found[j] - truth_[j], next = found[(j + 1) % 3] - truth_[(j + 1) % 3];
    square += std::pow(next.z() - error.z(), 2) / 3.0;
  }
  EXPECT_LT(std::sqrt(square), 0.3);
}

TEST_P(SurveyOffsets, MakePassesAgree) {
  const std::vector<Vector3> found = survey_errors(readings_, {3.0, 0.0}).offsets_ut;
  const std::vector<FieldObservation> corrected = without_errors(readings_, {found});
  for (const Vector3& none : survey_errors(corrected, {3.0, 0.0}).offsets_ut) EXPECT_LT(none.head<2>().norm(), 0.05);
}

/// Late stamps move what is seen by 3 cm along each lane. Offsets of 2 µT are found together with them.
TEST_P(SurveyOffsets, OfTheClockAreFoundWithinTheirSigma) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  for (const double clock_s : {-0.03, 0.0, 0.03}) {
    std::vector<Vector3> truth;
    const std::vector<FieldObservation> readings =
        testing::drive_over(floor_, seed, {0.01, 2.0, 1.0, clock_s, 2.0}, 0.0, &truth);
    const SurveyErrors found = survey_errors(readings, {3.0, 0.1});
    EXPECT_LT(found.clock_sigma_s, 0.008);
    EXPECT_LT(std::abs(found.clock_s - clock_s), 3.0 * found.clock_sigma_s) << clock_s;
    EXPECT_LT(worst_horizontal(found.offsets_ut, truth), 0.3);
    // What is corrected is not found again.
    const SurveyErrors left = survey_errors(without_errors(readings, found), {3.0, 0.1});
    EXPECT_LT(std::abs(left.clock_s), 0.3 * found.clock_sigma_s);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, SurveyOffsets, ::testing::Range(1, 6));

TEST(SurveyOffsets, OfOnePassWithoutCrossingsAreZero) {
  std::vector<FieldObservation> lane;
  lane.reserve(500);
  for (int i = 0; i < 500; ++i) {
    lane.push_back({{0.02 * i, 0.05, 0.05},
                    {18.0 + 0.01 * i, 3.0, -42.0},
                    1.0,
                    from_seconds(0.02 * i),
                    0,
                    Quaternion::Identity()});
  }
  const SurveyErrors found = survey_errors(lane, {1.0, 0.05});
  EXPECT_EQ(found.offsets_ut[0], Vector3::Zero());
  EXPECT_EQ(found.clock_s, 0.0);
}

TEST(SurveyOffsets, IgnoreReadingsOfUnknownMagnetometers) {
  const SteelFloor floor(7);
  std::vector<FieldObservation> readings = testing::drive_over(floor, 7, {0.01, 2.0, 1.0});
  for (FieldObservation& one : readings) one.magnetometer = -1;
  const SurveyErrors found = survey_errors(readings, {3.0, 0.05});
  EXPECT_TRUE(found.offsets_ut.empty());
  EXPECT_EQ(found.clock_s, 0.0);
  const std::vector<FieldObservation> same = without_errors(readings, {{Vector3(1.0, 2.0, 3.0)}, 0.1});
  EXPECT_EQ(same.front().field_ut, readings.front().field_ut);
  EXPECT_EQ(same.front().position, readings.front().position);
}

/// Poses at the corrected times are on the way, also beside a pause and at the ends.
TEST(SurveyClock, MovesPosesAlongTheWay) {
  std::vector<FieldObservation> lane;
  const auto pose_at = [](double t, FieldObservation& one) {
    one.position = Vector3(2.0 * t, 0.0, 0.1);
    one.R_map_mag = Quaternion(Eigen::AngleAxisd(0.5 * t, Vector3::UnitZ()));
  };
  for (int i = 0; i < 300; ++i) {
    FieldObservation one;
    one.time = from_seconds(0.02 * i + (i < 150 ? 0.0 : 30.0));
    one.magnetometer = 0;
    pose_at(to_seconds(one.time), one);
    one.field_ut = one.R_map_mag * Vector3(20.0, 5.0, -40.0);
    lane.push_back(one);
  }
  for (const double clock_s : {-0.05, 0.033}) {
    for (const FieldObservation& one : without_errors(lane, {{}, clock_s})) {
      FieldObservation wanted;
      pose_at(to_seconds(one.time) - clock_s, wanted);
      EXPECT_LT((one.position - wanted.position).norm(), 1e-9);
      EXPECT_LT(one.R_map_mag.angularDistance(wanted.R_map_mag), 1e-9);
      EXPECT_LT((one.R_map_mag.conjugate() * one.field_ut - Vector3(20.0, 5.0, -40.0)).norm(), 1e-9);
    }
  }
}

TEST(SurveyOffsets, OfAFewWildPassesDoNotCount) {
  const SteelFloor floor(9);
  std::vector<Vector3> truth;
  std::vector<FieldObservation> readings = testing::drive_over(floor, 9, {0.01, 2.0, 1.0}, 0.0, &truth);
  // A vehicle beside the way in a twentieth of the drive.
  for (std::size_t i = 0; i < readings.size() / 20; ++i) readings[i].field_ut += Vector3(30.0, -20.0, 10.0);
  const std::vector<Vector3> found = survey_errors(readings, {3.0, 0.05}).offsets_ut;
  EXPECT_LT(worst_horizontal(found, truth), 0.4);
}

}  // namespace
}  // namespace lodestone
