#include "tools/export/run_results.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/report/json_file.h"
#include "tools/run/folder_lock.h"

namespace lodestone {

namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

/// The fields of summary.json that an export uses.
struct RunHeader {
  std::string status, platform, cloud;
  Vector3 origin_m = Vector3::Zero();
  std::vector<std::string> estimators;
};

RunHeader read_run_header(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    throw InputError(
        fmt::format("{}: there is no such folder; give the --out folder of `lodestone run`", folder.string()));
  }
  const char* unfinished = "{}: the run is not finished; repeat the call of `lodestone run` with --resume";
  if (fs::exists(folder / "checkpoint")) {
    const FolderLock refuses_a_run_in_progress(folder);
    throw InputError(fmt::format(fmt::runtime(unfinished), folder.string()));
  }
  const fs::path path = folder / "summary.json";
  if (!fs::exists(path)) {
    throw InputError(fmt::format("{}: has no summary.json; give the --out folder of `lodestone run`", folder.string()));
  }
  const Json summary = read_json(path);
  if (!summary.contains("estimators")) {
    throw InputError(
        fmt::format("{}: is the folder of one estimator; give the --out folder of `lodestone run`", folder.string()));
  }
  RunHeader header;
  values_of(path, [&]() {
    for (const auto& [name, figures] : summary.at("estimators").items()) header.estimators.push_back(name);
    header.status = summary.value("status", "done");
    if (summary.contains("platform") && summary["platform"].is_string()) header.platform = summary["platform"];
    if (summary.contains("cloud") && summary["cloud"].is_string()) header.cloud = summary["cloud"];
    if (summary.contains("call") && summary["call"].contains("origin_m")) {
      for (int k = 0; k < 3; ++k) header.origin_m[k] = summary["call"]["origin_m"].at(k);
    }
    return Json();
  });
  if (header.status == "interrupted") throw InputError(fmt::format(fmt::runtime(unfinished), folder.string()));
  return header;
}

EstimatorResults read_results(const fs::path& folder) {
  EstimatorResults results{read_estimator(folder), {}};
  for (const StampedCovariance& row : results.files.covariances) results.covariances[row.time] = row.covariance;
  return results;
}

}  // namespace

RunResults read_run_results(const fs::path& folder, const std::vector<std::string>& chosen) {
  const RunHeader header = read_run_header(folder);
  for (const std::string& name : chosen) {
    if (std::count(chosen.begin(), chosen.end(), name) > 1) {
      throw InputError(fmt::format("--estimator: '{}' is named twice", name));
    }
    if (std::find(header.estimators.begin(), header.estimators.end(), name) != header.estimators.end()) continue;
    throw InputError(fmt::format("--estimator: {} has {}, found '{}'{}", folder.string(), join_names(header.estimators),
                                 name, suggestion(name, header.estimators)));
  }
  RunResults run;
  run.folder = folder;
  run.platform = header.platform;
  run.cloud = header.cloud;
  run.origin_m = header.origin_m;
  std::optional<Time> begin;
  for (const std::string& name : chosen.empty() ? header.estimators : chosen) {
    const EstimatorResults& results = run.estimators.emplace_back(read_results(folder / name));
    const std::vector<Time>& scans = results.files.diagnostics_times;
    if (!scans.empty()) begin = std::min(begin.value_or(scans.front()), scans.front());
    if (!results.files.trajectory.empty()) {
      begin = std::min(begin.value_or(results.files.trajectory.front().time), results.files.trajectory.front().time);
    }
  }
  if (!begin) {
    throw InputError(
        fmt::format("{}: no estimator has a scan; use the folder of a run with estimates", folder.string()));
  }
  run.begin = *begin;
  const fs::path truth = folder / "overview" / "truth.tum";
  if (fs::exists(truth)) run.truth = read_tum(truth.string());
  return run;
}

}  // namespace lodestone
