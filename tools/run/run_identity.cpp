#include "tools/run/run_identity.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>

#include "frontends/configuration/options.h"
#include "frontends/configuration/text_file.h"
#include "frontends/logs/folder_files.h"
#include "frontends/maps/magnetic_map_file.h"

namespace lodestone {

namespace {

namespace fs = std::filesystem;

/// Lists every option with its value.
class Flattener {
 public:
  Flattener(std::string prefix, RunIdentity& parts) : prefix_(std::move(prefix)), parts_(parts) {}

  template <class Value>
  void field(std::string_view name, const Value& value, std::string_view) {
    parts_.emplace_back(prefix_ + std::string(name), options_detail::write_value(value));
  }

  template <class Options>
  void section(std::string_view name, Options& options) {
    Flattener inner(prefix_ + std::string(name) + ".", parts_);
    options.visit(inner);
  }

 private:
  std::string prefix_;
  RunIdentity& parts_;
};

std::string file_fingerprint(const fs::path& path) {
  using namespace std::chrono;
  const auto changed = file_clock::to_sys(fs::last_write_time(path)).time_since_epoch();
  const auto whole = floor<seconds>(changed);
  return fmt::format("of {} bytes, changed at {:%F %T}.{:09} UTC", fs::file_size(path), fmt::gmtime(whole.count()),
                     duration_cast<nanoseconds>(changed - whole).count());
}

/// Fingerprint of a file, or of all files in a folder.
std::string fingerprint(const std::string& path) {
  if (path.empty()) return "none";
  if (!fs::is_directory(path)) return file_fingerprint(path);
  const std::vector<fs::path> files = files_below(path);
  std::uint64_t hash = kHashOfNothing;
  for (const fs::path& file : files) hash = hash_of(file.string() + ": " + file_fingerprint(file) + "\n", hash);
  return fmt::format("{} files, {:016x}", files.size(), hash);
}

std::string content_fingerprint(const std::string& path) {
  return path.empty() ? "none" : fmt::format("{:016x}", hash_of(read_text_file(path)));
}

}  // namespace

std::uint64_t hash_of(std::string_view bytes, std::uint64_t hash) {
  for (const char byte : bytes) {
    hash ^= static_cast<unsigned char>(byte);
    hash *= 1099511628211ULL;
  }
  return hash;
}

RunIdentity identify(const RunCall& call, const RunOptions& options) {
  const std::string raster = call.magnetic.empty() ? "" : image_of_magnetic_map(call.magnetic);
  std::string estimators;
  for (const std::string& name : call.estimators) estimators += (estimators.empty() ? "" : ",") + name;
  RunIdentity parts{{"the program", std::string(LODESTONE_VERSION) + " " + content_fingerprint("/proc/self/exe")},
                    {"the log", fingerprint(call.log)},
                    {"--platform", content_fingerprint(call.platform)},
                    {"--cloud", fingerprint(call.cloud)},
                    {"--magnetic", content_fingerprint(call.magnetic)},
                    {"the image of --magnetic", fs::exists(raster) ? fingerprint(raster) : "none"},
                    {"--origin", fmt::format("{} {} {}", call.origin_m.x(), call.origin_m.y(), call.origin_m.z())},
                    {"--estimator", estimators},
                    {"--initial-pose", call.initial_pose},
                    {"--initial-pose-from", content_fingerprint(call.initial_pose_from)},
                    {"--max-range", call.max_range_m ? fmt::format("{}", *call.max_range_m) : "none"},
                    {"--truth", content_fingerprint(call.truth)},
                    {"--calibration-truth", content_fingerprint(call.calibration_truth)},
                    {"--bound", call.bound ? "yes" : "no"}};
  RunOptions visited = options;
  Flattener flattener("", parts);
  visited.visit(flattener);
  return parts;
}

std::string digest(const RunIdentity& identity) {
  std::uint64_t hash = kHashOfNothing;
  for (const auto& [name, value] : identity)
    hash = hash_of(fmt::format("{}:{}{}:{}", name.size(), name, value.size(), value), hash);
  return fmt::format("{:016x}", hash);
}

std::string difference_between(const RunIdentity& written, const RunIdentity& now) {
  for (std::size_t i = 0; i < std::max(written.size(), now.size()); ++i) {
    if (i >= written.size() || i >= now.size() || written[i].first != now[i].first) return "it has other options";
    if (written[i].second != now[i].second) {
      return fmt::format("{} was {} and is {} now", written[i].first, written[i].second, now[i].second);
    }
  }
  return {};
}

}  // namespace lodestone
