#include "tools/experiments/step_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "tools/writers/output_folder.h"

namespace lodestone::reproduce {

namespace fs = std::filesystem;

namespace {

constexpr const char* kStamp = "step.json";

/// Empty if the file is missing or broken.
nlohmann::json read_stamp(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::exists(folder / kStamp, ignored)) return nlohmann::json::object();
  const auto json = nlohmann::json::parse(read_text_file((folder / kStamp).string()), nullptr, false);
  return json.is_object() ? json : nlohmann::json::object();
}

void remove_folder(const fs::path& folder) {
  std::error_code error;
  fs::remove(folder / kStamp, error);
  fs::remove_all(folder, error);
  if (error) throw InputError(fmt::format("{}: cannot be removed: {}", folder.string(), error.message()));
}

}  // namespace

StepStore::StepStore(fs::path root, bool any_build)
    : root_(fs::absolute(root).lexically_normal()), any_build_(any_build) {
  made_folder(root_);
  made_folder(root_ / "logs");
  // Children inherit the lock: O_CLOEXEC is not set. Low descriptors have a meaning of their own for a child.
  constexpr int kFirst = 10;
  const int file = open((root_ / ".lock").c_str(), O_RDWR | O_CREAT, 0644);
  lock_ = fcntl(file, F_DUPFD, kFirst);
  close(file);
  if (lock_ < 0) throw InputError(fmt::format("{}: cannot be written; choose another --out", root_.string()));
  if (flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    close(lock_);
    throw InputError(fmt::format(
        "{}: another call, or a process started by it, uses this folder; wait for it or choose another --out",
        root_.string()));
  }
}

StepStore::~StepStore() {
  close(lock_);
}

fs::path StepStore::log_of(const Step& step) const {
  std::string name = step.name;
  std::replace(name.begin(), name.end(), '/', '_');
  return root_ / "logs" / (name + ".log");
}

bool StepStore::is_done(const Step& step) const {
  const nlohmann::json stamp = read_stamp(root_ / step.folder);
  return stamp.value(any_build_ ? "recipe" : "fingerprint", "") == (any_build_ ? step.recipe : step.fingerprint);
}

std::string StepStore::stamp_of(const Step& step) {
  nlohmann::ordered_json json;
  json["step"] = step.name;
  json["fingerprint"] = step.fingerprint;
  json["recipe"] = step.recipe;
  json["keep"] = step.kept();
  return json.dump(2) + "\n";
}

void StepStore::remove_elapsed(const Plan& plan) const {
  for (const Step& step : plan.steps) {
    if (!step.kept()) remove_folder(root_ / step.folder);
  }
}

void StepStore::remove_strangers(const Plan& plan) const {
  std::set<fs::path> known;
  for (const Step& step : plan.steps) known.insert(root_ / step.folder);
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(root_ / "work", ignored)) {
    if (known.count(entry.path()) == 0 && !read_stamp(entry.path()).value("keep", false)) remove_folder(entry.path());
  }
}

}  // namespace lodestone::reproduce
