#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <memory>

#include "core/error.h"
#include "core/thread_limit.h"
#include "core/warnings.h"
#include "estimators/calibration/magnetometer_calibrator.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/output_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/magnetic_map_file.h"
#include "frontends/synchronizer/bag_source.h"
#include "frontends/synchronizer/recorded_array.h"
#include "tools/calibrate/calibration_report.h"
#include "tools/calibrate/field_change_report.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/messages.h"
#include "tools/progress.h"
#include "tools/writers/output_folder.h"

namespace lodestone {
namespace {

constexpr double kHeightTolerance_m = 0.1;

struct CalibrateCall {
  CalibrationSources sources;
  std::string out;
  std::vector<std::string> configurations;
  std::vector<std::string> settings;
  bool force = false;
};

/// The files beside the platform file `out`.
std::filesystem::path calibration_file(const std::string& out) {
  return std::filesystem::path(out).replace_filename("calibration.json");
}
std::filesystem::path field_change_file(const std::string& out) {
  return std::filesystem::path(out).replace_filename("field_change.csv");
}

CalibrationOptions read_options(const CalibrateCall& call) {
  CalibrationOptions options;
  load_options(load_configuration(call.configurations, call.settings), options);
  options.check();
  return options;
}

void check_call(const CalibrateCall& call) {
  const CalibrationSources& sources = call.sources;
  if (!sources.magnetic.empty() && sources.trajectory.empty()) {
    throw InputError("--magnetic: a map requires the robot's poses; give --trajectory T.tum as well, or neither");
  }
  if (sources.magnetic.empty() && !sources.trajectory.empty()) {
    throw InputError("--trajectory: poses serve together with a map; give --magnetic FIELD.yaml as well, or neither");
  }
  if (call.out.empty()) return;
  yaml_output(call.out);
  for (const std::string& file : {call.out, calibration_file(call.out).string(), field_change_file(call.out).string()})
    refuse_to_replace(file, call.force);
}

RecordedArray read_log(const CalibrateCall& call, const Platform& platform, WarningLog& warnings) {
  const bool with_imu = call.sources.magnetic.empty();
  BagSource source(call.sources.log, platform, warnings,
                   {.lidar = false, .imu = with_imu, .magnetometers = true, .wheels = false});
  Progress progress(std::filesystem::path(call.sources.log).filename().string(), source.begin_time(),
                    source.end_time());
  return record_array(source, platform.suite, warnings, [&progress](Time time) { progress.advance(time); });
}

/// A map with one layer is valid at its height only.
void check_height(const MagneticMap& map, const Trajectory& trajectory, const Vector3& centre, WarningLog& warnings) {
  if (map.grid().heights_m.size() != 1) return;
  double height_m = 0.0;
  for (const StampedPose& pose : trajectory)
    height_m += (pose.pose * centre).z() / static_cast<double>(trajectory.size());
  if (std::abs(height_m - map.grid().heights_m.front()) < kHeightTolerance_m) return;
  warnings.add(
      "calibrate.height",
      fmt::format("the array is at {:.2f} m by the trajectory, the map's only layer at {:.2f} m: the calibration "
                  "contains the field's change between both heights",
                  height_m, map.grid().heights_m.front()),
      trajectory.front().time);
}

CalibrationLog log_of(const CalibrateCall& call, const RecordedArray& recorded, const Platform& platform,
                      const CalibrationOptions& options, WarningLog& warnings) {
  const CalibrationSources& sources = call.sources;
  if (sources.magnetic.empty()) return turning_log(recorded.readings, recorded.imu, platform.suite, options);
  const Trajectory trajectory = read_trajectory(sources.trajectory);
  const MagneticMap map = read_magnetic_map(sources.magnetic);
  CalibrationLog log = mapped_log(recorded.readings, trajectory, map, platform.suite, options);
  if (log.moments.empty()) {
    throw InputError(
        log.off_map == 0
            ? fmt::format("{}: no magnetometer reading lies within the time of {}; give a trajectory of this "
                          "log",
                          sources.log, sources.trajectory)
            : fmt::format("{}: the map has no field at the magnetometers' poses of {}; give a map and a trajectory "
                          "in one frame",
                          sources.magnetic, sources.trajectory));
  }
  if (log.off_map > 0) {
    warnings.add("calibrate.off_map", "readings where the map has no field; ignored", log.moments.front().time,
                 static_cast<std::int64_t>(log.off_map));
  }
  check_height(map, trajectory, log.centre_m, warnings);
  return log;
}

void calibrate(const CalibrateCall& call) {
  const ThreadLimit limit(1);  // BLAS: the same bits on every machine
  const CalibrationOptions options = read_options(call);
  check_call(call);
  const Platform platform = load_platform(call.sources.platform, {.lidar = false});
  if (platform.suite.magnetometers.empty()) {
    throw InputError(call.sources.platform +
                     ": it has no magnetometers; expected at least one under the key 'magnetometers'");
  }
  WarningLog warnings;
  const RecordedArray recorded = read_log(call, platform, warnings);
  const CalibrationLog log = log_of(call, recorded, platform, options, warnings);
  if (log.without_motion > 0) {
    warnings.add("calibrate.without_motion",
                 log.mapped ? "moments without a pose; ignored"
                            : "moments without IMU samples before them: the field model restarts there",
                 log.moments.front().time, static_cast<std::int64_t>(log.without_motion));
  }
  const MagnetometerCalibrationResult result = calibrate_magnetometers(log, options);
  const ShownChanges changes = shown_changes(result);
  fmt::print("{}: {}", call.sources.log, calibration_text(platform, result, changes, log.mapped));
  print_warnings(warnings);
  if (call.out.empty()) {
    fmt::print("\nnothing written; --out PLATFORM.yaml writes the calibration\n");
    return;
  }
  const Platform calibrated = calibrated_platform(platform, changes);
  const std::filesystem::path json = calibration_file(call.out);
  OutputFile file(json);
  file.write(calibration_json(call.sources, calibrated, result, changes, options));
  save_platform(calibrated, call.out);
  file.commit();
  fmt::print("\nwrote {} and {}\n", call.out, json.string());
  const std::filesystem::path places = field_change_file(call.out);
  if (!result.field_change.compared) {
    std::filesystem::remove(places);
    return;
  }
  OutputFile csv(places);
  csv.write(field_change_csv(result.field_change));
  csv.commit();
  fmt::print("wrote {}\n", places.string());
}

void add_magnetometers(CLI::App& parent) {
  const auto call = std::make_shared<CalibrateCall>();
  CLI::App* command = parent.add_subcommand(
      "magnetometers",
      "Estimate hard iron, soft iron and misalignment of each magnetometer from a log with any motion");
  CommandFiles files(*command);
  files
      .input(command->add_option("LOG", call->sources.log,
                                 "a log of any kind with the magnetometers' topics; without a map also the IMU's"))
      ->required();
  files
      .input(command->add_option("--platform", call->sources.platform,
                                 "the robot's platform file; its calibration is the prior"))
      ->required();
  files.input(command->add_option("--magnetic", call->sources.magnetic,
                                  "a magnetic map, FIELD.yaml: the reference; requires --trajectory"));
  files.input(command->add_option("--trajectory", call->sources.trajectory,
                                  "T_map_imu of the log, TUM, for instance of lodestone run"));
  files.output(
      command->add_option("--out", call->out,
                          "the platform file to write; calibration.json is written beside it, with a "
                          "map also field_change.csv"),
      [](const std::filesystem::path& out) {
        return std::vector<std::filesystem::path>{calibration_file(out.string()), field_change_file(out.string())};
      });
  command->add_flag("--force", call->force, "replace the files of --out if they exist");
  files.input(command->add_option("--config", call->configurations,
                                  "YAML files with options that replace the defaults, in order"));
  command->add_option("--set", call->settings, "one option, as key=value; the keys are below");
  command->footer("Options of --config and --set:\n" + list_options(CalibrationOptions{}) +
                  R"(
Examples, with the files of `lodestone simulate tunnel --out /tmp/tunnel` and the map that
`lodestone map magnetic` makes of them:
  lodestone calibrate magnetometers /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml \
      --out /tmp/tunnel/calibrated/platform.yaml
  lodestone calibrate magnetometers /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml \
      --magnetic /tmp/tunnel/field.yaml --trajectory /tmp/tunnel/truth.tum \
      --out /tmp/tunnel/calibrated/platform.yaml --set hard_iron_sigma_ut=50)");
  command->callback([call] { calibrate(*call); });
}

}  // namespace

void add_calibrate_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("calibrate", "Calibrate sensors from a log");
  command->require_subcommand(1);
  command->footer(R"(
Examples, on what `lodestone simulate tunnel --out /tmp/tunnel` writes:
  lodestone calibrate magnetometers /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml
  lodestone calibrate magnetometers --help)");
  add_magnetometers(*command);
}

}  // namespace lodestone
