#include <CLI/CLI.hpp>
#include <memory>

#include "tools/check/check_call.h"
#include "tools/command_files.h"
#include "tools/commands.h"

namespace lodestone {

namespace {

constexpr const char* kCheckExamples = R"(
Examples, on what `lodestone simulate config/worlds/tunnel.yaml --out /tmp/tunnel` and `lodestone map magnetic` write:
  lodestone check /tmp/tunnel/log.bag
  lodestone check /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml
  lodestone check /tmp/tunnel/log.bag --platform /tmp/tunnel/platform.yaml --cloud /tmp/tunnel/cloud.pcd \
      --magnetic /tmp/tunnel/field.yaml --initial-pose-from /tmp/tunnel/truth.tum --out /tmp/tunnel/check.json

Exit code: 0 where nothing worse than a warning was found, 2 where a run would be refused, lost or wrong.)";

}  // namespace

void add_check_command(CLI::App& app, int* code) {
  CLI::App* command = app.add_subcommand(
      "check", "Look at a log's begin and say what is wrong with it, with the platform file, or with the maps");
  command->footer(kCheckExamples);
  const auto call = std::make_shared<CheckCall>();
  CommandFiles files(*command);
  files.input(command->add_option("LOG", call->log, "a log as `lodestone run` takes it"))->required();
  files.input(
      command->add_option("--platform", call->platform, "platform file (left out: topics are listed, no more)"));
  files.input(command->add_option("--cloud", call->cloud,
                                  "prior point-cloud map: overlap, start and extrinsics are held against it"));
  files.input(
      command->add_option("--magnetic", call->magnetic, "prior magnetic map: the magnetometers are held against it"));
  auto* pose = command->add_option("--initial-pose", call->initial_pose,
                                   "T_map_imu at the log's begin, \"x y z qx qy qz qw\", or auto");
  files.input(command->add_option("--initial-pose-from", call->initial_pose_from, "trajectory (TUM) to take it from"))
      ->excludes(pose);
  command->add_option("--seconds", call->seconds, "how much of the log is looked at")->capture_default_str();
  files.output(command->add_option("--out", call->out, "write the findings to this JSON file, too"));
  command->add_option("--threads", call->threads, "at most so many (default: all); results are the same");
  command->callback([call, code]() { *code = execute(*call); });
}

}  // namespace lodestone
