#include "tools/run/output_folder_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "core/error.h"
#include "estimators/factory.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

namespace fs = std::filesystem;

bool is_run_output(const fs::path& in_out) {
  const fs::path first = *in_out.begin();
  const std::vector<std::string> estimators = estimator_names();
  const bool in_a_folder = std::next(in_out.begin()) != in_out.end();
  if (in_a_folder) {
    return first == "overview" || first == "pictures" || first == "checkpoint" ||
           std::find(estimators.begin(), estimators.end(), first.string()) != estimators.end();
  }
  return first == "summary.json" || first == "config.yaml" || first == "bound.csv";
}

}  // namespace

void check_output_folder(const RunCall& call) {
  if (fs::is_directory(call.log) && !path_below(call.out, call.log).empty()) {
    throw InputError(fmt::format(
        "--out {}: is in the folder of the log {}, so that the results would be read as parts of the log; choose "
        "another folder",
        call.out, call.log));
  }
  for (const std::string& input : {call.log, call.platform, call.cloud, call.magnetic, call.truth,
                                   call.calibration_truth, call.initial_pose_from}) {
    if (input.empty()) continue;
    const fs::path in_out = path_below(input, call.out);
    if (in_out.empty() || in_out == "." || !is_run_output(in_out)) continue;
    throw InputError(fmt::format(
        "{}: is among the files that --out {} would replace; choose another folder for the results", input, call.out));
  }
}

}  // namespace lodestone
