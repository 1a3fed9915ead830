#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "frontends/configuration/options.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/evaluate/comparison.h"

namespace lodestone {

namespace {

constexpr const char* kEvaluateExamples = R"(
Examples, with the files of `lodestone simulate tunnel --out /tmp/tunnel` and `lodestone run`:
  lodestone evaluate /tmp/tunnel/run/smoother/trajectory.tum /tmp/tunnel/truth.tum --interpolate
  lodestone evaluate /tmp/tunnel/run/smoother/trajectory.tum /tmp/tunnel/truth.tum \
      --align se3 --relation rpe --delta 1 \
      --delta-unit metres --json)";

}  // namespace

void add_evaluate_command(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("evaluate", "Compare a trajectory with the ground truth: ATE, RPE, heading, NEES");
  command->footer(kEvaluateExamples);
  const auto call = std::make_shared<ComparisonCall>();
  const auto json = std::make_shared<bool>(false);
  CommandFiles files(*command);
  files.input(command->add_option("ESTIMATE", call->estimate, "estimated trajectory: TUM, EuRoC csv or KITTI"))
      ->required();
  files.input(command->add_option("TRUTH", call->truth, "ground-truth trajectory: TUM, EuRoC csv or KITTI"))
      ->required();
  files.input(command->add_option("--times", call->times,
                                  "times of the poses of a KITTI file, one stamp in seconds in each line"));
  command->add_option("--align", call->align, "alignment of the estimate with the ground truth")
      ->check(CLI::IsMember(options_detail::names_of(Alignment{})))
      ->capture_default_str();
  command->add_option("--relation", call->relations, "errors, several with commas (default: all)")
      ->delimiter(',')
      ->check(CLI::IsMember(relation_names()));
  command->add_option("--delta", call->delta, "length of a segment for rpe")->capture_default_str();
  command->add_option("--delta-unit", call->delta_unit, "unit of --delta (metres: a segment begins at every pose)")
      ->check(CLI::IsMember({"frames", "metres"}))
      ->capture_default_str();
  command->add_flag("--all-pairs", call->all_pairs,
                    "with frames: a segment begins at every pose; default: consecutive segments");
  command->add_flag("--interpolate", call->interpolate,
                    "interpolate the ground truth at the estimate's stamps instead of matching stamps");
  command->add_option("--max-difference", call->max_difference_s, "largest difference of matched stamps, seconds")
      ->capture_default_str();
  files.input(command->add_option("--covariance", call->covariance, "covariance.csv of the estimate, for NEES"));
  files.output(command->add_option("--errors", call->errors, "write the errors over time to this CSV file"));
  command->add_flag("--json", *json, "print JSON instead of a table");
  command->callback([call, json] {
    const Comparison comparison = compare(*call);
    std::fputs((*json ? to_json(comparison) : to_table(comparison)).c_str(), stdout);
  });
}

}  // namespace lodestone
