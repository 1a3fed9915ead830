// Conditions for the warning that survey and trajectory may not belong together.
#include "tools/map/survey_doubts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace lodestone {
namespace {

using ::testing::HasSubstr;

FieldKernelFit fit_with(double noise, double by_likelihood) {
  FieldKernelFit fit;
  for (KernelParameters& kernel : fit.kernels) kernel.noise_sigma = noise;
  fit.uncalibrated_noise = Vector3::Constant(by_likelihood);
  return fit;
}

HeldOutScore missed_by(double sigmas, std::size_t cells = 500) {
  HeldOutScore score;
  score.cells = cells;
  score.normalized_rms = Vector3::Constant(sigmas);
  return score;
}

constexpr double kReading_ut = 1.0;

TEST(SurveyDoubts, AreNoneWhereReadingsAgree) {
  EXPECT_EQ(survey_doubts(fit_with(0.09, 0.09), kReading_ut, missed_by(1.0)), "");
  EXPECT_EQ(survey_doubts(fit_with(0.16, 0.05), kReading_ut, missed_by(1.0)),
            "");  // errors of the survey, below the noise
  EXPECT_EQ(survey_doubts(fit_with(2.5, 2.0), kReading_ut, missed_by(1.2)), "");
  EXPECT_EQ(survey_doubts(fit_with(0.09, 0.09), kReading_ut, std::nullopt), "");
  EXPECT_EQ(survey_doubts(fit_with(0.09, 0.09), kReading_ut, missed_by(9.0, 5)), "");  // five cells are too few
}

TEST(SurveyDoubts, NameFiguresAndCauses) {
  for (const std::string& doubts : {survey_doubts(fit_with(4.0, 0.5), kReading_ut, missed_by(0.6)),
                                    survey_doubts(fit_with(1.5, 0.4), kReading_ut, missed_by(0.6)),
                                    survey_doubts(fit_with(0.2, 0.2), kReading_ut, missed_by(8.0))}) {
    EXPECT_THAT(doubts, HasSubstr("of this drive"));
    EXPECT_THAT(doubts, HasSubstr("clock"));
    EXPECT_THAT(doubts, HasSubstr("T_imu_mag"));
  }
  EXPECT_THAT(survey_doubts(fit_with(4.0, 0.5), kReading_ut, std::nullopt), HasSubstr("4.00 uT per cell"));
  EXPECT_THAT(survey_doubts(fit_with(0.2, 0.2), kReading_ut, missed_by(8.0)), HasSubstr("by 8.0 sigma"));
}

TEST(SurveyDoubts, NameLayersThatNoReadingReaches) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const FieldGrid grid{0.5, {0.0, 0.0}, 5, 5, {0.1, 2.0}};
  std::vector<Eigen::Vector4f> nodes(50, Eigen::Vector4f(20.0F, 0.0F, -40.0F, 0.5F));
  std::vector<FieldObservation> readings(10);
  for (std::size_t i = 0; i < readings.size(); ++i)
    readings[i].position = {0.5 + 0.1 * static_cast<double>(i), 1.0, 0.1};
  EXPECT_EQ(unreached_heights(readings, MagneticMap(grid, nodes, 2.0)), "");
  std::fill(nodes.begin() + 25, nodes.end(), Eigen::Vector4f::Constant(nan));
  EXPECT_THAT(
      unreached_heights(readings, MagneticMap(grid, nodes, 2.0)),
      ::testing::AllOf(HasSubstr("no field at the height 2 m"), HasSubstr("at 0.100 to 0.100 m; change heights_m")));
}

}  // namespace
}  // namespace lodestone
