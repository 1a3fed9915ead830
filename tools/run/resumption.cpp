#include "tools/run/resumption.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "frontends/configuration/aside.h"
#include "core/error.h"
#include "estimators/factory.h"
#include "frontends/configuration/text_file.h"
#include "tools/commands.h"
#include "tools/run/run_checkpoint.h"
#include "tools/writers/output_file.h"

namespace lodestone {

namespace {

namespace fs = std::filesystem;

/// The exit code of a call of this identity that ended whole.
std::optional<int> code_of_whole_results(const RunCall& call, const RunIdentity& identity) {
  const fs::path summary = fs::path(call.out) / "summary.json";
  if (fs::exists(checkpoint_folder(call)) || !fs::exists(summary)) return std::nullopt;
  const auto json = nlohmann::json::parse(read_text_file(summary.string()), nullptr, false);
  if (!json.is_object() || !json.contains("identity") || json["identity"] != digest(identity) || !json.contains("status")) {
    return std::nullopt;
  }
  if (json["status"] == "done") return exit_code::done;
  if (json["status"] == "lost") return exit_code::track_lost;
  return std::nullopt;
}

/// What a killed process had written aside, wherever a run writes.
void remove_leftovers(const RunCall& call) {
  const fs::path out(call.out);
  std::vector<fs::path> folders{out, out / "pictures", out / "overview", checkpoint_folder(call)};
  for (const std::string& name : call.estimators) folders.push_back(out / name);
  std::error_code ignored;
  for (const fs::path& folder : folders) {
    for (const auto& entry : fs::directory_iterator(folder, ignored)) {
      if (is_aside_name(entry.path().filename().string())) fs::remove(entry.path(), ignored);
    }
  }
}

}  // namespace

fs::path checkpoint_folder(const RunCall& call) { return fs::path(call.out) / "checkpoint"; }

std::optional<int> begin_or_go_on(const RunCall& call, const RunIdentity& identity) {
  const fs::path folder = checkpoint_folder(call);
  if (call.resume) {
    if (const auto code = code_of_whole_results(call, identity)) {
      std::printf("%s: the results are whole already; nothing is left to resume\n", call.out.c_str());
      return code;
    }
    bool any = false;
    for (const std::string& name : call.estimators) {
      RunCheckpoint checkpoint(folder, name, 0.0, identity);
      if (checkpoint.exists()) {
        const PassState pass = checkpoint.read();
        std::printf("%s: goes on after %lld scans\n", name.c_str(), static_cast<long long>(pass.scans));
        any = true;
      }
    }
    if (!any) std::printf("%s: no checkpoint to resume from; the run begins anew\n", call.out.c_str());
  } else {
    forget_checkpoints(call);
  }
  remove_leftovers(call);
  made_folder(folder);
  return std::nullopt;
}

void forget_checkpoints(const RunCall& call) {
  const fs::path folder = checkpoint_folder(call);
  if (!fs::is_directory(fs::symlink_status(folder))) return;
  const std::vector<std::string> estimators = estimator_names();
  std::vector<fs::path> ours;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string(), ending = entry.path().extension().string();
    const bool state = ending == ".state" || ending == ".estimates" || ending == ".keyframes";
    const bool of_an_estimator = std::find(estimators.begin(), estimators.end(), entry.path().stem().string()) != estimators.end();
    if (!(state && of_an_estimator) && !is_aside_name(name)) {
      throw InputError(fmt::format("{}: is no checkpoint of a run, and its folder is emptied by the run; move it, or choose another --out",
                                   entry.path().string()));
    }
    ours.push_back(entry.path());
  }
  ours.push_back(folder);
  for (const fs::path& each : ours) {
    std::error_code error;
    fs::remove(each, error);
    if (error) throw InputError(fmt::format("{}: cannot be removed: {}", each.string(), error.message()));
  }
}

}  // namespace lodestone
