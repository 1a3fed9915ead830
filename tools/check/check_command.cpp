#include <CLI/CLI.hpp>
#include <memory>

#include "tools/check/check_call.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/origin_option.h"

namespace lodestone {

namespace {

constexpr const char* kCheckExamples = R"(
Examples, with the files of `lodestone simulate tunnel --out /tmp/tunnel` and of
`lodestone map magnetic`:
  lodestone check /tmp/tunnel/log.bag
  lodestone check /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml
  lodestone check /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml --cloud /tmp/tunnel/cloud.pcd \
      --magnetic /tmp/tunnel/field.yaml --initial-pose-from /tmp/tunnel/truth.tum --out /tmp/tunnel/check.json

Exit code: 2 if a finding is an error (a run would be refused, lost or wrong), otherwise 0.)";

}  // namespace

void add_check_command(CLI::App& app, int* code) {
  CLI::App* command =
      app.add_subcommand("check", "Check the first seconds of a log: topics, clocks, units, extrinsics and maps");
  command->footer(kCheckExamples);
  const auto call = std::make_shared<CheckCall>();
  CommandFiles files(*command);
  files.input(command->add_option("LOG", call->log, "a log in a format of `lodestone run`"))->required();
  files.input(command->add_option("--platform", call->platform, "platform file (without it, topics are only listed)"));
  files.input(
      command->add_option("--cloud", call->cloud,
                          "prior point-cloud map, to check what it is good for, overlap, initial pose and extrinsics"));
  files.input(command->add_option("--magnetic", call->magnetic, "prior magnetic map, to check the magnetometers"));
  add_origin(*command, "subtracted from maps and the initial pose", call->origin_m);
  auto* pose = command->add_option("--initial-pose", call->initial_pose,
                                   "T_map_imu at the first scan, \"x y z qx qy qz qw\", or auto");
  files
      .input(
          command->add_option("--initial-pose-from", call->initial_pose_from, "trajectory (TUM) with the initial pose"))
      ->excludes(pose);
  command->add_option("--seconds", call->seconds, "duration of the checked part of the log, seconds")
      ->capture_default_str();
  files.output(command->add_option("--out", call->out, "also write the findings to this JSON file"));
  at_least_one(
      command->add_option("--threads", call->threads, "number of threads (default: all); results do not depend on it"));
  command->callback([call, code]() { *code = execute(*call); });
}

}  // namespace lodestone
