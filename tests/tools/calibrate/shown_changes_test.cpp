// Changes of a calibration that go into the platform file.
#include "tools/calibrate/shown_changes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lodestone {
namespace {

std::vector<MagnetometerModel> named(const std::vector<std::string>& names) {
  std::vector<MagnetometerModel> models(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) models[i].name = names[i];
  return models;
}

/// One magnetometer whose parameters are known with a sigma of 0.01 each, and are zero.
MagnetometerCalibrationResult known(double sigma = 0.01) {
  MagnetometerCalibrationResult result;
  result.magnetometers.resize(1);
  result.magnetometers[0].readings = 100;
  result.covariance = sigma * sigma * Eigen::MatrixXd::Identity(12, 12);
  return result;
}

TEST(ShownChanges, KeepWhatExceedsTwoSigmasAndNothingElse) {
  MagnetometerCalibrationResult result = known();
  result.magnetometers[0].calibration.hard_iron_ut = {0.5, 0.019, -0.021};
  const ShownChanges changes = shown_changes(result);
  EXPECT_EQ(changes.calibrations[0].hard_iron_ut, Vector3(0.5, 0.0, -0.021));
  EXPECT_EQ(changes.calibrations[0].distortion, Matrix3::Identity());
  EXPECT_TRUE(changes.taken[0][0] && !changes.taken[0][1] && changes.taken[0][2] && !changes.taken[0][3]);
  const std::vector<MagnetometerModel> suite = named({"front"});
  EXPECT_EQ(left_as_given(changes, suite, result),
            "front: hard iron y, scale x, scale y, scale z, shear xy, shear xz, shear yz, turn x, "
            "turn y, turn z");
  EXPECT_EQ(left_as_given(shown_changes(known()), suite, known()), "front: everything");
}

TEST(ShownChanges, ASumThatIsKnownIsKeptWholeWhereItsPartsAreNot) {
  // In a nearly constant field of 40 µT, an offset along x and a scale along x have the same effect: 10 µT in total, to
  // 0.1 µT.
  MagnetometerCalibrationResult result = known();
  constexpr double kField_ut = 40.0, kOffset_ut = 6.0, kScale = 0.1;
  Eigen::Matrix2d information = Eigen::Vector2d(1.0 / (20.0 * 20.0), 1.0 / (0.25 * 0.25)).asDiagonal();  // priors
  const Eigen::Vector2d sum(1.0, kField_ut);
  information += sum * sum.transpose() / (0.1 * 0.1);
  const Eigen::Matrix2d covariance = information.inverse();
  for (const auto& [row, i] : {std::pair{0, 0}, {3, 1}}) {
    for (const auto& [column, k] : {std::pair{0, 0}, {3, 1}}) result.covariance(row, column) = covariance(i, k);
  }
  result.magnetometers[0].calibration.hard_iron_ut.x() = kOffset_ut;
  result.magnetometers[0].calibration.distortion(0, 0) = 1.0 + kScale;
  ASSERT_LT(kOffset_ut, 2.0 * std::sqrt(covariance(0, 0)));
  ASSERT_LT(kScale, 2.0 * std::sqrt(covariance(1, 1)));
  const MagnetometerCalibration kept = shown_changes(result).calibrations[0];
  const double read_ut = kept.hard_iron_ut.x() + (kept.distortion(0, 0) - 1.0) * kField_ut;
  EXPECT_NEAR(read_ut, kOffset_ut + kScale * kField_ut, 0.2);
  EXPECT_TRUE((kept.hard_iron_ut.x() == 0.0) != (kept.distortion(0, 0) == 1.0)) << "one of the two says it all";
}

TEST(ShownChanges, AChangeIsReportedAsItIsWrittenWithTheSigmaThatIsTested) {
  // The sum of two offsets is known to 0.1 µT, each of them to 7 µT.
  MagnetometerCalibrationResult result = known();
  constexpr double kVariance_ut2 = 49.0, kSumVariance_ut2 = 0.01;
  result.covariance.topLeftCorner<2, 2>() << kVariance_ut2, 0.5 * kSumVariance_ut2 - kVariance_ut2,
      0.5 * kSumVariance_ut2 - kVariance_ut2, kVariance_ut2;
  result.magnetometers[0].calibration.hard_iron_ut = {-2.9, 0.5, 0.0};
  const ShownChanges changes = shown_changes(result);
  const TestedChanges& tested = changes.tested[0];
  ASSERT_TRUE(changes.taken[0][0] && !changes.taken[0][1]);
  EXPECT_EQ(tested.change[0], changes.calibrations[0].hard_iron_ut.x());
  EXPECT_NEAR(tested.change[0], -2.4, 1e-3);  // the whole sum
  EXPECT_NEAR(tested.sigma[0], 0.1, 1e-3);
  EXPECT_EQ(tested.change[1], 0.5);
  EXPECT_NEAR(tested.sigma[1], 7.0, 1e-9);
  for (int i = 0; i < 12; ++i) {
    EXPECT_EQ(std::abs(tested.change[i]) >= 2.0 * tested.sigma[i], changes.taken[0][static_cast<std::size_t>(i)]) << i;
  }
}

TEST(ShownChanges, AMagnetometerWithoutReadingsIsLeftOut) {
  MagnetometerCalibrationResult result = known();
  result.magnetometers.insert(result.magnetometers.begin(), CalibratedMagnetometer{});
  result.magnetometers[1].calibration.hard_iron_ut.z() = 3.0;
  const ShownChanges changes = shown_changes(result);
  EXPECT_EQ(changes.calibrations[1].hard_iron_ut.z(), 3.0);
  EXPECT_EQ(left_as_given(changes, named({"dead", "front"}), result).find("dead"), std::string::npos);
}

}  // namespace
}  // namespace lodestone
