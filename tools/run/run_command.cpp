#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "estimators/factory.h"
#include "frontends/configuration/options.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/origin_option.h"
#include "tools/run/run_call.h"

namespace lodestone {

namespace {

constexpr const char* kRunExamples = R"(
Examples, with the files of `lodestone simulate tunnel --out /tmp/tunnel`:
  lodestone map magnetic /tmp/tunnel/survey.bag --trajectory /tmp/tunnel/survey.tum \
      --platform /tmp/tunnel/platform.yaml --out /tmp/tunnel/field.yaml
  lodestone run /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml --cloud /tmp/tunnel/cloud.pcd \
      --magnetic /tmp/tunnel/field.yaml --initial-pose-from /tmp/tunnel/truth.tum --out /tmp/tunnel/run
  lodestone run /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml --cloud /tmp/tunnel/cloud.pcd \
      --magnetic /tmp/tunnel/field.yaml --initial-pose-from /tmp/tunnel/truth.tum --truth /tmp/tunnel/truth.tum \
      --estimator smoother,ieskf,lidar-inertial,magnetic --refine batch --out /tmp/tunnel/ab
  lodestone run /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml --cloud /tmp/tunnel/cloud.pcd \
      --magnetic /tmp/tunnel/field.yaml --initial-pose auto --out /tmp/tunnel/kidnapped

If a call was killed or interrupted, repeat the call with --resume: finished estimators are kept.
`lodestone run --list-options` lists all keys of --set and --config.)";

}  // namespace

void add_run_command(CLI::App& app, int* code) {
  CLI::App* command = app.add_subcommand("run", "Localize a log in prior maps with one or several estimators");
  command->footer(kRunExamples);
  const auto call = std::make_shared<RunCall>();
  CommandFiles files(*command);
  files
      .input(command->add_option(
          "LOG", call->log,
          "a bag of ROS 1 or ROS 2 (.bag, .mcap, .db3, its folder), or a folder of CSV and PCD files"))
      ->required();
  files.input(command->add_option("--platform", call->platform, "platform file: sensors, topics, extrinsics, noise"))
      ->required();
  files.input(command->add_option("--cloud", call->cloud,
                                  "prior point-cloud map: PCD, PLY or LAS (without it, LiDAR is not used)"));
  files.input(command->add_option("--magnetic", call->magnetic,
                                  "prior magnetic map, YAML (without it, magnetometers are not used)"));
  files.output(command->add_option("--out", call->out, "folder for the results"))->required();
  command->add_option("--estimator", call->estimators, "one or several with commas")
      ->type_name(fmt::format("NAME:{{{}}}", fmt::join(estimator_names(), ",")))
      ->delimiter(',')
      ->capture_default_str();
  add_origin(*command, "subtracted from maps, truth and initial pose; added to the trajectories in georeferenced.tum",
             call->origin_m);
  auto* pose =
      command->add_option("--initial-pose", call->initial_pose,
                          "T_map_imu at the first scan, \"x y z qx qy qz qw\", or auto: searched on the whole map "
                          "(default: the map's origin)");
  files
      .input(command->add_option("--initial-pose-from", call->initial_pose_from,
                                 "trajectory (TUM) with the initial pose and velocity"))
      ->excludes(pose);
  files.input(command->add_option("--config", call->configurations,
                                  "YAML files with options; later files override earlier ones"));
  command->add_option("--set", call->settings, "key.path=value: one option; overrides all files");
  command->add_option("--max-range", call->max_range_m, "largest range of LiDAR points, metres");
  command->add_option("--refine", call->refine, "batch: also solve the whole log at once (smoother, magnetic)")
      ->check(CLI::IsMember({"none", "batch"}));
  command->add_flag("--bound", call->bound,
                    "with --truth: the smallest error that the sensors allow (Cramér-Rao), and ATE / bound");
  command
      ->add_option("--check-seconds", call->check_seconds,
                   "seconds of the log to check first, as `lodestone check` does; refuse errors that make the run "
                   "wrong (0: no check)")
      ->capture_default_str();
  command->add_flag(
      "--resume", call->resume,
      "after a killed or interrupted call with the same options: keep finished estimators, run the others "
      "again; gives the same bytes");
  at_least_one(
      command->add_option("--threads", call->threads, "number of threads (default: all); results do not depend on it"));
  files.input(command->add_option("--truth", call->truth,
                                  "ground truth (TUM or EuRoC csv), for errors, A/B table and pictures"));
  files.input(command->add_option("--calibration-truth", call->calibration_truth,
                                  "reality.yaml of `lodestone simulate`, for errors of the estimated calibration"));
  command->add_flag_callback(
      "--list-options",
      []() {
        std::fputs(list_options(RunOptions{}).c_str(), stdout);
        throw CLI::Success();  // skips the check of required options
      },
      "list all keys of --set with defaults and exit");
  command->callback([call, code]() { *code = execute(*call); });
}

}  // namespace lodestone
