#include "core/magnetometer/field_evidence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lodestone {
namespace {

/// A field with texture over 10 × 10 m, and an array with four readings of it.
class FieldEvidenceOfAnArray : public ::testing::Test {
 protected:
  static Vector3 field_at(double x, double y) {
    return {15.0 + 5.0 * std::sin(2.0 * x) * std::cos(1.7 * y), 3.0 + 6.0 * std::cos(1.3 * x + y),
            -35.0 + 4.0 * std::sin(y - x)};
  }
  FieldEvidenceOfAnArray() : map_(make_map()), background_(field_background(map_)) {
    for (const auto& [x, y] : {std::pair{0.3, 0.25}, {0.3, -0.25}, {-0.3, 0.25}, {-0.3, -0.25}}) {
      MagnetometerModel model;
      model.T_imu_mag.position = Vector3(x, y, 0.0);
      suite_.magnetometers.push_back(model);
    }
  }
  static MagneticMap make_map() {
    FieldGrid grid;
    grid.resolution_m = 0.1;
    grid.columns = grid.rows = 101;
    grid.heights_m = {0.0};
    std::vector<Eigen::Vector4f> nodes;
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const Vector3 field = field_at(0.1 * column, 0.1 * row);
        nodes.emplace_back(field.x(), field.y(), field.z(), 0.3F);
      }
    }
    return MagneticMap(grid, nodes, 3.0);
  }
  /// The readings at `pose`.
  ArrayReading read(const Pose& pose) const {
    ArrayReading array;
    for (std::size_t j = 0; j < suite_.magnetometers.size(); ++j) {
      const Pose& mount = suite_.magnetometers[j].T_imu_mag;
      const Vector3 place = pose * mount.position;
      array.readings.push_back(
          {mount, pose.rotation.conjugate() * field_at(place.x(), place.y()), static_cast<int>(j), 10});
    }
    return array;
  }
  double evidence(const ArrayReading& array, const Pose& pose) const {
    return field_evidence(array, pose, suite_, map_, background_).log_likelihood;
  }

  SensorSuite suite_;
  MagneticMap map_;
  FieldBackground background_;
};

TEST_F(FieldEvidenceOfAnArray, IsHighestAtTheTruePlaceAndHigherThanAnywhereOffTheMap) {
  const Pose truth{Quaternion(Eigen::AngleAxisd(0.4, Vector3::UnitZ())), {5.0, 4.0, 0.0}};
  const ArrayReading array = read(truth);
  const double here = evidence(array, truth);
  for (const Vector3& step : {Vector3(0.4, 0.0, 0.0), Vector3(0.0, -0.5, 0.0), Vector3(3.0, 2.0, 0.0)}) {
    EXPECT_LT(evidence(array, {truth.rotation, truth.position + step}), here - 2.0) << step.transpose();
  }
  EXPECT_LT(evidence(array, {truth.rotation, {100.0, 0.0, 0.0}}), here - 2.0);
}

/// Readings whose magnetometers are off by what the platform file allows still tell the place; if it promises exact
/// magnetometers, the same readings look like those of a map that has changed.
TEST_F(FieldEvidenceOfAnArray, OffsetsThatThePlatformFileAllowsDoNotSpeakAgainstTheTruePlace) {
  const Pose truth{Quaternion::Identity(), {5.0, 4.0, 0.0}};
  const auto mean_odds = [&](double offset_sigma_ut) {
    suite_.calibration = exact_calibration();
    suite_.calibration.magnetometers.offset_sigma_ut = offset_sigma_ut;
    std::mt19937_64 generator(5);
    std::normal_distribution<double> offset(0.0, 2.0);
    double sum = 0.0;
    for (int draw = 0; draw < 100; ++draw) {
      ArrayReading array = read(truth);
      for (MeanReading& reading : array.readings) {
        const double x = offset(generator), y = offset(generator), z = offset(generator);
        reading.measured_ut += Vector3(x, y, z);
      }
      sum += evidence(array, truth) - evidence(array, {truth.rotation, {100.0, 0.0, 0.0}});
    }
    return sum / 100.0;
  };
  EXPECT_GT(mean_odds(2.0), 1.0);
  EXPECT_LT(mean_odds(0.0), -1.0);
}

/// The others tell the place. Before, the odds were those of a map that has changed.
TEST_F(FieldEvidenceOfAnArray, AMagnetometerThatHasDriftedSaysLittle) {
  suite_.calibration = exact_calibration();
  const Pose truth{Quaternion(Eigen::AngleAxisd(0.4, Vector3::UnitZ())), {5.0, 4.0, 0.0}};
  const Pose off_map{truth.rotation, {100.0, 0.0, 0.0}};
  const double of_all = evidence(read(truth), truth) - evidence(read(truth), off_map);
  for (const Vector3& drift_ut : {Vector3(40.0, 0.0, 0.0), Vector3(-8.0, 10.0, 4.0)}) {
    ArrayReading array = read(truth);
    array.readings[1].measured_ut += drift_ut;
    EXPECT_GT(evidence(array, truth) - evidence(array, off_map), 0.5 * of_all) << drift_ut.transpose();
    EXPECT_LT(evidence(array, {truth.rotation, {8.0, 6.0, 0.0}}), evidence(array, off_map)) << drift_ut.transpose();
  }
}

TEST_F(FieldEvidenceOfAnArray, OfAMapThatHasChangedIsBoundedByTheShareOfStaleMap) {
  const Pose truth{Quaternion::Identity(), {5.0, 4.0, 0.0}};
  ArrayReading array = read(truth);
  for (MeanReading& reading : array.readings)
    reading.measured_ut += Vector3(60.0, -30.0, 20.0);  // a car is parked here now
  const double off_map = evidence(array, {truth.rotation, {100.0, 0.0, 0.0}});
  EXPECT_GE(evidence(array, truth), off_map + kFieldTrust * std::log(kStaleShare) - 1e-9);
  EXPECT_LE(evidence(array, truth), off_map);
}

}  // namespace
}  // namespace lodestone
