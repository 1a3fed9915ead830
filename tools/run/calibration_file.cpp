#include "tools/run/calibration_file.h"

#include <fmt/format.h>

#include <numbers>
#include <string>
#include <utility>

#include "tools/writers/output_file.h"

namespace lodestone {

namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr const char* kAxes[] = {"x", "y", "z"};
constexpr const char* kEntries[] = {"xx", "xy", "xz", "yy", "yz", "zz"};

class CalibrationRows {
 public:
  void add(const std::string& sensor, const std::string& parameter, const char* unit, double estimate, double sigma,
           double platform_sigma) {
    rows_.push_back({sensor, parameter, unit, estimate, sigma, platform_sigma});
  }

  std::vector<CalibrationRow> take() { return std::move(rows_); }

 private:
  std::vector<CalibrationRow> rows_;
};

}  // namespace

std::vector<CalibrationRow> calibration_rows(const SensorSuite& suite, const CalibrationEstimate& estimate) {
  CalibrationRows rows;
  const CalibrationEstimate::Lidar& lidar = estimate.lidar;
  const LidarCalibrationSigmas& lidar_sigmas = suite.calibration.lidar;
  for (int i = 0; i < 3; ++i) {
    rows.add("lidar", fmt::format("turn_{}", kAxes[i]), "deg", kDegrees * lidar.correction.turn_rad[i],
             kDegrees * lidar.turn_sigma_rad[i], lidar_sigmas.rotation_sigma_deg);
  }
  for (int i = 0; i < 3; ++i) {
    rows.add("lidar", fmt::format("shift_{}", kAxes[i]), "m", lidar.correction.shift_m[i], lidar.shift_sigma_m[i],
             lidar_sigmas.translation_sigma_m);
  }
  rows.add("lidar", "clock", "s", lidar.correction.clock_s, lidar.clock_sigma_s, lidar_sigmas.clock_sigma_s);
  const MagnetometerCalibrationSigmas& sigmas = suite.calibration.magnetometers;
  rows.add("magnetometers", "clock", "s", estimate.magnetometer_clock_s, estimate.magnetometer_clock_sigma_s,
           sigmas.clock_sigma_s);
  for (std::size_t k = 0; k < estimate.magnetometers.size() && k < suite.magnetometers.size(); ++k) {
    const CalibrationEstimate::Magnetometer& magnetometer = estimate.magnetometers[k];
    const std::string& name = suite.magnetometers[k].name;
    for (int i = 0; i < 3; ++i) {
      rows.add(name, fmt::format("turn_{}", kAxes[i]), "deg", kDegrees * magnetometer.turn_rad[i],
               kDegrees * magnetometer.turn_sigma_rad[i], sigmas.rotation_sigma_deg);
    }
    for (int i = 0; i < 6; ++i) {
      rows.add(name, fmt::format("distortion_{}", kEntries[i]), "1", magnetometer.distortion[i],
               magnetometer.distortion_sigma[i], sigmas.matrix_sigma);
    }
  }
  return rows.take();
}

void write_calibration(const std::filesystem::path& path, const SensorSuite& suite,
                       const CalibrationEstimate& estimate) {
  std::string text = "sensor,parameter,unit,estimate,sigma,platform_sigma\n";
  for (const CalibrationRow& row : calibration_rows(suite, estimate)) {
    if (!row.is_estimated()) continue;
    text += fmt::format("{},{},{},{:.6g},{:.6g},{:.6g}\n", row.sensor, row.parameter, row.unit, row.estimate, row.sigma,
                        row.platform_sigma);
  }
  OutputFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace lodestone
