#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/kitti_trajectory.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/output_file.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/logs/ros2/bag_folder_writer.h"
#include "frontends/maps/plane_map_loader.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/export/deskewed_scans.h"
#include "tools/export/log_export.h"
#include "tools/export/run_results.h"
#include "tools/origin_option.h"
#include "tools/progress.h"
#include "tools/run/output_folder_check.h"
#include "tools/writers/estimate_files.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

namespace fs = std::filesystem;

/// The options of `lodestone export`.
struct ExportCall {
  std::string run;
  std::string to;
  std::vector<std::string> estimators;  ///< empty: all of the run
  std::string log;                      ///< empty: no scans
  std::string platform;                 ///< empty: that of the run
  std::string out;                      ///< empty: a name in the run's folder
  bool force = false;                   ///< replace a file that `out` names
};

bool is_trajectory(const ExportCall& call) {
  return call.to != "mcap" && call.to != "db3";
}

/// The given output, or a name in the run's folder.
fs::path output_of(const ExportCall& call) {
  if (!call.out.empty()) return call.out;
  const std::string ending = call.to == "euroc" ? ".csv" : call.to == "db3" ? "" : "." + call.to;
  return fs::path(call.run) / ("export" + ending);
}

/// Throws InputError if the output would replace a file of the run.
void check_output(const ExportCall& call, const fs::path& out) {
  const fs::path in_run = path_below(out.string(), call.run);
  if (in_run.empty()) return;
  const bool in_subfolder = std::next(in_run.begin()) != in_run.end();
  if (!in_subfolder && in_run != "." && !is_run_output(in_run)) return;
  throw InputError(fmt::format("--out {}: is among the results of {}; choose another name", out.string(), call.run));
}

/// The platform file with the LiDAR's place: the given one, the calibrated one of the run, or the one of the call.
Platform platform_for_scans(const ExportCall& call, const RunResults& run) {
  if (!call.platform.empty()) return load_platform(call.platform);
  const fs::path calibrated = run.estimators.front().files.folder / "platform.yaml";
  if (fs::exists(calibrated)) return load_platform(calibrated.string());
  if (run.platform.empty() || !fs::exists(run.platform)) {
    throw InputError(
        fmt::format("--log: the platform file of the run, '{}', does not exist; give --platform FILE", run.platform));
  }
  return load_platform(run.platform);
}

/// The planes that the run used, for the residuals of the points. Null without a cloud map.
std::shared_ptr<const PlaneMapSource> planes_for_scans(const RunResults& run, const Platform& platform) {
  if (run.cloud.empty()) return nullptr;
  if (!fs::exists(run.cloud)) {
    fmt::print(
        "warning: the cloud map of the run, '{}', does not exist: scans have no residual_m; repeat the call in the "
        "folder of the "
        "run's call\n",
        run.cloud);
    return nullptr;
  }
  PlaneMapOptions options;
  const fs::path file = run.folder / "config.yaml";
  const ConfigurationNode all = fs::exists(file) ? ConfigurationNode::load(file.string()) : ConfigurationNode();
  const ConfigurationNode* lidar = all.find("lidar");  // other options may be of another version
  if (lidar != nullptr && lidar->find("map") != nullptr) load_options(lidar->at("map"), options);
  WarningLog ignored;  // the run reported them
  return load_planes(run.cloud, options, platform.suite.lidars(), fs::temp_directory_path().string(), ignored,
                     run.origin_m)
      .source;
}

void export_to_log(const ExportCall& call, const RunResults& run, const fs::path& out) {
  std::unique_ptr<DeskewedScans> scans;
  if (!call.log.empty()) {
    const Platform platform = platform_for_scans(call, run);
    scans = std::make_unique<DeskewedScans>(call.log, platform, run.estimators.front().files.trajectory,
                                            planes_for_scans(run, platform));
  }
  std::unique_ptr<LogWriter> writer;
  if (call.to == "mcap") {
    writer = make_log_writer(out.string(), LogFormat::mcap, Codec::zstd);
  } else {
    writer = std::make_unique<BagFolderWriter>(out.string());
  }
  const std::vector<Time>& stamps = run.estimators.front().files.diagnostics_times;
  Progress progress(out.filename().string(), run.begin, stamps.empty() ? run.begin : stamps.back());
  const std::int64_t messages =
      export_log(run, scans.get(), *writer, [&progress](Time time) { progress.advance(time); });
  writer->close();
  progress.finish();
  fmt::print("{}: {} messages\n", out.string(), messages);
  for (std::size_t i = 0; i < run.estimators.size(); ++i) {
    const ExportedEstimator names = exported_names(run, i);
    fmt::print("{}: topics {}/..., frame {}\n", run.estimators[i].files.name, names.prefix, names.frame);
  }
  if (scans == nullptr) return;
  for (const auto& [kind, entry] : scans->warnings().entries())
    fmt::print("warning {} ({}): {}\n", kind, entry.count, entry.first_detail);
}

void export_to_trajectory(const ExportCall& call, const RunResults& run, const fs::path& out) {
  if (run.estimators.size() > 1) {
    const auto name_of = [](const EstimatorResults& results) { return results.files.name; };
    throw InputError(fmt::format("--to {}: the file has one trajectory; choose one of {} with --estimator", call.to,
                                 join_names(run.estimators, name_of)));
  }
  const EstimatorFiles& files = run.estimators.front().files;
  const Trajectory trajectory = georeferenced(files.trajectory, run.origin_m);
  if (trajectory.empty()) {
    throw InputError(fmt::format("{}: has no poses; see health in diagnostics.csv beside the file",
                                 (files.folder / "trajectory.tum").string()));
  }
  if (call.to == "kitti") {
    const fs::path times = out.string() + ".times";
    OutputFile times_file(times), poses_file(out);
    times_file.write(kitti_times_text(trajectory));
    poses_file.write(kitti_text(trajectory));
    times_file.commit();
    poses_file.commit();
    fmt::print("{}: {} poses; their times are in {}\n", out.string(), trajectory.size(), times.string());
    return;
  }
  if (call.to == "euroc") {
    write_text_file(out, euroc_text(trajectory));
  } else {
    write_tum(out.string(), trajectory, kTrajectoryColumns);
  }
  fmt::print("{}: {} poses\n", out.string(), trajectory.size());
}

/// Writes the export and reports it on the terminal. Throws InputError.
void execute(const ExportCall& call) {
  const fs::path out = output_of(call);
  check_output(call, out);
  const bool may_replace = call.force || call.out.empty();
  if (call.to != "db3") refuse_to_replace(call.out, may_replace);
  if (call.to == "kitti") refuse_to_replace(call.out + ".times", may_replace);
  if (call.to == "mcap" && out.extension() != ".mcap") {
    throw InputError(fmt::format("--out {}: expected a name that ends in .mcap, as --to mcap was given", out.string()));
  }
  if (is_trajectory(call) && !call.log.empty()) {
    throw InputError(fmt::format("--log: --to {} has no scans; omit --log, or use --to mcap", call.to));
  }
  const RunResults run = read_run_results(call.run, call.estimators);
  throw_if_interrupted();
  make_folder_of(out);
  if (is_trajectory(call)) {
    export_to_trajectory(call, run, out);
  } else {
    export_to_log(call, run, out);
  }
}

constexpr const char* kExportExamples = R"(
Examples, with the files of `lodestone run ... --out /tmp/tunnel/run` (see lodestone run --help):
  lodestone export /tmp/tunnel/run --to mcap
  lodestone export /tmp/tunnel/run --to mcap --log /tmp/tunnel/log.bag --out /tmp/tunnel/results.mcap
  lodestone export /tmp/tunnel/run --to kitti --estimator smoother)";

}  // namespace

void add_export_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("export", "Write the results of a run for Foxglove, RViz and other programs");
  command->footer(kExportExamples);
  const auto call = std::make_shared<ExportCall>();
  CommandFiles files(*command);
  command->add_option("RUN", call->run, "--out folder of `lodestone run`")->required();
  command
      ->add_option("--to", call->to,
                   "mcap or db3: messages of ROS 2 (db3: a folder with metadata.yaml); kitti, euroc or tum: the "
                   "trajectory of one estimator")
      ->required()
      ->check(CLI::IsMember({"mcap", "db3", "kitti", "euroc", "tum"}));
  command->add_option("--estimator", call->estimators, "one or several with commas (default: all of the run)")
      ->delimiter(',');
  CLI::Option* log = files.input(command->add_option(
      "--log", call->log, "the log of the run: also write its scans, deskewed with the first estimator's poses"));
  files
      .input(command->add_option("--platform", call->platform,
                                 "with --log: the platform file (default: the one of the run)"))
      ->needs(log);
  files.output(command->add_option("--out", call->out, "the file or folder to write (default: RUN/export...)"));
  command->add_flag("--force", call->force, "replace the file of --out if it exists");
  command->callback([call] { execute(*call); });
}

}  // namespace lodestone
