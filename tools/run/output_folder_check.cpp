#include "tools/run/output_folder_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/error.h"
#include "estimators/factory.h"
#include "tools/report/overview.h"
#include "tools/run/resumption.h"
#include "tools/run/stale_results.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

namespace fs = std::filesystem;

/// All files that a run may write to its folder of results, relative to the folder. Without recordings.
std::vector<fs::path> written_files() {
  std::vector<fs::path> files = replaceable_files(estimator_names());
  for (const char* name : {"summary.json", "config.yaml", "call.json"}) files.emplace_back(name);
  for (const char* name : kOverviewFiles) files.push_back(fs::path("overview") / name);
  return files;
}

/// Throws InputError if a run would replace a file that no run wrote.
void check_foreign_files(const fs::path& out) {
  if (fs::exists(out / "checkpoint" / "call.json") || summary_in(out).contains("identity")) return;
  for (const fs::path& file : written_files()) {
    if (!fs::is_regular_file(out / file)) continue;
    throw InputError(
        fmt::format("{}: no run wrote this file, but the run would replace it; move the file, or choose another --out",
                    (out / file).string()));
  }
}

}  // namespace

bool is_run_output(const fs::path& in_out) {
  const std::vector<fs::path> files = written_files();
  return *in_out.begin() == "checkpoint" || std::find(files.begin(), files.end(), in_out) != files.end();
}

void check_output_folder(const RunCall& call) {
  if (fs::is_directory(call.log) && !path_below(call.out, call.log).empty()) {
    throw InputError(fmt::format(
        "--out {}: is in the folder of the log {}, so that the results would be read as parts of the log; choose "
        "another folder",
        call.out, call.log));
  }
  // Not --config: a run may be repeated in its folder with its own config.yaml.
  for (const std::string& input : {call.log, call.platform, call.cloud, call.magnetic, call.truth,
                                   call.calibration_truth, call.initial_pose_from}) {
    if (input.empty()) continue;
    const fs::path in_out = path_below(input, call.out);
    if (in_out.empty() || in_out == "." || !is_run_output(in_out)) continue;
    throw InputError(fmt::format(
        "{}: is among the files that --out {} would replace; choose another folder for the results", input, call.out));
  }
  check_foreign_files(call.out);
}

}  // namespace lodestone
