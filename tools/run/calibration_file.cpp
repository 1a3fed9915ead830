#include "tools/run/calibration_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/angles.h"
#include "frontends/configuration/output_file.h"

namespace lodestone {

namespace {

constexpr double kFarSigmas = 3.0;
constexpr const char* kAxes[] = {"x", "y", "z"};
constexpr const char* kEntries[] = {"xx", "xy", "xz", "yy", "yz", "zz"};

/// The place of a part of a sensor's calibration in the platform file.
struct CalibrationPlace {
  std::string sensor, part, unit, key, sigma_key;
};

double deviation_in_sigmas(const CalibrationRow& row) {
  return std::abs(row.estimate) / row.platform_sigma;
}

}  // namespace

std::vector<CalibrationRow> calibration_rows(const SensorSuite& suite, const CalibrationEstimate& estimate) {
  std::vector<CalibrationRow> rows;
  const auto add = [&rows](const CalibrationPlace& place, const std::string& parameter, double value, double sigma,
                           double platform_sigma) {
    rows.push_back(
        {place.sensor, parameter, place.part, place.unit, value, sigma, platform_sigma, place.key, place.sigma_key});
  };
  const char* sensors[] = {"gyroscope", "accelerometer"};
  for (int i = 0; i < 18; ++i) {
    const bool scales = i % 9 % 4 == 0;
    const int row = i % 9 / 3;
    const ImuCalibrationSigmas& sigmas = suite.calibration.imu;
    if (scales) {
      add({sensors[i / 9], "scale", "1", "", "imu.calibration.scale_sigma"}, fmt::format("scale_{}", kAxes[row]),
          estimate.imu.axes[i], estimate.imu.sigma[i], sigmas.scale_sigma);
    } else {
      add({sensors[i / 9], "misalignment", "deg", "", "imu.calibration.misalignment_sigma_deg"},
          fmt::format("axis_{}{}", kAxes[row], kAxes[i % 3]), degrees_per_radian * estimate.imu.axes[i],
          degrees_per_radian * estimate.imu.sigma[i], sigmas.misalignment_sigma_deg);
    }
  }
  const CalibrationEstimate::Lidar& lidar = estimate.lidar;
  const LidarCalibrationSigmas& lidar_sigmas = suite.calibration.lidar;
  const CalibrationPlace turn{"lidar", "rotation", "deg", "lidar.T_imu_lidar", "lidar.calibration.rotation_sigma_deg"};
  const CalibrationPlace shift{"lidar", "translation", "m", "lidar.T_imu_lidar",
                               "lidar.calibration.translation_sigma_m"};
  for (int i = 0; i < 3; ++i) {
    add(turn, fmt::format("turn_{}", kAxes[i]), degrees_per_radian * lidar.correction.turn_rad[i],
        degrees_per_radian * lidar.turn_sigma_rad[i], lidar_sigmas.rotation_sigma_deg);
  }
  for (int i = 0; i < 3; ++i) {
    add(shift, fmt::format("shift_{}", kAxes[i]), lidar.correction.shift_m[i], lidar.shift_sigma_m[i],
        lidar_sigmas.translation_sigma_m);
  }
  add({"lidar", "clock", "s", "lidar.clock_offset_s", "lidar.calibration.clock_sigma_s"}, "clock",
      lidar.correction.clock_s, lidar.clock_sigma_s, lidar_sigmas.clock_sigma_s);
  const MagnetometerCalibrationSigmas& sigmas = suite.calibration.magnetometers;
  // The map was surveyed with such an array: what all its magnetometers share is in the map, and not observed.
  const double shared = 1.0 / std::sqrt(std::max<double>(1.0, static_cast<double>(suite.magnetometers.size())));
  const auto with_shared = [&](double sigma, double platform_sigma) {
    return sigma > 0.0 ? std::hypot(sigma, shared * platform_sigma) : 0.0;
  };
  add({"magnetometers", "clock", "s", "magnetometer_clock_offset_s", "magnetometer_calibration.clock_sigma_s"}, "clock",
      estimate.magnetometer_clock_s, estimate.magnetometer_clock_sigma_s, sigmas.clock_sigma_s);
  for (std::size_t k = 0; k < estimate.magnetometers.size() && k < suite.magnetometers.size(); ++k) {
    const CalibrationEstimate::Magnetometer& magnetometer = estimate.magnetometers[k];
    const std::string& name = suite.magnetometers[k].name;
    const CalibrationPlace turned{name, "rotation", "deg", "T_imu_mag of " + name,
                                  "magnetometer_calibration.rotation_sigma_deg"};
    const CalibrationPlace distorted{name, "matrix", "1", "soft_iron_correction of " + name,
                                     "magnetometer_calibration.matrix_sigma"};
    for (int i = 0; i < 3; ++i) {
      add(turned, fmt::format("turn_{}", kAxes[i]), degrees_per_radian * magnetometer.turn_rad[i],
          with_shared(degrees_per_radian * magnetometer.turn_sigma_rad[i], sigmas.rotation_sigma_deg),
          sigmas.rotation_sigma_deg);
    }
    for (int i = 0; i < 6; ++i) {
      add(distorted, fmt::format("distortion_{}", kEntries[i]), magnetometer.distortion[i],
          with_shared(magnetometer.distortion_sigma[i], sigmas.matrix_sigma), sigmas.matrix_sigma);
    }
  }
  if (!suite.wheels) return rows;
  const WheelCalibrationSigmas& wheel_sigmas = suite.calibration.wheels;
  add({"wheels", "scale", "1", "wheels.scale", "wheels.calibration.scale_sigma"}, "scale",
      estimate.wheels.correction.scale, estimate.wheels.scale_sigma, wheel_sigmas.scale_sigma);
  const CalibrationPlace wheels_turned{"wheels", "rotation", "deg", "wheels.T_imu_wheels",
                                       "wheels.calibration.rotation_sigma_deg"};
  for (int i = 0; i < 3; ++i) {
    add(wheels_turned, fmt::format("turn_{}", kAxes[i]), degrees_per_radian * estimate.wheels.correction.turn_rad[i],
        degrees_per_radian * estimate.wheels.turn_sigma_rad[i], wheel_sigmas.rotation_sigma_deg);
  }
  return rows;
}

void write_calibration(const std::filesystem::path& path, const SensorSuite& suite,
                       const CalibrationEstimate& estimate) {
  OutputFile file(path);
  file.write("sensor,parameter,unit,estimate,sigma,platform_sigma\n");
  for (const CalibrationRow& row : calibration_rows(suite, estimate)) {
    if (!row.is_estimated()) continue;
    file.write(fmt::format("{},{},{},{:.6g},{:.6g},{:.6g}\n", row.sensor, row.parameter, row.unit, row.estimate,
                           row.sigma, row.platform_sigma));
  }
  file.commit();
}

void warn_of_calibration(const SensorSuite& suite, const CalibrationEstimate& estimate, Time time,
                         WarningLog& warnings) {
  struct Far {
    CalibrationRow row;
    int count = 0;
  };
  std::map<std::string, Far> kinds;
  for (CalibrationRow& row : calibration_rows(suite, estimate)) {
    if (!row.is_estimated() || !(deviation_in_sigmas(row) > kFarSigmas)) continue;
    const bool of_imu = row.sensor == "gyroscope" || row.sensor == "accelerometer";
    Far& far = kinds[fmt::format("calibration.{}.{}",
                                 of_imu                                            ? "imu"
                                 : row.sensor == "lidar" || row.sensor == "wheels" ? row.sensor
                                                                                   : "magnetometers",
                                 row.part)];
    if (far.count++ == 0 || deviation_in_sigmas(row) > deviation_in_sigmas(far.row)) far.row = std::move(row);
  }
  for (const auto& [kind, far] : kinds) {
    const CalibrationRow& row = far.row;
    // Platform files have no scale and no axes of an IMU.
    const std::string replace =
        row.key.empty()
            ? ""
            : fmt::format("replace {} by the value in the results' platform.yaml if other logs agree, or ", row.key);
    warnings.add(kind,
                 fmt::format("{}: {} differs by {:.3g}{} from the platform file, {:.1f} times {} ({:g}); {}increase {}",
                             row.key.empty() ? row.sensor : row.key, row.parameter, row.estimate,
                             row.unit == "1" ? "" : " " + row.unit, deviation_in_sigmas(row), row.sigma_key,
                             row.platform_sigma, replace, row.sigma_key),
                 time, far.count);
  }
}

}  // namespace lodestone
