// The field of real rooms. Protocols and reference results: README.md of the data.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <random>

#include "core/magnetometer/localization.h"
#include "core/mapping/magnetic_map_builder.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using testing::read_csv;

/// One run of the AaltoML set: motion-capture position and field in map axes, sampled together. Runs are separated in
/// time, like passes of one survey.
std::vector<FieldObservation> read_aalto(int run) {
  const std::string stem =
      (testing::real_data_folder() / "magnetic" / "aalto" / ("invensense-" + std::to_string(run))).string();
  const auto time = read_csv(stem + "-time.csv");
  const auto location = read_csv(stem + "-loc.csv");
  const auto field = read_csv(stem + "-mag.csv");
  std::vector<FieldObservation> observations;
  for (std::size_t i = 0; i < std::min({time.size(), location.size(), field.size()}); ++i) {
    observations.push_back({{location[i].at(0), location[i].at(1), 0.0},
                            {field[i].at(0), field[i].at(1), field[i].at(2)},
                            0.3,
                            from_seconds(time[i].at(0)) + run * from_seconds(1000.0)});
  }
  return observations;
}

double distance_to_track(const std::vector<FieldObservation>& track, const Vector3& position) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const FieldObservation& observation : track) {
    nearest = std::min(nearest, (observation.position - position).head<2>().squaredNorm());
  }
  return std::sqrt(nearest);
}

class AaltoField : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(testing::real_data_folder() / "magnetic" / "aalto" / "invensense-4-mag.csv")) {
      GTEST_SKIP() << "no data in " << testing::real_data_folder() << "; set LODESTONE_DATA";
    }
    for (int run = 1; run <= 3; ++run) {
      const auto observations = read_aalto(run);
      training_.insert(training_.end(), observations.begin(), observations.end());
    }
    for (const FieldObservation& observation : read_aalto(4)) {
      if (distance_to_track(training_, observation.position) <= 0.05) near_track_.push_back(observation);
    }
    ASSERT_GT(near_track_.size(), 1000U);
  }

  std::vector<FieldObservation> training_;    ///< runs 1 to 3
  std::vector<FieldObservation> near_track_;  ///< of run 4, within 5 cm of them
};

TEST_F(AaltoField, MapOfThreeRunsPredictsTheFourthAsWellAsTheBestKernelFit) {
  for (const double resolution : {0.05, 0.1}) {
    MagneticMapOptions options;
    options.resolution_m = resolution;
    options.max_sigma_ut = 1e3;
    const MagneticMapResult result = build_magnetic_map(training_, options);
    Vector3 squares = Vector3::Zero();
    Vector3 normalized = Vector3::Zero();
    int answered = 0;
    for (const FieldObservation& observation : near_track_) {
      const auto value = result.map.query(observation.position, FieldInterpolation::bicubic);
      if (!value) continue;
      ++answered;
      const Vector3 square = (observation.field_ut - value->field_ut).cwiseAbs2();
      squares += square;
      for (int k = 0; k < 3; ++k) {
        const double sigma = value->sigma_ut * result.map.errors().sigma_shares[k];
        normalized[k] += square[k] / (sigma * sigma + 0.09);
      }
    }
    const Vector3 rms = (squares / answered).cwiseSqrt();
    normalized = (normalized / answered).cwiseSqrt();
    std::printf("map every %.2f m: rms %.2f %.2f %.2f uT over %d readings, over their sigma %.2f %.2f %.2f\n",
                resolution, rms.x(), rms.y(), rms.z(), answered, normalized.x(), normalized.y(), normalized.z());
    EXPECT_EQ(answered, static_cast<int>(near_track_.size()));
    EXPECT_LT(rms.x(), 1.1 * 3.0);
    EXPECT_LT(rms.y(), 1.1 * 3.2);
    EXPECT_LT(rms.z(), 1.1 * 1.3);
    // The map's own sigma, without white noise. Without the error between drives, this is 1.3 to 3.
    EXPECT_LT(normalized.maxCoeff(), resolution < 0.1 ? 1.5 : 1.3);
    EXPECT_GT(normalized.minCoeff(), 0.7);
  }
}

TEST_F(AaltoField, SigmaIsThatOfOtherDrivesThroughTheUnchangedRoom) {
  const MagneticMapResult result = build_magnetic_map(training_, {});
  for (const int run : {4, 5}) {
    Vector3 normalized = Vector3::Zero();
    int answered = 0, above = 0;
    const std::vector<FieldObservation> drive = read_aalto(run);
    for (const FieldObservation& reading : drive) {
      const auto value = result.map.query(reading.position, FieldInterpolation::bicubic);
      if (!value) continue;
      const Vector3 variance = (value->sigma_ut * result.map.errors().sigma_shares).cwiseAbs2().array() +
                               reading.noise_ut * reading.noise_ut;
      const Vector3 ratio = (reading.field_ut - value->field_ut).cwiseAbs2().cwiseQuotient(variance);
      normalized += ratio;
      ++answered;
      above += ratio.sum() > 14.16;  // 99.73 % of χ² with three degrees of freedom
    }
    normalized = (normalized / answered).cwiseSqrt();
    const double share = static_cast<double>(above) / answered;
    const double with_field = static_cast<double>(answered) / static_cast<double>(drive.size());
    std::printf("run %d: %.2f %.2f %.2f of the sigma, %.2f %% above 3 sigma, field on %.1f %%\n", run, normalized.x(),
                normalized.y(), normalized.z(), 100.0 * share, 100.0 * with_field);
    EXPECT_GT(normalized.minCoeff(), 0.7);
    EXPECT_LT(normalized.maxCoeff(), 1.3);
    EXPECT_LT(share, 0.02);
    EXPECT_GT(with_field, 0.9);
  }
  EXPECT_NEAR(result.map.errors().correlation_m, 0.3, 0.15);
}

// The data's README reports 5.4 cm with a protocol that is not fully described. Here: prior of 10 cm per axis (14 cm in
// the plane), error in the plane, every third reading near the track. Gauss-Newton gives 10.2 cm (7.2 cm per axis);
// exhaustive search for the maximum of the same posterior gives 8.5 to 9 cm (6.0 cm per axis). Most of the rest is
// therefore the error of map and survey, not of the method.
TEST_F(AaltoField, OneReadingImprovesOnItsPrior) {
  MagneticMapOptions options;
  options.resolution_m = 0.05;
  const MagneticMapResult result = build_magnetic_map(training_, options);
  SensorSuite suite;
  suite.magnetometers.push_back({"invensense", Pose{}, 1.0});
  suite.magnetometers[0].noise_ut = 0.3;  // the map's sigma contains all other errors of a reading
  MagneticLocalizationOptions localization;
  localization.interpolation = FieldInterpolation::bicubic;

  constexpr double prior_m = 0.1;  // per axis: 14 cm in the plane
  Vector6 sigma;
  sigma << 1e-6, 1e-6, 1e-6, prior_m, prior_m, 1e-6;  // heading and height are known
  const Matrix6 prior = sigma.cwiseAbs2().asDiagonal();
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  double before = 0.0;
  double after = 0.0;
  double normalized = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < near_track_.size(); i += 3) {
    const Vector3& truth = near_track_[i].position;
    const Vector3 offset(prior_m * normal(generator), prior_m * normal(generator), 0.0);
    MagneticArraySample sample;
    sample.field_ut = {near_track_[i].field_ut};
    const auto found =
        localize({Quaternion::Identity(), truth + offset}, prior, sample, suite, result.map, localization);
    if (found.used == 0) continue;
    ++count;
    const Eigen::Vector2d error = (found.T_map_imu.position - truth).head<2>();
    before += offset.squaredNorm();
    after += error.squaredNorm();
    normalized += error.dot(found.covariance.block<2, 2>(3, 3).ldlt().solve(error)) / 2.0;
  }
  std::printf("one reading: %.1f cm rms from a prior of %.1f cm, NEES %.2f, %d readings\n",
              100 * std::sqrt(after / count), 100 * std::sqrt(before / count), normalized / count, count);
  EXPECT_GT(count, 500);
  EXPECT_LT(std::sqrt(after / count), 0.8 * std::sqrt(before / count));
  EXPECT_LT(normalized / count, 3.0);
}

TEST(OsmanField, BlocksOfTimeHeldOutArePredictedToThirdsOfAMicrotesla) {
  const auto path = testing::real_data_folder() / "magnetic" / "osman_simple.csv";
  if (!std::filesystem::exists(path))
    GTEST_SKIP() << "no data in " << testing::real_data_folder() << "; set LODESTONE_DATA";
  std::vector<FieldObservation> observations;
  for (const auto& row : read_csv(path)) {
    const Quaternion R_map_imu(row.at(16), row.at(13), row.at(14), row.at(15));
    observations.push_back(
        {{row[10], row[11], row[12]}, R_map_imu * Vector3(row[7], row[8], row[9]), 0.1, from_seconds(row[0])});
  }
  const auto is_held_out = [&](const FieldObservation& one) {
    return (one.time - observations.front().time) / from_seconds(1.0) % 10 == 5;
  };
  std::vector<FieldObservation> training, held_out;
  for (const FieldObservation& one : observations) (is_held_out(one) ? held_out : training).push_back(one);
  const SlidingGprOptions options;
  const FieldKernelFit fit = fit_field_kernels(training, 0.1, options);
  std::vector<Vector3> points;
  for (const FieldObservation& observation : held_out) points.push_back(observation.position);
  const auto predictions = SlidingGpr(thin_survey(training, fit.cell_m), fit.kernels, options).predict(points);
  Vector3 squares = Vector3::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_TRUE(predictions[i].supported);
    squares += (predictions[i].field_ut - held_out[i].field_ut).cwiseAbs2();
  }
  const Vector3 rms = (squares / static_cast<double>(points.size())).cwiseSqrt();
  std::printf("held out: rms %.2f %.2f %.2f uT over %zu readings\n", rms.x(), rms.y(), rms.z(), points.size());
  EXPECT_LT(rms.maxCoeff(), 0.34);
}

}  // namespace
}  // namespace lodestone
