#include <CLI/CLI.hpp>
#include <memory>

#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/export/export_call.h"

namespace lodestone {

namespace {

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
