// Three magnetometers on a robot in a real room; one has drifted by run 5. Their readings are given in the room's axes;
// the direction from one to another gives the heading, by which they are rotated back.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <optional>

#include "core/mapping/magnetic_map_builder.h"
#include "estimators/calibration/magnetometer_calibrator.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using testing::read_csv;

const std::array<std::string, 3> sensors{"invensense", "nexus", "trivisio"};

struct Track {
  std::vector<double> time_s;
  std::vector<Eigen::Matrix<double, 5, 1>> values;  ///< x, y (m), field (µT; trivisio: its own unit), room axes

  std::optional<Eigen::Matrix<double, 5, 1>> at(double t) const {
    const auto after = std::upper_bound(time_s.begin(), time_s.end(), t);
    if (after == time_s.begin() || after == time_s.end() || *after - *(after - 1) > 0.1) return std::nullopt;
    const auto i = static_cast<std::size_t>(after - time_s.begin());
    const double share = (t - time_s[i - 1]) / (time_s[i] - time_s[i - 1]);
    return Eigen::Matrix<double, 5, 1>(values[i - 1] + share * (values[i] - values[i - 1]));
  }
};

Track read_track(const std::string& sensor, int run) {
  const std::string stem =
      (testing::real_data_folder() / "magnetic" / "aalto" / (sensor + "-" + std::to_string(run))).string();
  const auto time = read_csv(stem + "-time.csv"), location = read_csv(stem + "-loc.csv"),
             field = read_csv(stem + "-mag.csv");
  Track track;
  for (std::size_t i = 0; i < std::min({time.size(), location.size(), field.size()}); ++i) {
    track.time_s.push_back(time[i].at(0));
    track.values.emplace_back();
    track.values.back() << location[i].at(0), location[i].at(1), field[i].at(0), field[i].at(1), field[i].at(2);
  }
  return track;
}

struct RealArray {
  SensorSuite suite;
  std::vector<MagneticArraySample> samples;
  Trajectory trajectory;       ///< of invensense, x axis towards nexus
  std::vector<ImuSample> imu;  ///< from the headings

  ArrayLog readings(std::size_t begin, std::size_t end) const {
    ArrayLog log(3);
    log.add(std::span(samples).subspan(begin, end - begin));
    return log;
  }
};

class AaltoCalibration : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(testing::real_data_folder() / "magnetic" / "aalto" / "nexus-5-mag.csv")) {
      GTEST_SKIP() << "no data in " << testing::real_data_folder() << "; set LODESTONE_DATA";
    }
    read_run_five();
  }

  /// Unit of trivisio, from another run.
  static double trivisio_unit_ut() {
    double ours = 0.0, theirs = 0.0;
    const Track reference = read_track("invensense", 1), other = read_track("trivisio", 1);
    for (const auto& value : reference.values)
      ours += value.tail<3>().norm() / static_cast<double>(reference.values.size());
    for (const auto& value : other.values) theirs += value.tail<3>().norm() / static_cast<double>(other.values.size());
    return ours / theirs;
  }

  void read_run_five() {
    std::array<Track, 3> tracks;
    for (std::size_t j = 0; j < 3; ++j) tracks[j] = read_track(sensors[j], 5);
    const double unit = trivisio_unit_ut();
    std::array<Vector3, 3> lever{Vector3::Zero(), Vector3::Zero(), Vector3::Zero()};
    for (const double t : tracks[0].time_s) {
      std::array<std::optional<Eigen::Matrix<double, 5, 1>>, 3> values;
      for (std::size_t j = 0; j < 3; ++j) values[j] = tracks[j].at(t);
      if (!values[0] || !values[1] || !values[2]) continue;
      const Eigen::Vector2d ahead = values[1]->head<2>() - values[0]->head<2>();
      const Quaternion rotation = so3::exp(Vector3(0.0, 0.0, std::atan2(ahead.y(), ahead.x())));
      array_.trajectory.push_back({from_seconds(t), {rotation, Vector3((*values[0])[0], (*values[0])[1], 0.0)}});
      MagneticArraySample sample;
      sample.time = from_seconds(t);
      for (std::size_t j = 0; j < 3; ++j) {
        sample.field_ut.push_back(Vector3(rotation.conjugate() * ((j == 2 ? unit : 1.0) * values[j]->tail<3>())));
        Vector3 away = Vector3::Zero();
        away.head<2>() = values[j]->head<2>() - values[0]->head<2>();
        lever[j] += rotation.conjugate() * away;
      }
      array_.samples.push_back(std::move(sample));
    }
    for (std::size_t j = 0; j < 3; ++j) {
      MagnetometerModel model;
      model.name = sensors[j];
      model.T_imu_mag.position = lever[j] / static_cast<double>(array_.samples.size());
      array_.suite.magnetometers.push_back(model);
    }
    for (std::size_t i = 1; i < array_.trajectory.size(); ++i) {
      const StampedPose& a = array_.trajectory[i - 1];
      const StampedPose& b = array_.trajectory[i];
      const Vector3 rate = so3::log(a.pose.rotation.conjugate() * b.pose.rotation) / to_seconds(b.time - a.time);
      array_.imu.push_back({a.time + (b.time - a.time) / 2, rate, Vector3(0.0, 0.0, 9.8)});
    }
  }

  RealArray array_;
};

/// Rms per component of the second half's residuals against the map, with `calibration`.
double residual_ut(const CalibrationLog& log, int magnetometer, const MagnetometerCalibration& calibration) {
  double squares = 0.0;
  int count = 0;
  const Quaternion R_mag_imu = log.magnetometers[static_cast<std::size_t>(magnetometer)].T_imu_mag.rotation.conjugate();
  for (const CalibrationMoment& moment : log.moments) {
    for (const MomentReading& reading : moment.readings) {
      if (reading.magnetometer != magnetometer) continue;
      squares += (calibration.corrected(reading.measured_ut) - R_mag_imu * reading.known_ut).squaredNorm() / 3.0;
      ++count;
    }
  }
  return std::sqrt(squares / count);
}

void print(const MagnetometerCalibrationResult& result) {
  for (std::size_t j = 0; j < 3; ++j) {
    const CalibratedMagnetometer& one = result.magnetometers[j];
    std::printf(
        "%-10s before %.2f after %.2f uT; hard iron %.2f (%.2f) %.2f (%.2f) %.2f (%.2f); beside the usual field %.2f "
        "%.2f %.2f (%.2f %.2f %.2f); scale %.1f\n",
        sensors[j].c_str(), one.before_ut, one.after_ut, one.calibration.hard_iron_ut.x(), one.sigma[0],
        one.calibration.hard_iron_ut.y(), one.sigma[1], one.calibration.hard_iron_ut.z(), one.sigma[2],
        one.usual_error_ut.x(), one.usual_error_ut.y(), one.usual_error_ut.z(), one.usual_error_sigma_ut.x(),
        one.usual_error_sigma_ut.y(), one.usual_error_sigma_ut.z(), one.sigma_scale);
  }
  for (const std::string& line : result.held) std::printf("  %s\n", line.c_str());
}

TEST_F(AaltoCalibration, AgainstAMapOfEarlierRunsTheDriftedSensorComesBackToItsFellows) {
  std::vector<FieldObservation> survey;
  for (int run = 1; run <= 3; ++run) {
    const Track track = read_track("invensense", run);
    for (std::size_t i = 0; i < track.values.size(); ++i) {
      survey.push_back({{track.values[i][0], track.values[i][1], 0.0},
                        track.values[i].tail<3>(),
                        0.3,
                        from_seconds(track.time_s[i]) + run * from_seconds(1000.0)});
    }
  }
  MagneticMapOptions map_options;
  map_options.resolution_m = 0.1;
  map_options.held_out_block_m = 0.0;
  const MagneticMap map = build_magnetic_map(survey, map_options).map;
  CalibrationOptions options;
  options.max_moments = 500;  // limits the duration
  const std::size_t half = array_.samples.size() / 2;
  const CalibrationLog first = mapped_log(array_.readings(0, half), array_.trajectory, map, array_.suite, options);
  const CalibrationLog second =
      mapped_log(array_.readings(half, array_.samples.size()), array_.trajectory, map, array_.suite, options);
  const MagnetometerCalibrationResult result = calibrate_magnetometers(first, options);
  print(result);
  std::array<double, 3> before, after;
  for (int j = 0; j < 3; ++j) {
    before[static_cast<std::size_t>(j)] = residual_ut(second, j, {});
    after[static_cast<std::size_t>(j)] =
        residual_ut(second, j, result.magnetometers[static_cast<std::size_t>(j)].calibration);
    std::printf("second half, not used: %-10s before %.2f after %.2f uT\n",
                sensors[static_cast<std::size_t>(j)].c_str(), before[static_cast<std::size_t>(j)],
                after[static_cast<std::size_t>(j)]);
  }
  EXPECT_GT(before[1], 1.7 * before[0]);  // it has drifted
  EXPECT_LT(after[1], 1.2 * std::max(after[0], after[2]));
}

TEST_F(AaltoCalibration, WithoutAMapItComesBackToThemToo) {
  CalibrationOptions options;
  options.max_moments = 500;  // limits the duration
  const CalibrationLog log = turning_log(array_.readings(0, array_.samples.size()), array_.imu, array_.suite, options);
  const MagnetometerCalibrationResult result = calibrate_magnetometers(log, options);
  std::printf("walk %.2f uT/sqrt(s), slope %.1f uT/m\n", result.process.step_ut_sqrt_s, result.process.slope_ut_m);
  print(result);
  // Apart from the common part, the offset of nexus is that from the map: upwards.
  const auto beside = [&](std::size_t j) { return result.magnetometers[j].usual_error_ut.z(); };
  EXPECT_GT(beside(1) - 0.5 * (beside(0) + beside(2)), 5.0);
  EXPECT_LT(result.magnetometers[1].after_ut, 0.7 * result.magnetometers[1].before_ut);
}

}  // namespace
}  // namespace lodestone
