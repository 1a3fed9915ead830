#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/error.h"
#include "frontends/configuration/platform.h"
#include "frontends/configuration/text_file.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/init/platform_draft.h"
#include "tools/messages.h"
#include "tools/writers/output_folder.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;

constexpr const char* kInitExamples = R"(
Comments in the file state how each value was found, or that it is a guess. Correct the guesses, then check the file.

Examples, with the files of `lodestone simulate tunnel --out /tmp/tunnel`:
  lodestone init /tmp/tunnel/log.bag --out /tmp/tunnel/robot.yaml
  lodestone check /tmp/tunnel/log.bag --platform /tmp/tunnel/robot.yaml)";

struct InitCall {
  std::vector<std::string> logs;
  std::string out;
  double seconds = 60.0;
  std::string imu_noise;
  bool force = false;
};

void check_init_call(const InitCall& call) {
  if (!(call.seconds > 0.0))
    throw InputError(fmt::format("--seconds: expected a number above 0, found {}", call.seconds));
  check_different(call.logs, "omit one");
  refuse_to_replace(call.out, call.force);
}

/// The comment lines at the begin of the file.
std::string head_of(const InitCall& call) {
  std::string text = "# Written by `lodestone init` from";
  for (const std::string& log : call.logs) text += " " + fs::path(log).filename().string();
  for (char& letter : text) {
    if (letter == '\n' || letter == '\r') letter = '?';
  }
  return text +
         ". Correct the lines with a guess, then run `lodestone check`.\n"
         "# No check finds a wrong position of a sensor: measure the keys under 'guesses', then remove them there.\n"
         "# Frames: imu is the body. T_imu_x maps points of x to imu. Names of keys contain the units.\n"
         "# All keys: docs/user/platform-file.md\n";
}

void write_drafted_platform(const InitCall& call) {
  check_init_call(call);
  const fs::path out = yaml_output(call.out);
  WarningLog warnings;
  const LogSurvey survey = survey_logs(call.logs, warnings);
  const CommentedPlatform draft = draft_platform(survey, out.stem().string(), call.seconds, call.imu_noise);
  const std::string text = head_of(call) + commented_text(draft);
  // A file that cannot be read is never written.
  parse_platform(text, out.string(), {.lidar = draft.platform.has_lidar()});
  write_text_file(out, text);
  const auto guesses = std::count_if(draft.comments.begin(), draft.comments.end(),
                                     [](const auto& each) { return each.second.starts_with("guess"); });
  fmt::print("{}: {}, IMU {}, {} magnetometer(s); {} lines are guesses\n", out.string(),
             draft.platform.has_lidar() ? "LiDAR " + draft.platform.lidar.topic : "no LiDAR", draft.platform.imu.topic,
             draft.platform.magnetometers.size(), guesses);
  if (const std::string unread = reasons_of_refusal(survey, Sensor::magnetometer); !unread.empty())
    fmt::print("magnetometers not read: {}\n", unread);
  print_warnings(warnings);
  if (call.logs.size() == 1) {
    fmt::print("next: lodestone check {} --platform {}\n", call.logs.front(), out.string());
  } else {
    fmt::print("next: put these logs into one folder; lodestone check FOLDER --platform {}\n", out.string());
  }
}

}  // namespace

void add_init_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("init", "Write a platform file from the logs of a robot");
  command->footer(kInitExamples);
  const auto call = std::make_shared<InitCall>();
  CommandFiles files(*command);
  files.input(command->add_option("LOG", call->logs, "logs of one robot, in any format of `lodestone run`"))
      ->required();
  files.output(command->add_option("--out", call->out, "the platform file to write, .yaml"))->required();
  command
      ->add_option("--seconds", call->seconds,
                   "duration of the part of each log that is read for units and for noise at standstill, seconds")
      ->capture_default_str();
  files.input(command->add_option("--imu-noise", call->imu_noise,
                                  "take the noise of the IMU from a file of Kalibr, allan_variance_ros or imu_utils"));
  command->add_flag("--force", call->force, "replace the platform file if it exists");
  command->callback([call] { write_drafted_platform(*call); });
}

}  // namespace lodestone
