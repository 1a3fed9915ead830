#include "bindings/estimates.h"

#include <cmath>
#include <string>

#include "bindings/arrays.h"

namespace lodestone::python {

namespace {

template <class Get>
py::array_t<double> vectors(const std::vector<Estimate>& estimates, const Get& get) {
  return array_of<double>(estimates, 3, [&](const Estimate& one, double* out) { write_vector(get(one), out); });
}

/// Adds columns of diagnostics to a dict.
class Columns {
 public:
  explicit Columns(const std::vector<Estimate>& estimates) : estimates_(estimates) {}

  template <class Get>
  void count(const char* name, const Get& get) {
    columns_[name] =
        array_of<std::int64_t>(estimates_, 1, [&](const Estimate& one, auto* out) { *out = get(one.diagnostics); });
  }

  /// NaN where `measured` is false: zero would look like a very good value.
  template <class Measured, class Get>
  void figure(const std::string& name, const Measured& measured, const Get& get) {
    columns_[py::str(name)] = array_of<double>(estimates_, 1, [&](const Estimate& one, double* out) {
      *out = measured(one.diagnostics) ? get(one.diagnostics) : std::nan("");
    });
  }

  py::dict take() { return std::move(columns_); }

 private:
  const std::vector<Estimate>& estimates_;
  py::dict columns_;
};

}  // namespace

py::dict arrays_of(const std::vector<Estimate>& estimates) {
  py::dict result;
  result["stamp_ns"] = array_of<std::int64_t>(estimates, 1, [](const Estimate& one, auto* out) { *out = one.time; });
  result["position_m"] = vectors(estimates, [](const Estimate& one) { return one.state.T_map_imu.position; });
  result["quaternion_xyzw"] = array_of<double>(estimates, 4, [](const Estimate& one, double* out) {
    for (int i = 0; i < 4; ++i) out[i] = one.state.T_map_imu.rotation.coeffs()(i);
  });
  result["velocity_m_s"] = vectors(estimates, [](const Estimate& one) { return one.state.velocity; });
  result["gyroscope_bias_rad_s"] = vectors(estimates, [](const Estimate& one) { return one.state.gyroscope_bias; });
  result["accelerometer_bias_m_s2"] =
      vectors(estimates, [](const Estimate& one) { return one.state.accelerometer_bias; });
  result["gravity_m_s2"] = vectors(estimates, [](const Estimate& one) { return one.state.gravity; });
  const auto covariance = array_of<double>(estimates, 36, [](const Estimate& one, double* out) {
    for (int i = 0; i < 36; ++i) out[i] = one.covariance(i / 6, i % 6);
  });
  result["covariance"] = covariance.attr("reshape")(-1, 6, 6);
  result["health"] = array_of<std::uint8_t>(
      estimates, 1, [](const Estimate& one, auto* out) { *out = static_cast<std::uint8_t>(one.health); });
  result["health_reason"] = array_of<std::uint8_t>(
      estimates, 1, [](const Estimate& one, auto* out) { *out = static_cast<std::uint8_t>(one.reason); });
  return result;
}

py::dict diagnostics_of(const std::vector<Estimate>& estimates) {
  using D = Diagnostics;
  const auto always = [](const D&) { return true; };
  const auto field = [](const D& d) { return d.magnetic_samples > 0; };
  const auto place = [](const D& d) { return d.place_points > 0; };
  const auto clock = [](const D& d) { return d.clock_sigma_s > 0.0; };
  const auto wheels = [](const D& d) { return d.wheel_weight >= 0.0; };
  const auto analysed = [](const D& d) { return (d.direction_sigma_m.array() != 0.0).any(); };
  Columns columns(estimates);
  columns.count("points", [](const D& d) { return d.points; });
  columns.count("correspondences", [](const D& d) { return d.correspondences; });
  columns.figure(
      "inlier_share", [](const D& d) { return d.points > 0; }, [](const D& d) { return d.inlier_share; });
  columns.figure(
      "lidar_rmse_m", [](const D& d) { return d.correspondences > 0; }, [](const D& d) { return d.lidar_rmse_m; });
  columns.figure(
      "lidar_nis", [](const D& d) { return d.lidar_nis > 0.0; }, [](const D& d) { return d.lidar_nis; });
  for (int i = 0; i < 6; ++i) {
    columns.figure("direction_" + std::to_string(i + 1) + "_sigma_m", analysed,
                   [i](const D& d) { return d.direction_sigma_m(i); });
  }
  for (int i = 0; i < 6; ++i) {
    columns.figure("direction_" + std::to_string(i + 1) + "_weight", analysed,
                   [i](const D& d) { return d.direction_weight(i); });
  }
  columns.count("degenerate_directions", [](const D& d) { return d.degenerate_directions; });
  columns.count("unobserved_directions", [](const D& d) { return d.unobserved_directions; });
  columns.count("magnetic_samples", [](const D& d) { return d.magnetic_samples; });
  columns.count("magnetic_rejected", [](const D& d) { return d.magnetic_rejected; });
  columns.count("magnetic_off_map", [](const D& d) { return d.magnetic_off_map; });
  columns.figure("magnetic_weight", field, [](const D& d) { return d.magnetic_weight; });
  columns.figure("magnetic_shrink", field, [](const D& d) { return d.magnetic_shrink; });
  columns.figure("magnetic_residual_ut", field, [](const D& d) { return d.magnetic_residual_ut; });
  columns.figure(
      "magnetic_nis", [](const D& d) { return d.magnetic_nis > 0.0; }, [](const D& d) { return d.magnetic_nis; });
  columns.count("magnetic_set_aside", [](const D& d) { return d.magnetic_set_aside; });
  columns.figure("place_share", place, [](const D& d) { return d.place_share; });
  columns.figure("decoy_share", place, [](const D& d) { return d.decoy_share; });
  columns.figure(
      "field_odds", [](const D& d) { return d.field_odds != 0.0; }, [](const D& d) { return d.field_odds; });
  columns.figure("clock_offset_s", clock, [](const D& d) { return d.clock_offset_s; });
  columns.figure("clock_sigma_s", clock, [](const D& d) { return d.clock_sigma_s; });
  columns.figure("wheel_weight", wheels, [](const D& d) { return d.wheel_weight; });
  columns.figure("wheel_slip", wheels, [](const D& d) { return d.wheel_slip; });
  columns.count("iterations", [](const D& d) { return d.iterations; });
  columns.figure("step_ms", always, [](const D& d) { return d.step_ms; });
  return columns.take();
}

py::dict dict_of(const CalibrationEstimate& calibration, const SensorSuite& suite) {
  const auto array = [](const auto& vector) { return py::array_t<double>(vector.size(), vector.data()); };
  py::dict imu, lidar, wheels, magnetometers;
  imu["axes"] = array(calibration.imu.axes);
  imu["axes_sigma"] = array(calibration.imu.sigma);
  lidar["turn_rad"] = array(calibration.lidar.correction.turn_rad);
  lidar["turn_sigma_rad"] = array(calibration.lidar.turn_sigma_rad);
  lidar["shift_m"] = array(calibration.lidar.correction.shift_m);
  lidar["shift_sigma_m"] = array(calibration.lidar.shift_sigma_m);
  lidar["clock_s"] = calibration.lidar.correction.clock_s;
  lidar["clock_sigma_s"] = calibration.lidar.clock_sigma_s;
  wheels["scale"] = calibration.wheels.correction.scale;
  wheels["scale_sigma"] = calibration.wheels.scale_sigma;
  wheels["turn_rad"] = array(calibration.wheels.correction.turn_rad);
  wheels["turn_sigma_rad"] = array(calibration.wheels.turn_sigma_rad);
  for (std::size_t i = 0; i < calibration.magnetometers.size() && i < suite.magnetometers.size(); ++i) {
    const CalibrationEstimate::Magnetometer& one = calibration.magnetometers[i];
    py::dict values;
    values["turn_rad"] = array(one.turn_rad);
    values["turn_sigma_rad"] = array(one.turn_sigma_rad);
    values["distortion"] = array(one.distortion);
    values["distortion_sigma"] = array(one.distortion_sigma);
    magnetometers[py::str(suite.magnetometers[i].name)] = values;
  }
  py::dict result;
  result["imu"] = imu;
  result["lidar"] = lidar;
  result["wheels"] = wheels;
  result["magnetometers"] = magnetometers;
  result["magnetometer_clock_s"] = calibration.magnetometer_clock_s;
  result["magnetometer_clock_sigma_s"] = calibration.magnetometer_clock_sigma_s;
  return result;
}

}  // namespace lodestone::python
