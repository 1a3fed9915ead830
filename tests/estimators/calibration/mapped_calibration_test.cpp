// Calibration against an inexact map, on a robot that drives level through a field with steel.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <numbers>

#include "estimators/calibration/magnetometer_calibrator.h"
#include "tests/estimators/calibration/simulated_array.h"

namespace lodestone {
namespace {

using testing::SimulatedArray;

constexpr double kMapSigma_ut = 0.5;
constexpr double kMapCorrelation_m = 0.3;

/// A drive in loops, heading along the path.
Pose loops(double t) {
  const auto place = [](double s) { return Vector3(1.6 * std::sin(0.25 * s), 1.1 * std::sin(0.4 * s + 0.5), 0.2); };
  const Vector3 ahead = place(t + 0.01) - place(t - 0.01);
  return {so3::exp(Vector3(0.0, 0.0, std::atan2(ahead.y(), ahead.x()))), place(t)};
}

/// The field with an error that is constant over the correlation length.
MagneticMap erring_map(unsigned seed) {
  constexpr int kWaves = 60;
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> phase(0.0, 2.0 * std::numbers::pi);
  struct Wave {
    Eigen::Vector2d number;
    double phase;
  };
  std::vector<Wave> waves(3 * kWaves);
  for (Wave& wave : waves)
    wave = {Eigen::Vector2d(normal(generator), normal(generator)) / kMapCorrelation_m, phase(generator)};
  FieldGrid grid;
  grid.resolution_m = 0.1;
  grid.origin = Eigen::Vector2d(-2.5, -2.0);
  grid.columns = 51;
  grid.rows = 41;
  grid.heights_m = {0.2};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector2d at = grid.origin + grid.resolution_m * Eigen::Vector2d(column, row);
      Vector3 field = testing::field_with_steel({at.x(), at.y(), 0.2});
      for (int i = 0; i < 3 * kWaves; ++i) {
        const Wave& wave = waves[static_cast<std::size_t>(i)];
        field[i % 3] += kMapSigma_ut * std::sqrt(2.0 / kWaves) * std::cos(wave.number.dot(at) + wave.phase);
      }
      nodes.emplace_back(field.x(), field.y(), field.z(), kMapSigma_ut);
    }
  }
  return MagneticMap(grid, nodes, 10.0);
}

SimulatedArray drive(unsigned seed) {
  SimulatedArray array(3);
  for (MagnetometerModel& model : array.suite.magnetometers) model.T_imu_mag.position.z() = 0.0;
  array.seed = seed;
  array.motion = loops;
  array.field = testing::field_with_steel;
  return array;
}

MagnetometerCalibrationResult calibrate_in_map(const SimulatedArray& array, const MagneticMap& map,
                                               CalibrationOptions options = {}) {
  options.max_moments = 300;  // limits the duration
  return calibrate_magnetometers(mapped_log(array.readings, array.trajectory, map, array.suite, options), options);
}

class LevelDriveWithAMap : public ::testing::Test {
 protected:
  LevelDriveWithAMap() : array_(drive(5)) {
    for (std::size_t j = 0; j < 3; ++j) {
      const auto share = static_cast<double>(j);
      array_.truth[j].hard_iron_ut = Vector3(10.0 - 8.0 * share, 5.0 * share, 6.0 - 4.0 * share);
    }
    array_.run();
  }

  Vector3 error(const MagnetometerCalibrationResult& result, std::size_t j) const {
    return result.magnetometers[j].calibration.hard_iron_ut - array_.truth[j].hard_iron_ut;
  }

  SimulatedArray array_;
};

// In a field that hardly changes, an offset and a tilt have the same effect. Their sum is determined, each alone is
// not, and the sigmas reflect this.
TEST_F(LevelDriveWithAMap, ShowsWhatEachReadsBesideTheField) {
  const MagnetometerCalibrationResult result = calibrate_in_map(array_, erring_map(7));
  for (std::size_t j = 0; j < 3; ++j) {
    const CalibratedMagnetometer& one = result.magnetometers[j];
    std::printf(
        "%zu: before %.2f after %.2f; hard iron error %.3f (%.3f) %.3f (%.3f) %.3f (%.3f); beside the usual field "
        "(%.3f %.3f %.3f)\n",
        j, one.before_ut, one.after_ut, error(result, j).x(), one.sigma[0], error(result, j).y(), one.sigma[1],
        error(result, j).z(), one.sigma[2], one.usual_error_sigma_ut.x(), one.usual_error_sigma_ut.y(),
        one.usual_error_sigma_ut.z());
    EXPECT_LT((one.usual_error_ut - array_.truth[j].hard_iron_ut).cwiseAbs().maxCoeff(), 0.3);
    EXPECT_LT(one.usual_error_sigma_ut.maxCoeff(), 0.3);
    EXPECT_LT(error(result, j).cwiseQuotient(one.sigma.head<3>()).cwiseAbs().maxCoeff(), 3.0);
    EXPECT_LT(one.after_ut, 1.2 * std::hypot(kMapSigma_ut, 0.56));
  }
}

TEST_F(LevelDriveWithAMap, ShowsAllOfTheHardIronWhereThereIsNothingElse) {
  CalibrationOptions options;
  options.soft_iron_sigma = 1e-3;
  options.misalignment_sigma_deg = 0.05;
  const MagnetometerCalibrationResult result = calibrate_in_map(array_, erring_map(7), options);
  for (std::size_t j = 0; j < 3; ++j) EXPECT_LT(error(result, j).cwiseAbs().maxCoeff(), 0.3);
  for (const std::string& line : result.held) EXPECT_THAT(line, ::testing::Not(::testing::HasSubstr("offset")));
}

TEST(CalibrateAgainstAMap, ErrorsAreWhatTheirSigmasSay) {
  double squares = 0.0, usual = 0.0;
  int count = 0, usual_count = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SimulatedArray array = drive(seed);
    array.draw_truth(20.0, 0.05, 2.0 * std::numbers::pi / 180.0);
    array.run();
    const MagnetometerCalibrationResult result = calibrate_in_map(array, erring_map(100 + seed));
    for (std::size_t j = 0; j < 3; ++j) {
      const CalibratedMagnetometer& one = result.magnetometers[j];
      CalibrationParameters error;
      error << one.calibration.hard_iron_ut - array.truth[j].hard_iron_ut,
          distortion_of(one.calibration.distortion) - distortion_of(array.truth[j].distortion);
      squares += error.cwiseQuotient(one.sigma).squaredNorm();
      count += 12;
      const Vector3 beside = one.calibration.distortion * one.usual_field_ut + one.calibration.hard_iron_ut -
                             array.truth[j].distortion * one.usual_field_ut - array.truth[j].hard_iron_ut;
      usual += beside.cwiseQuotient(one.usual_error_sigma_ut).squaredNorm();
      usual_count += 3;
    }
  }
  std::printf("mean square of %d errors over their sigmas %.2f; of what is read beside the usual field %.2f\n", count,
              squares / count, usual / usual_count);
  EXPECT_LT(squares / count, 1.5);
  EXPECT_GT(squares / count, 0.4);
  EXPECT_LT(usual / usual_count, 2.0);
  EXPECT_GT(usual / usual_count, 0.2);
}

/// A drive whose field has changed since the survey; the magnetometers have no errors unless given.
SimulatedArray changed_drive(unsigned seed, const std::function<Vector3(const Vector3&)>& field) {
  SimulatedArray array = drive(seed);
  array.field = field;
  return array;
}

Vector3 scaled_field(const Vector3& place) {
  return 1.2 * testing::field_with_steel(place);
}

/// Error of a magnetometer's calibration against the mapped field, over its sigma.
double blame(const CalibratedMagnetometer& one) {
  CalibrationParameters change;
  change << one.calibration.hard_iron_ut, distortion_of(one.calibration.distortion);
  return change.cwiseQuotient(one.sigma).cwiseAbs().maxCoeff();
}

void print_change(const MagnetometerCalibrationResult& result) {
  const FieldChange& change = result.field_change;
  std::printf(
      "change %d: p %.1e, scale %.3f (%.3f), offset %.2f %.2f %.2f (%.2f %.2f %.2f); %zu of %zu places; map "
      "scale %.2f, %d rounds\n",
      change.everywhere, change.p_value, change.change[0], change.sigma[0], change.change[1], change.change[2],
      change.change[3], change.sigma[1], change.sigma[2], change.sigma[3], change.changed_places(),
      change.places.size(), result.process.map_scale, result.rounds);
  for (const CalibratedMagnetometer& one : result.magnetometers) {
    const Distortion e = distortion_of(one.calibration.distortion);
    std::printf(
        "  hard iron %.2f %.2f %.2f (%.2f %.2f %.2f), scale %.3f %.3f %.3f (%.3f %.3f %.3f), usual %.2f %.2f %.2f "
        "(%.2f %.2f %.2f), before %.2f after %.2f, blame %.2f\n",
        one.calibration.hard_iron_ut.x(), one.calibration.hard_iron_ut.y(), one.calibration.hard_iron_ut.z(),
        one.sigma[0], one.sigma[1], one.sigma[2], e[0], e[1], e[2], one.sigma[3], one.sigma[4], one.sigma[5],
        one.usual_error_ut.x(), one.usual_error_ut.y(), one.usual_error_ut.z(), one.usual_error_sigma_ut.x(),
        one.usual_error_sigma_ut.y(), one.usual_error_sigma_ut.z(), one.before_ut, one.after_ut, blame(one));
  }
}

TEST(CalibrateInAChangedField, AScaleThatAllMagnetometersShareIsTheMaps) {
  SimulatedArray array = changed_drive(11, scaled_field);
  array.run();
  const MagnetometerCalibrationResult result = calibrate_in_map(array, erring_map(7));
  print_change(result);
  const FieldChange& change = result.field_change;
  EXPECT_TRUE(change.everywhere);
  EXPECT_NEAR(1.0 + change.change[0], 1.2, 3.0 * change.sigma[0]);
  EXPECT_LT(change.sigma[0], 0.05);
  EXPECT_NEAR(change.difference_ut, 0.2 * testing::field_with_steel(Vector3(0.0, 0.0, 0.2)).norm(), 2.0);
  for (const CalibratedMagnetometer& one : result.magnetometers) {
    EXPECT_LT(blame(one), 2.5);
    EXPECT_LT(distortion_of(one.calibration.distortion).head<3>().cwiseAbs().maxCoeff(), 0.04);
  }
}

// Along x and y of the map, an offset rotates relative to the robot. Along z, a level drive cannot distinguish map and
// magnetometers: the offset stays within a large sigma.
TEST(CalibrateInAChangedField, AnOffsetInMapAxesIsTheMaps) {
  const Vector3 offset(6.0, -4.0, 5.0);
  SimulatedArray array =
      changed_drive(12, [&](const Vector3& place) { return Vector3(testing::field_with_steel(place) + offset); });
  array.run();
  const MagnetometerCalibrationResult result = calibrate_in_map(array, erring_map(8));
  print_change(result);
  const FieldChange& change = result.field_change;
  EXPECT_TRUE(change.everywhere);
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(change.change[1 + axis], offset[axis], 3.0 * change.sigma[1 + axis]) << axis;
  EXPECT_LT(change.sigma.segment<2>(1).maxCoeff(), 1.0);
  EXPECT_THAT(change.like_sensors, ::testing::ElementsAre(2));
  for (const CalibratedMagnetometer& one : result.magnetometers) {
    EXPECT_LT(blame(one), 2.5);
    EXPECT_LT(one.usual_error_ut.head<2>().cwiseAbs().maxCoeff(), 1.0);
    EXPECT_GT(one.usual_error_sigma_ut.z(), 2.0);
  }
}

TEST(CalibrateInAChangedField, PlacesThatChangedAreNamedAndBlameNobody) {
  const Vector3 steel(1.6, 1.0, 0.8), moment(2.5, -3.0, 6.0);
  const auto field = [&](const Vector3& place) {
    const Vector3 away = place - steel;
    const Vector3 direction = away.normalized();
    return Vector3(testing::field_with_steel(place) +
                   (3.0 * direction.dot(moment) * direction - moment) / std::pow(away.norm(), 3));
  };
  SimulatedArray array = changed_drive(13, field);
  array.truth[1].hard_iron_ut = Vector3(4.0, -6.0, 0.0);
  array.run();
  const MagnetometerCalibrationResult result = calibrate_in_map(array, erring_map(9));
  print_change(result);
  const FieldChange& change = result.field_change;
  std::size_t far_changed = 0, far = 0, near_changed = 0, near = 0;
  for (const ComparedPlace& place : change.places) {
    const double changed_ut = (field(place.centre_m) - testing::field_with_steel(place.centre_m)).norm();
    std::printf("    (%.2f %.2f) true change %.2f found %.2f (%.2f) p %.1e\n", place.centre_m.x(), place.centre_m.y(),
                changed_ut, place.difference_ut.norm(), place.sigma_ut, place.p_value);
    near += changed_ut > 5.0 ? 1 : 0;
    near_changed += changed_ut > 5.0 && place.changed ? 1 : 0;
    far += changed_ut < 0.5 ? 1 : 0;
    far_changed += changed_ut < 0.5 && place.changed ? 1 : 0;
  }
  std::printf("  near %zu of %zu, far %zu of %zu\n", near_changed, near, far_changed, far);
  EXPECT_FALSE(change.everywhere);
  EXPECT_GT(near, 2U);
  EXPECT_EQ(near_changed, near);
  EXPECT_LE(far_changed, 1U);
  EXPECT_LT(blame(result.magnetometers[0]), 3.0);
  EXPECT_LT(blame(result.magnetometers[2]), 3.0);
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_LT((result.magnetometers[j].usual_error_ut - array.truth[j].hard_iron_ut).cwiseAbs().maxCoeff(), 0.5);
  }
}

// Differences between single magnetometers are also found in a changed field.
TEST(CalibrateInAChangedField, DifferencesBetweenMagnetometersAreTheirs) {
  SimulatedArray array = changed_drive(14, scaled_field);
  array.truth[0].hard_iron_ut = Vector3(8.0, -6.0, 7.0);
  array.truth[2].hard_iron_ut = Vector3(-8.0, 6.0, -7.0);
  array.run();
  const MagnetometerCalibrationResult result = calibrate_in_map(array, erring_map(10));
  print_change(result);
  EXPECT_TRUE(result.field_change.everywhere);
  const auto difference = [&](std::size_t j, std::size_t k) -> Vector3 {
    const auto in_imu_axes = [&](std::size_t i, const Vector3& v) -> Vector3 {
      return array.suite.magnetometers[i].T_imu_mag.rotation * v;
    };
    return in_imu_axes(j, result.magnetometers[j].usual_error_ut - array.truth[j].hard_iron_ut) -
           in_imu_axes(k, result.magnetometers[k].usual_error_ut - array.truth[k].hard_iron_ut);
  };
  EXPECT_LT(difference(0, 1).cwiseAbs().maxCoeff(), 0.5);
  EXPECT_LT(difference(2, 1).cwiseAbs().maxCoeff(), 0.5);
  for (std::size_t j = 0; j < 3; ++j)
    EXPECT_LT((result.magnetometers[j].usual_error_ut - array.truth[j].hard_iron_ut).head<2>().cwiseAbs().maxCoeff(),
              1.0);
}

TEST(CalibrateInAChangedField, AFieldThatIsAsMappedIsNotCalledChanged) {
  std::size_t changed = 0, places = 0;
  for (unsigned seed = 21; seed <= 26; ++seed) {
    SimulatedArray array = drive(seed);
    array.draw_truth(20.0, 0.05, 2.0 * std::numbers::pi / 180.0);
    array.run();
    const MagnetometerCalibrationResult result = calibrate_in_map(array, erring_map(100 + seed));
    print_change(result);
    EXPECT_FALSE(result.field_change.everywhere);
    EXPECT_EQ(result.field_change.change, MapChange::Zero());
    changed += result.field_change.changed_places();
    places += result.field_change.places.size();
  }
  std::printf("%zu of %zu places called changed\n", changed, places);
  EXPECT_LT(static_cast<double>(changed), 0.01 * static_cast<double>(places));
}

TEST(ChangeSize, IsThatOfTheLargestLikelihood) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 20; ++i) {
    Eigen::Matrix4d root;
    for (double& entry : root.reshaped()) entry = normal(generator);
    const Eigen::Matrix4d covariance = root * root.transpose() + 0.1 * Eigen::Matrix4d::Identity();
    Eigen::Vector4d estimate;
    for (double& entry : estimate) entry = 3.0 * normal(generator);
    const auto log_likelihood = [&](double size) {
      const Eigen::Matrix4d whole = covariance + size * size * Eigen::Matrix4d::Identity();
      return -0.5 * std::log(whole.determinant()) - 0.5 * estimate.dot(whole.inverse() * estimate);
    };
    const Eigen::Matrix4d information = covariance.inverse();
    const ChangeSize found = change_size(information, information * estimate);
    for (double size = 0.0; size < 20.0; size += 0.05) {
      EXPECT_GE(log_likelihood(found.size_ut), log_likelihood(size) - 1e-3) << size << " instead of " << found.size_ut;
    }
  }
}

// A direction that the log does not determine has no effect.
TEST(ChangeSize, NeedsNoInformationAboutEveryDirection) {
  const Eigen::Matrix4d information = Eigen::Vector4d(4.0, 0.0, 4.0, 0.0).asDiagonal();
  const ChangeSize found = change_size(information, Eigen::Vector4d(4.0 * 5.0, 0.0, 4.0 * -5.0, 0.0));
  EXPECT_NEAR(found.size_ut, std::sqrt(25.0 - 0.25), 0.1);
  EXPECT_LT(found.p_value, 1e-6);
  EXPECT_EQ(change_size(Eigen::Matrix4d::Zero(), Eigen::Vector4d::Zero()).p_value, 1.0);
}

TEST(ChangeSize, CallsNothingAChangeMoreOftenThanItsPValueSays) {
  std::mt19937_64 generator(4);
  std::normal_distribution<double> normal;
  const Eigen::Matrix4d information = Eigen::Vector4d(1.0, 30.0, 30.0, 0.01).asDiagonal();
  constexpr int kDraws = 5000;
  int below_5 = 0, below_1 = 0;
  for (int i = 0; i < kDraws; ++i) {
    Eigen::Vector4d gradient;
    for (int k = 0; k < 4; ++k) gradient[k] = std::sqrt(information(k, k)) * normal(generator);
    const double p = change_size(information, gradient).p_value;
    below_5 += p < 0.05 ? 1 : 0;
    below_1 += p < 0.01 ? 1 : 0;
  }
  std::printf("p below 5 %%: %.3f, below 1 %%: %.4f\n", below_5 / double(kDraws), below_1 / double(kDraws));
  EXPECT_LT(below_5, 0.065 * kDraws);
  EXPECT_LT(below_1, 0.017 * kDraws);
}

TEST(CalibrateAgainstAMap, ReadingsOffTheMapOrTheTrajectoryAreLeftOut) {
  SimulatedArray array = drive(3);
  array.run();
  array.trajectory.erase(array.trajectory.begin() + 4000, array.trajectory.begin() + 8000);
  const CalibrationOptions options;
  MagneticMap map = erring_map(7);
  const CalibrationLog log = mapped_log(array.readings, array.trajectory, map, array.suite, options);
  EXPECT_NEAR(static_cast<double>(log.without_motion), 400.0, 10.0);
  EXPECT_EQ(log.off_map, 0U);
  for (MagnetometerModel& model : array.suite.magnetometers) model.T_imu_mag.position.x() += 100.0;
  const CalibrationLog off = mapped_log(array.readings, array.trajectory, map, array.suite, options);
  EXPECT_TRUE(off.moments.empty());
  EXPECT_NEAR(static_cast<double>(off.off_map), 3.0 * 800.0, 30.0);
}

}  // namespace
}  // namespace lodestone
