#include "tools/run/resumption.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "estimators/factory.h"
#include "frontends/configuration/aside.h"
#include "frontends/configuration/text_file.h"
#include "tools/commands.h"
#include "tools/run/estimate_recording.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

namespace fs = std::filesystem;

fs::path checkpoint_folder(const RunCall& call) {
  return fs::path(call.out) / "checkpoint";
}

/// Identity of the call that made the recordings. Exists while results are missing.
fs::path identity_file(const RunCall& call) {
  return checkpoint_folder(call) / "call.json";
}

/// Identity of the call that made the finished results.
fs::path finished_identity_file(const RunCall& call) {
  return fs::path(call.out) / "call.json";
}

/// The exit code of a complete call with this identity.
std::optional<int> exit_code_of_complete_results(const RunCall& call, const RunIdentity& identity) {
  if (fs::exists(identity_file(call))) return std::nullopt;
  const nlohmann::json json = summary_in(call.out);
  if (!json.is_object() || !json.contains("identity") || json["identity"] != digest(identity) ||
      !json.contains("status")) {
    return std::nullopt;
  }
  if (json["status"] == "done") return exit_code::done;
  if (json["status"] == "lost" || json["status"] == "regained") return exit_code::track_lost;
  return std::nullopt;
}

/// Removes temporary files of a killed process from all folders of a run.
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

nlohmann::json summary_in(const fs::path& out) {
  const fs::path summary = out / "summary.json";
  if (!fs::is_regular_file(summary)) return {};
  return nlohmann::json::parse(read_text_file(summary.string()), nullptr, false);
}

fs::path recording_of(const RunCall& call, const std::string& estimator) {
  return checkpoint_folder(call) / (estimator + ".estimates");
}

namespace {

/// The identity in a file; nothing if there is no such file.
std::optional<RunIdentity> identity_in(const fs::path& file) {
  if (!fs::exists(file)) return std::nullopt;
  const auto json = nlohmann::json::parse(read_text_file(file.string()), nullptr, false);
  try {
    return json.get<RunIdentity>();
  } catch (const nlohmann::json::exception&) {
    throw InputError(fmt::format("{}: the file is damaged; run without --resume to begin again", file.string()));
  }
}

/// The first difference from the unfinished call in the folder, or else from the call whose results are there. Empty if
/// there is none.
std::string difference_from_earlier_call(const RunCall& call, const RunIdentity& identity) {
  const bool unfinished = fs::exists(identity_file(call));
  if (const auto written = identity_in(unfinished ? identity_file(call) : finished_identity_file(call))) {
    return difference_between(*written, identity);
  }
  const nlohmann::json json = summary_in(call.out);
  const bool other =
      !unfinished && json.is_object() && json.contains("identity") && json["identity"] != digest(identity);
  return other ? "the results are of another call" : "";
}

void remove_or_fail(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
  if (error)
    throw InputError(fmt::format("{}: cannot be removed: {}; check its permissions", path.string(), error.message()));
}

/// Removes recordings and partial files, not the identity: without it, results of a killed call would count as
/// finished. Throws InputError if OUT/checkpoint has a file that no run wrote.
void remove_recordings(const RunCall& call) {
  const fs::path folder = checkpoint_folder(call);
  if (!fs::is_directory(fs::symlink_status(folder))) return;
  const std::vector<std::string> estimators = estimator_names();
  std::vector<fs::path> ours;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const bool recording =
        entry.path().extension() == ".estimates" &&
        std::find(estimators.begin(), estimators.end(), entry.path().stem().string()) != estimators.end();
    if (entry.path() == identity_file(call)) continue;
    if (!recording && !is_aside_name(name)) {
      throw InputError(
          fmt::format("{}: no run wrote this file, but the run would delete it; move the file, or choose another --out",
                      entry.path().string()));
    }
    ours.push_back(entry.path());
  }
  for (const fs::path& each : ours) remove_or_fail(each);
}

void remove_checkpoint(const RunCall& call) {
  remove_recordings(call);
  remove_or_fail(identity_file(call));
  remove_or_fail(checkpoint_folder(call));
}

void print_kept_estimators(const RunCall& call) {
  bool any = false;
  for (const std::string& name : call.estimators) {
    if (!EstimateRecording::read(recording_of(call, name))) continue;
    std::printf("%s: finished; its estimates are kept\n", name.c_str());
    any = true;
  }
  if (!any) std::printf("%s: no estimator has finished; the run begins again\n", call.out.c_str());
}

}  // namespace

std::optional<int> begin_or_resume(const RunCall& call, const RunIdentity& identity) {
  if (call.resume) {
    if (const auto code = exit_code_of_complete_results(call, identity)) {
      std::printf("%s: the results are complete; nothing to resume\n", call.out.c_str());
      remove_checkpoint(call);  // a process that was killed just before the end may have left it
      return code;
    }
    if (const std::string difference = difference_from_earlier_call(call, identity); !difference.empty()) {
      throw InputError(fmt::format("{}: this call cannot be resumed: {}; run without --resume to begin again", call.out,
                                   difference));
    }
    if (fs::exists(identity_file(call))) {
      print_kept_estimators(call);
    } else {
      std::printf("%s: nothing to resume; the run begins again\n", call.out.c_str());
      remove_recordings(call);
    }
  } else {
    remove_recordings(call);
  }
  remove_leftovers(call);
  made_folder(checkpoint_folder(call));
  write_text_file(identity_file(call),
                  nlohmann::json(identity).dump(1, ' ', false, nlohmann::json::error_handler_t::replace));
  return std::nullopt;
}

void finish_recordings(const RunCall& call) {
  std::error_code error;
  fs::rename(identity_file(call), finished_identity_file(call), error);
  if (error) {
    throw InputError(fmt::format("{}: cannot be written: {}; check its permissions",
                                 finished_identity_file(call).string(), error.message()));
  }
  remove_checkpoint(call);
}

}  // namespace lodestone
