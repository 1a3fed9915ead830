#include "tools/calibrate/calibration_report.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "core/angles.h"
#include "tools/calibrate/field_change_report.h"
#include "tools/table.h"

namespace lodestone {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 12> kParameters{"hard_iron_x_ut", "hard_iron_y_ut", "hard_iron_z_ut", "scale_x",
                                                  "scale_y",        "scale_z",        "shear_xy",       "shear_xz",
                                                  "shear_yz",       "turn_x_rad",     "turn_y_rad",     "turn_z_rad"};

Json to_json(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

Json rows_of(const Matrix3& matrix) {
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back(to_json(matrix.row(i)));
  return rows;
}

/// "-12.31 ± 0.12"
std::string with_sigma(double value, double sigma, int digits) {
  return fmt::format("{:.{}f} ± {:.{}f}", value, digits, sigma, digits);
}

/// A line about a held combination without its sigma: the sigma of a combination differs from those in the tables, and
/// the report shows one value only.
std::string without_sigma(const std::string& line) {
  return line.substr(0, line.find(" ± "));
}

std::string residual_table(const Platform& platform, const MagnetometerCalibrationResult& result) {
  Table table(
      {"magnetometer", "moments", "before, uT", "after, uT", "beside the usual field: x, uT", "y, uT", "z, uT"});
  for (std::size_t j = 0; j < result.magnetometers.size(); ++j) {
    const CalibratedMagnetometer& one = result.magnetometers[j];
    std::vector<std::string> cells{platform.suite.magnetometers[j].name, std::to_string(one.readings)};
    if (one.readings > 0) {
      cells.insert(cells.end(), {fixed(one.before_ut, 2), fixed(one.after_ut, 2)});
      for (int i = 0; i < 3; ++i) cells.push_back(with_sigma(one.usual_error_ut[i], one.usual_error_sigma_ut[i], 2));
    }
    table.add(cells);
  }
  return table.to_string();
}

std::string parameter_table(const Platform& platform, const MagnetometerCalibrationResult& result,
                            const ShownChanges& changes) {
  Table table({"magnetometer", "hard iron: x, uT", "y, uT", "z, uT", "scale: x, %", "y, %", "z, %", "turn: x, deg",
               "y, deg", "z, deg"});
  for (std::size_t j = 0; j < result.magnetometers.size(); ++j) {
    if (result.magnetometers[j].readings == 0) continue;
    const TestedChanges& tested = changes.tested[j];
    std::vector<std::string> cells{platform.suite.magnetometers[j].name};
    const auto add = [&](int first, double unit, int digits) {
      for (int i = first; i < first + 3; ++i) {
        const std::string text = with_sigma(unit * tested.change[i], unit * tested.sigma[i], digits);
        cells.push_back(changes.taken[j][static_cast<std::size_t>(i)] ? text : "(" + text + ")");
      }
    };
    add(0, 1.0, 2);
    add(3, 100.0, 1);
    add(9, degrees_per_radian, 1);
    table.add(cells);
  }
  return table.to_string();
}

/// A line about the hard iron if this log determines it less accurately than the platform file states; otherwise empty.
std::string undetermined_hard_iron(const Platform& platform, const MagnetometerCalibrationResult& result) {
  const double given_ut = platform.suite.calibration.magnetometers.offset_sigma_ut;
  std::string axes;
  double largest_ut = 0.0;
  for (int i = 0; i < 3; ++i) {
    double sigma_ut = 0.0;
    for (const CalibratedMagnetometer& one : result.magnetometers) sigma_ut = std::max(sigma_ut, one.sigma[i]);
    if (sigma_ut <= given_ut) continue;
    axes += std::string(axes.empty() ? "" : ", ") + "xyz"[i];
    largest_ut = std::max(largest_ut, sigma_ut);
  }
  if (axes.empty()) return {};
  return fmt::format(
      "this log does not determine hard iron {}: sigma up to {:.1f} uT, above {:g} uT of "
      "magnetometer_calibration.offset_sigma_ut; turn the robot about all axes, far from steel\n",
      axes, largest_ut, given_ut);
}

MagnetometerCalibration given_of(const MagnetometerMessageLayout& layout) {
  return {layout.hard_iron_ut, layout.soft_iron_correction.inverse()};
}

}  // namespace

Platform calibrated_platform(const Platform& given, const ShownChanges& changes) {
  Platform platform = given;
  for (std::size_t j = 0; j < changes.calibrations.size(); ++j) {
    // Untouched magnetometers keep all digits of the file.
    const auto& taken = changes.taken[j];
    if (std::none_of(taken.begin(), taken.end(), [](bool one) { return one; })) continue;
    MagnetometerMessageLayout& layout = platform.magnetometers[j];
    const MagnetometerCalibration whole = changes.calibrations[j].after(given_of(layout));
    layout.hard_iron_ut = whole.hard_iron_ut;
    layout.soft_iron_correction = whole.correction();
  }
  return platform;
}

std::string calibration_text(const Platform& platform, const MagnetometerCalibrationResult& result,
                             const ShownChanges& changes, bool mapped) {
  std::string text = fmt::format("{} moments over {:.1f} s, {:.0f} deg of rotation in total; {} iterations\n",
                                 result.moments, result.duration_s, result.turned_deg, result.rounds);
  if (mapped) {
    text += fmt::format("reference: the map at each magnetometer's pose; its error {:.2f} times its sigma\n",
                        result.process.map_scale);
  } else {
    const Vector3& bias = result.gyroscope_bias_rad_s;
    text += fmt::format(
        "reference: all magnetometers together; random walk of the field {:.2f} uT/sqrt(s), slope {:.1f} uT/m; "
        "gyroscope bias ({:.5f} {:.5f} {:.5f}) rad/s\n",
        result.process.step_ut_sqrt_s, result.process.slope_ut_m, bias.x(), bias.y(), bias.z());
    if (result.offsets_only) {
      text += "offsets only: near steel, curvature of the field resembles distortions (max_walk_ut_sqrt_s)\n";
    }
  }
  text +=
      "\nresiduals against the reference (rms per component); beside the usual field: the error at the log's mean "
      "field\n" +
      residual_table(platform, result);
  text += "\nchanges of the given platform file; in brackets: below two standard deviations, not made\n" +
          parameter_table(platform, result, changes);
  text += field_change_text(result.field_change);
  const std::string left = left_as_given(changes, platform.suite.magnetometers, result);
  if (!left.empty()) text += "\nnot changed, because the change is below two standard deviations: " + left + "\n";
  const std::string hard_iron = undetermined_hard_iron(platform, result);
  if (!result.held.empty() || !hard_iron.empty()) text += "\n";
  for (const std::string& line : result.held) text += without_sigma(line) + "\n";
  text += hard_iron;
  return text;
}

std::string calibration_json(const CalibrationSources& sources, const Platform& platform,
                             const MagnetometerCalibrationResult& result, const ShownChanges& changes,
                             const CalibrationOptions& options) {
  const bool mapped = !sources.magnetic.empty();
  Json json{{"log", sources.log}, {"platform", sources.platform}, {"reference", mapped ? "map" : "array"}};
  if (mapped) {
    json["magnetic"] = sources.magnetic;
    json["trajectory"] = sources.trajectory;
    json["map_error_over_sigma"] = result.process.map_scale;
  } else {
    json["field_walk_ut_sqrt_s"] = result.process.step_ut_sqrt_s;
    json["field_slope_ut_m"] = result.process.slope_ut_m;
    json["offsets_only"] = result.offsets_only;
    json["gyroscope_bias_rad_s"] = to_json(result.gyroscope_bias_rad_s);
  }
  json["moments"] = result.moments;
  json["duration_s"] = result.duration_s;
  json["turned_deg"] = result.turned_deg;
  if (result.field_change.compared) json["field_change"] = field_change_json(result.field_change);
  json["min_gain"] = options.min_gain;
  json["held"] = Json::array();
  for (const std::string& line : result.held) json["held"].push_back(without_sigma(line));
  json["magnetometers"] = Json::array();
  for (std::size_t j = 0; j < result.magnetometers.size(); ++j) {
    const CalibratedMagnetometer& one = result.magnetometers[j];
    const MagnetometerMessageLayout& layout = platform.magnetometers[j];
    Json entry{{"name", platform.suite.magnetometers[j].name},
               {"readings", one.readings},
               {"hard_iron_ut", to_json(layout.hard_iron_ut)},
               {"soft_iron_correction", rows_of(layout.soft_iron_correction)},
               {"residual_before_ut", one.before_ut},
               {"residual_after_ut", one.after_ut},
               {"scatter_over_noise", one.sigma_scale},
               {"usual_field_ut", to_json(one.usual_field_ut)},
               {"beside_usual_field_ut", to_json(one.usual_error_ut)},
               {"beside_usual_field_sigma_ut", to_json(one.usual_error_sigma_ut)}};
    Json parameters = Json::object();
    for (int i = 0; i < 12; ++i) {
      parameters[kParameters[static_cast<std::size_t>(i)]] = {{"change", changes.tested[j].change[i]},
                                                              {"sigma", changes.tested[j].sigma[i]},
                                                              {"held_share", one.hidden_share[i]},
                                                              {"taken", changes.taken[j][static_cast<std::size_t>(i)]}};
    }
    entry["parameters"] = parameters;
    json["magnetometers"].push_back(entry);
  }
  return json.dump(2) + "\n";
}

}  // namespace lodestone
