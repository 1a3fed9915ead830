#include "tools/run/stale_results.h"

#include <sys/stat.h>

#include <system_error>

namespace lodestone {

namespace {

namespace fs = std::filesystem;

constexpr const char* kEstimatorFiles[] = {
    "trajectory.tum",  "georeferenced.tum", "causal.tum",          "smoothed.tum",    "covariance.csv",
    "diagnostics.csv", "errors.csv",        "field_residuals.csv", "field_cells.csv", "stale_places.csv",
    "summary.json",    "calibration.csv",   "platform.yaml"};
constexpr const char* kPictures[] = {"map", "error", "distribution", "stale_map"};
constexpr const char* kEndings[] = {".png", ".pdf", ".svg"};

}  // namespace

std::vector<fs::path> replaceable_files(const std::vector<std::string>& estimators) {
  std::vector<fs::path> files{"bound.csv"};
  std::vector<std::string> pictures(std::begin(kPictures), std::end(kPictures));
  for (const std::string& name : estimators) {
    for (const char* file : kEstimatorFiles) files.push_back(fs::path(name) / file);
    pictures.push_back("stale_map_" + name);
  }
  for (const std::string& picture : pictures) {
    for (const char* ending : kEndings) files.push_back(fs::path("pictures") / (picture + ending));
  }
  return files;
}

StaleResults::StaleResults(fs::path folder, const std::vector<std::string>& estimators) : folder_(std::move(folder)) {
  for (const fs::path& file : replaceable_files(estimators)) note(folder_ / file);
  for (const std::string& name : estimators) estimator_folders_.push_back(folder_ / name);
}

void StaleResults::keep_calibration(const fs::path& folder) {
  files_.erase(folder / "calibration.csv");
  files_.erase(folder / "platform.yaml");
}

bool StaleResults::mark_of(const fs::path& file, Mark& mark) {
  struct stat status {};
  if (lstat(file.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return false;
  mark = {status.st_ino, std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec};
  return true;
}

void StaleResults::note(const fs::path& file) {
  Mark mark;
  if (mark_of(file, mark)) files_[file] = mark;
}

void StaleResults::remove() const {
  std::error_code ignored;
  for (const auto& [file, before] : files_) {
    Mark now;
    if (mark_of(file, now) && now == before) fs::remove(file, ignored);
  }
  for (const fs::path& folder : estimator_folders_) {
    if (fs::is_directory(folder, ignored) && fs::is_empty(folder, ignored)) fs::remove(folder, ignored);
  }
}

}  // namespace lodestone
