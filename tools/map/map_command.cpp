#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <memory>

#include "core/error.h"
#include "core/mapping/magnetic_map_builder.h"
#include "core/option_checks.h"
#include "core/stopwatch.h"
#include "core/thread_limit.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/platform.h"
#include "frontends/maps/magnetic_map_file.h"
#include "frontends/synchronizer/bag_source.h"
#include "frontends/synchronizer/survey.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/map/survey_doubts.h"
#include "tools/map/survey_drives.h"
#include "tools/messages.h"
#include "tools/plotting/pictures.h"
#include "tools/progress.h"
#include "tools/writers/output_folder.h"

namespace lodestone {
namespace {

struct MapMagneticCall {
  SurveyFiles survey;
  std::string platform;
  std::string out;
  std::string platform_out;
  bool force = false;
  std::vector<std::string> configurations;
  std::vector<std::string> settings;
  std::optional<std::string> method;
  std::optional<double> resolution_m;
  std::optional<double> max_sigma_ut;
  int threads = 0;
};

constexpr SensorChoice magnetometers_only{.lidar = false, .imu = false, .magnetometers = true, .wheels = false};

MagneticMapOptions read_options(const MapMagneticCall& call) {
  MagneticMapOptions options;
  load_options(load_configuration(call.configurations, call.settings), options);
  if (call.method) options.method = enumerator_of<FieldMethod>("--method", *call.method);
  if (call.resolution_m) options.resolution_m = *call.resolution_m;
  if (call.max_sigma_ut) options.max_sigma_ut = *call.max_sigma_ut;
  if (call.resolution_m) option_checks::within("--resolution", *call.resolution_m, 0.005, 10.0);
  if (call.max_sigma_ut && !(*call.max_sigma_ut > 0.0)) {
    throw InputError(fmt::format("--max-sigma-ut: expected microtesla above 0, found {:g}", *call.max_sigma_ut));
  }
  options.check();
  return options;
}

FieldSurvey read_field_drive(const SurveyDrive& drive, const Platform& platform) {
  WarningLog warnings;
  BagSource source(drive.log, platform, warnings, magnetometers_only, LogPause::is_bridged);
  Progress progress(std::filesystem::path(drive.log).filename().string(), source.begin_time(), source.end_time());
  const FieldSurvey survey = read_survey(source, drive.trajectory, platform.suite, kLargestPoseGap,
                                         [&](Time time) { progress.advance(time); });
  progress.finish();
  print_warnings(warnings);
  if (survey.without_pose > 0) {
    fmt::print("warning: {} readings have no pose within {} s in {} and are ignored\n", survey.without_pose,
               to_seconds(kLargestPoseGap), drive.trajectory_file);
  }
  check_poses(drive, "magnetometer readings", static_cast<std::int64_t>(survey.observations.size()),
              survey.without_pose, kLargestPoseGap);
  return survey;
}

/// All drives as one survey. Adds their durations to `duration`.
FieldSurvey read_field_survey(const MapMagneticCall& call, const Platform& platform, Time& duration) {
  FieldSurvey survey;
  for (const SurveyDrive& drive : read_survey_drives(call.survey)) {
    const Stopwatch reading;
    FieldSurvey one = read_field_drive(drive, platform);
    const Time span = one.observations.back().time - one.observations.front().time;
    fmt::print("{}: {} readings of {} magnetometers, {:.1f} s of log, read in {:.1f} s\n", drive.log,
               one.observations.size(), platform.suite.magnetometers.size(), to_seconds(span), reading.elapsed_s());
    duration += span;
    append_drive(survey, std::move(one));
  }
  return survey;
}

/// Progress is that of the map's rows, as a share of the survey's duration.
MagneticMapResult build_survey_map(const MapMagneticCall& call, const FieldSurvey& survey, Time duration,
                                   const MagneticMapOptions& options) {
  std::optional<Progress> progress;
  return build_magnetic_map(survey.observations, options, [&](double share) {
    throw_if_interrupted();
    if (share == 0.0) return;  // the time of fitting kernels is no part of the rate
    if (!progress) progress.emplace(std::filesystem::path(call.out).filename().string(), 0, duration);
    progress->advance(static_cast<Time>(share * static_cast<double>(duration)));
  });
}

/// Noise of one reading of the array in the platform file: rms over its magnetometers.
double reading_noise(const Platform& platform) {
  double sum = 0.0;
  for (const MagnetometerModel& one : platform.suite.magnetometers) sum += one.noise_ut * one.noise_ut;
  return std::sqrt(sum / static_cast<double>(platform.suite.magnetometers.size()));
}

/// Differences between the passes of the survey beyond noise; empty if there are none.
std::string drive_error_text(const DriveError& drive) {
  if (drive.sigma_ut.isZero() && drive.position_sigma_m == 0.0) return {};
  return fmt::format("{:.3g} {:.3g} {:.3g} uT (x y z) and {:.2g} m of position, alike over {:.2g} m",
                     drive.sigma_ut.x(), drive.sigma_ut.y(), drive.sigma_ut.z(), drive.position_sigma_m,
                     drive.correlation_m);
}

std::string method_name(const MagneticMapOptions& options) {
  return options.method == FieldMethod::curl_free ? "curl-free" : "s-GPR";
}

std::string kernels_table(const FieldKernelFit& fit) {
  std::string text = "  component   signal sigma   length scale   noise per cell (before calibration)\n";
  const char* names[] = {"B_x", "B_y", "B_z"};
  for (int k = 0; k < 3; ++k) {
    text +=
        fmt::format("  {:<9} {:>11.3f} uT {:>12.3f} m {:>11.3f} uT ({:.3f})\n", names[k], fit.kernels[k].signal_sigma,
                    fit.kernels[k].length_scale_m, fit.kernels[k].noise_sigma, fit.uncalibrated_noise[k]);
  }
  if (fit.potential) {
    text += fmt::format("  one potential: length scale {:.3f} m, vertical {:.3f} m; constant field {:.3f} uT\n",
                        fit.potential->length_scale_m, fit.potential->vertical_length_scale_m,
                        fit.potential->linear_sigma_ut);
  }
  return text;
}

std::string clock_text(const SurveyErrors& errors) {
  if (errors.clock_s == 0.0) return "clock of the magnetometers: no offset that predicts held-out readings better\n";
  return fmt::format("clock of the magnetometers: stamps {:.1f} ms {} (sigma {:.1f} ms), corrected\n",
                     1e3 * std::abs(errors.clock_s), errors.clock_s > 0.0 ? "late" : "early",
                     1e3 * errors.clock_sigma_s);
}

std::string offsets_table(const std::vector<Vector3>& offsets_ut, const SensorSuite& suite) {
  if (offsets_ut.empty()) {
    return "offsets of the magnetometers: none, since they would not predict held-out readings better\n";
  }
  std::string text = "offsets of the magnetometers, subtracted (own axes, x y z):\n";
  for (std::size_t j = 0; j < offsets_ut.size(); ++j) {
    const Vector3& offset = offsets_ut[j];
    text += fmt::format("  {:<16} {:>8.3f} {:>8.3f} {:>8.3f} uT\n", suite.magnetometers[j].name, offset.x(), offset.y(),
                        offset.z());
  }
  return text;
}

/// The platform with the clock's offset, and the offsets as a part of the hard iron: field = C (reading - hard iron).
Platform without_errors(Platform platform, const SurveyErrors& errors) {
  platform.magnetometer_clock_offset_s += errors.clock_s;
  for (std::size_t j = 0; j < errors.offsets_ut.size(); ++j) {
    MagnetometerMessageLayout& layout = platform.magnetometers[j];
    layout.hard_iron_ut += layout.soft_iron_correction.inverse() * errors.offsets_ut[j];
  }
  return platform;
}

Provenance provenance_of(const MapMagneticCall& call, const MagneticMapOptions& options, const FieldSurvey& survey,
                         const MagneticMapResult& result, const std::string& held_out, const std::string& doubts) {
  Provenance provenance{{"made_by", "lodestone map magnetic"},
                        {"survey", SurveyFiles::names(call.survey.logs)},
                        {"trajectory", SurveyFiles::names(call.survey.trajectories)},
                        {"platform", std::filesystem::path(call.platform).filename().string()},
                        {"readings", std::to_string(survey.observations.size())},
                        {"cells", std::to_string(result.cells)},
                        {"method", method_name(options)}};
  for (int k = 0; k < 3; ++k) {
    const KernelParameters& kernel = result.fit.kernels[k];
    provenance.push_back(
        {fmt::format("kernel_{}", "xyz"[k]),
         fmt::format("signal {:.4g} uT, length scale {:.4g} m, noise {:.4g} uT per cell of {:.4g} m",
                     kernel.signal_sigma, kernel.length_scale_m, kernel.noise_sigma, result.fit.cell_m)});
  }
  if (const auto& potential = result.fit.potential) {
    provenance.push_back({"potential", fmt::format("length scale {:.4g} m, vertical {:.4g} m, constant field {:.4g} uT",
                                                   potential->length_scale_m, potential->vertical_length_scale_m,
                                                   potential->linear_sigma_ut)});
  }
  if (const std::string drive = drive_error_text(result.fit.drive); !drive.empty()) {
    provenance.push_back({"drive_error", drive});
  }
  if (result.errors.clock_s != 0.0) {
    provenance.push_back({"corrected_clock_offset", fmt::format("{:.4f} s", result.errors.clock_s)});
  }
  for (std::size_t j = 0; j < result.errors.offsets_ut.size(); ++j) {
    const Vector3& offset = result.errors.offsets_ut[j];
    provenance.push_back({fmt::format("subtracted_offset_{}", j),
                          fmt::format("{:.3f} {:.3f} {:.3f} uT", offset.x(), offset.y(), offset.z())});
  }
  if (!held_out.empty()) provenance.push_back({"held_out", held_out});
  if (!doubts.empty()) provenance.push_back({"warning", doubts});
  return provenance;
}

void map_magnetic(const MapMagneticCall& call) {
  const ThreadLimit limit(call.threads);
  const MagneticMapOptions options = read_options(call);
  const std::filesystem::path out = yaml_output(call.out);
  refuse_to_replace(call.out, call.force, {".tif", ".png"});
  if (!call.platform_out.empty()) {
    yaml_output(call.platform_out);
    refuse_to_replace(call.platform_out, call.force, {}, "--platform-out");
  }
  // A platform file that is written again must be complete, except for a LiDAR.
  const Platform platform =
      load_platform(call.platform, call.platform_out.empty() ? magnetometers_only : SensorChoice{.lidar = false});
  Time duration = 0;
  const FieldSurvey survey = read_field_survey(call, platform, duration);
  const Stopwatch building;
  const MagneticMapResult result = build_survey_map(call, survey, duration, options);
  const FieldGrid& grid = result.map.grid();
  fmt::print("{}: {} cells of {:.2f} m; {} nodes with field of {} x {} every {:g} m, {}; {:.1f} s\n",
             method_name(options), result.cells, result.fit.cell_m, result.nodes, grid.columns, grid.rows,
             grid.resolution_m, heights_text(grid), building.elapsed_s());
  fmt::print("{}", kernels_table(result.fit));
  const std::string drive = drive_error_text(result.fit.drive);
  fmt::print("error between drives: {}\n", drive.empty() ? "none found beyond the noise" : drive);
  if (options.clock_sigma_s > 0.0) fmt::print("{}", clock_text(result.errors));
  if (options.offset_sigma_ut > 0.0) fmt::print("{}", offsets_table(result.errors.offsets_ut, platform.suite));
  throw_if_interrupted();

  if (result.nodes == 0) {
    const std::string unreached = unreached_heights(survey.observations, result.map);
    throw InputError(fmt::format("{}: no node of the map has a sigma below {:.3f} uT; nothing is written: {}",
                                 SurveyFiles::names(call.survey.logs), result.map.max_sigma_ut(),
                                 !unreached.empty()           ? unreached
                                 : options.max_sigma_ut > 0.0 ? "increase --max-sigma-ut, or omit it"
                                                              : kSurveyCauses));
  }
  fmt::print("sigma of the map: median {:.3f} uT, 95 % below {:.3f} uT; no field above {:.3f} uT\n",
             result.median_sigma_ut, result.high_sigma_ut, result.map.max_sigma_ut());

  std::string held_out;
  const Stopwatch testing;
  const std::optional<HeldOutScore> score = score_held_out_blocks(survey.observations, result, options);
  if (score) {
    held_out = fmt::format(
        "every tenth {:g} m of way predicted from the rest: rms {:.3f} {:.3f} {:.3f} uT (x y z) over {} "
        "cells; normalized by sigma {:.2f} {:.2f} {:.2f}; {} cells without prediction",
        options.held_out_block_m, score->rms_ut.x(), score->rms_ut.y(), score->rms_ut.z(), score->cells,
        score->normalized_rms.x(), score->normalized_rms.y(), score->normalized_rms.z(), score->refused);
    fmt::print("held out: {}; {:.1f} s\n", held_out, testing.elapsed_s());
  }
  const std::string unreached = unreached_heights(survey.observations, result.map);
  const double height_sigma_m = result.map.errors().height_sigma_m;
  if (!options.heights_m.empty() && !unreached.empty()) {
    fmt::print("warning: map.height (1 times): {}\n", unreached);
  } else if (options.heights_m.empty() && height_sigma_m > most_height_sigma_m(result.fit)) {
    fmt::print(
        "warning: map.height (1 times): the survey's height varies by {:.2f} m (one sigma) about the only layer; "
        "set heights_m\n",
        height_sigma_m);
  }
  const std::string doubts = survey_doubts(result.fit, reading_noise(platform), score);
  if (!doubts.empty()) fmt::print("warning: map.survey_noise (1 times): {}\n", doubts);
  throw_if_interrupted();  // not later: the files of a map belong together
  write_magnetic_map(result.map, provenance_of(call, options, survey, result, held_out, doubts), call.out,
                     options.tile_nodes());
  const std::filesystem::path picture = std::filesystem::path(out).replace_extension(".png");
  draw_map_picture(picture, &result.map, {}, {});
  fmt::print("wrote {}, {} and {}\n", call.out, std::filesystem::path(out).replace_extension(".tif").string(),
             picture.string());
  if (call.platform_out.empty()) return;
  save_platform(without_errors(platform, result.errors), call.platform_out);
  fmt::print("wrote {}\n", call.platform_out);
}

void add_map_magnetic(CLI::App& parent) {
  const auto call = std::make_shared<MapMagneticCall>();
  CLI::App* command = parent.add_subcommand("magnetic",
                                            "Build a grid map of the ambient magnetic field from a survey drive, by "
                                            "Gaussian-process regression, with sigma");
  CommandFiles files(*command);
  add_survey_files(*command, files, "the magnetometers", call->survey);
  files.input(command->add_option("--platform", call->platform, "the robot's platform file"))->required();
  files
      .output(command->add_option("--out", call->out, "FIELD.yaml; FIELD.tif and FIELD.png are written next to it"),
              CommandFiles::with_endings({".tif", ".png"}))
      ->required();
  files.output(command->add_option("--platform-out", call->platform_out,
                                   "the platform file to write for this robot, with the offsets of its magnetometers "
                                   "as a part of their hard iron, and that of their clock"));
  command->add_flag("--force", call->force, "replace the files if they exist");
  command
      ->add_option("--method", call->method,
                   "s-gpr: each component separately (default); curl-free: one potential for all three")
      ->check(CLI::IsMember(options_detail::names_of(FieldMethod{})));
  command->add_option("--resolution", call->resolution_m, "spacing of the map's nodes, metres (default 0.1)");
  command->add_option("--max-sigma-ut", call->max_sigma_ut,
                      "nodes with larger sigma have no field (default: 0.71 of the signal sigma, and the offsets)");
  at_least_one(command->add_option("--threads", call->threads,
                                   "number of threads (default: all); the map does not depend on it"));
  files.input(command->add_option("--config", call->configurations,
                                  "YAML files with options; later files override earlier ones"));
  command->add_option("--set", call->settings, "one option, as key.path=value; for keys see below");
  command->footer("Options of --config and --set:\n" + list_options(MagneticMapOptions{}) +
                  R"(
Examples, with the files of `lodestone simulate tunnel --out /tmp/tunnel`:
  lodestone map magnetic /tmp/tunnel/survey.bag --trajectory /tmp/tunnel/survey.tum \
      --platform /tmp/tunnel/platform.yaml --out /tmp/tunnel/field.yaml
  lodestone map magnetic /tmp/tunnel/survey.bag --trajectory /tmp/tunnel/survey.tum \
      --platform /tmp/tunnel/platform.yaml --out /tmp/tunnel/coarse.yaml \
      --resolution 0.2 --set regression.window_points=200
  lodestone map magnetic /tmp/tunnel/survey.bag --trajectory /tmp/tunnel/survey.tum \
      --platform /tmp/tunnel/platform.yaml --out /tmp/tunnel/curl_free.yaml --method curl-free)");
  command->callback([call] { map_magnetic(*call); });
}

}  // namespace

void add_map_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("map", "Build cloud maps; build, import and compare magnetic maps");
  command->require_subcommand(1);
  command->footer(R"(
Examples, with the files of `lodestone simulate tunnel --out /tmp/tunnel`:
  lodestone map magnetic /tmp/tunnel/survey.bag --trajectory /tmp/tunnel/survey.tum \
      --platform /tmp/tunnel/platform.yaml --out /tmp/tunnel/field.yaml
  lodestone map cloud /tmp/tunnel/log.bag --trajectory /tmp/tunnel/truth.tum \
      --platform /tmp/tunnel/platform.yaml --out /tmp/tunnel/map.pcd
  lodestone map diff /tmp/tunnel/field.yaml /tmp/tunnel/coarse.yaml --out /tmp/tunnel/change
  lodestone map magnetic --help)");
  add_map_cloud(*command);
  add_map_magnetic(*command);
  add_map_import(*command);
  add_map_diff(*command);
  add_map_truth(*command);
}

}  // namespace lodestone
