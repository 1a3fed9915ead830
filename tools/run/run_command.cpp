#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "core/nearest_name.h"
#include "estimators/factory.h"
#include "frontends/configuration/options.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/run/run_call.h"

namespace lodestone {

namespace {

constexpr const char* kRunExamples = R"(
Examples, on what `lodestone simulate config/worlds/tunnel.yaml --out /tmp/tunnel` writes:
  lodestone map magnetic /tmp/tunnel/survey.bag --trajectory /tmp/tunnel/survey.tum --platform /tmp/tunnel/platform.yaml \
      --out /tmp/tunnel/field.yaml
  lodestone run /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml --cloud /tmp/tunnel/cloud.pcd \
      --magnetic /tmp/tunnel/field.yaml --initial-pose-from /tmp/tunnel/truth.tum --out /tmp/tunnel/run
  lodestone run /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml --cloud /tmp/tunnel/cloud.pcd \
      --magnetic /tmp/tunnel/field.yaml --initial-pose-from /tmp/tunnel/truth.tum --truth /tmp/tunnel/truth.tum \
      --estimator smoother,ieskf,lidar-inertial,magnetic --refine batch --out /tmp/tunnel/ab
  lodestone run /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml --cloud /tmp/tunnel/cloud.pcd \
      --magnetic /tmp/tunnel/field.yaml --initial-pose auto --out /tmp/tunnel/kidnapped

If a call was killed or interrupted, give the same words again and --resume: estimators that had ended are kept.
`lodestone run --list-options` shows every key that --set and --config take.)";

}  // namespace

void add_run_command(CLI::App& app, int* code) {
  CLI::App* command =
      app.add_subcommand("run", "Localize a log in prior maps with one estimator, or several side by side");
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
  files.input(
      command->add_option("--cloud", call->cloud, "prior point-cloud map, PCD or PLY (left out: no LiDAR is used)"));
  files.input(command->add_option("--magnetic", call->magnetic,
                                  "prior magnetic map, YAML (left out: no magnetometer is used)"));
  files.output(command->add_option("--out", call->out, "folder for the results"))->required();
  command->add_option("--estimator", call->estimators, "one or several with commas: " + join_names(estimator_names()))
      ->delimiter(',')
      ->capture_default_str();
  auto* pose =
      command->add_option("--initial-pose", call->initial_pose,
                          "T_map_imu at the log's begin, \"x y z qx qy qz qw\", or auto: found anywhere on the maps "
                          "(default: the map's origin)");
  files.input(command->add_option("--initial-pose-from", call->initial_pose_from, "trajectory (TUM) to take it from"))
      ->excludes(pose);
  files.input(
      command->add_option("--config", call->configurations, "options, YAML; later files win over earlier ones"));
  command->add_option("--set", call->settings, "key.path=value: one option; wins over every file");
  command->add_option("--max-range", call->max_range_m, "use LiDAR points up to this many metres only");
  command->add_option("--refine", call->refine, "batch: solve the whole log together at its end (smoother, magnetic)")
      ->check(CLI::IsMember({"none", "batch"}));
  command->add_flag("--bound", call->bound,
                    "with --truth: the least error that the sensors allow (Cramér-Rao), and ATE / bound");
  command
      ->add_option(
          "--check-seconds", call->check_seconds,
          "look at so many seconds of the log's begin first, as `lodestone check` does; refuse what makes the run "
          "wrong (0: do not look)")
      ->capture_default_str();
  command->add_flag(
      "--resume", call->resume,
      "after a killed or interrupted call of the same words: keep the estimators that had ended, run the others "
      "again; ends with the same bytes");
  command->add_option("--threads", call->threads, "at most so many (default: all); results are the same");
  files.input(
      command->add_option("--truth", call->truth, "true trajectory (TUM or EuRoC csv): figures, A/B table, pictures"));
  files.input(command->add_option("--calibration-truth", call->calibration_truth,
                                  "reality.yaml of `lodestone simulate`: errors of the estimated calibration"));
  command->add_flag_callback(
      "--list-options",
      []() {
        std::fputs(list_options(RunOptions{}).c_str(), stdout);
        throw CLI::Success();  // ends the parsing here: the required options need not be there
      },
      "list every key of --set with its default, and end");
  command->callback([call, code]() { *code = execute(*call); });
}

}  // namespace lodestone
