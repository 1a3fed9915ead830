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
#include "tools/run/fingerprint.h"

namespace lodestone {

namespace {

namespace fs = std::filesystem;

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

RunIdentity identify(const RunCall& call, const RunOptions& options) {
  const std::string raster = call.magnetic.empty() ? "" : image_of_magnetic_map(call.magnetic);
  RunIdentity parts{{"the program", std::string(LODESTONE_VERSION) + " " + content_fingerprint("/proc/self/exe")},
                    {"the log", fingerprint(call.log)},
                    {"--platform", content_fingerprint(call.platform)},
                    {"--cloud", fingerprint(call.cloud)},
                    {"--magnetic", content_fingerprint(call.magnetic)},
                    {"the image of --magnetic", fs::exists(raster) ? fingerprint(raster) : "none"},
                    {"--origin", fmt::format("{} {} {}", call.origin_m.x(), call.origin_m.y(), call.origin_m.z())},
                    {"--estimator", fmt::format("{}", fmt::join(call.estimators, ","))},
                    {"--initial-pose", call.initial_pose},
                    {"--initial-pose-from", content_fingerprint(call.initial_pose_from)},
                    {"--max-range", call.max_range_m ? fmt::format("{}", *call.max_range_m) : "none"},
                    {"--truth", content_fingerprint(call.truth)},
                    {"--calibration-truth", content_fingerprint(call.calibration_truth)},
                    {"--bound", call.bound ? "yes" : "no"}};
  for_each_option(options, [&parts](const std::string& path, const auto& value, std::string_view) {
    parts.emplace_back(path, options_detail::write_value(value));
  });
  return parts;
}

std::string digest(const RunIdentity& identity) {
  Fingerprint hash;
  for (const auto& [name, value] : identity) hash.add(name).add(value);
  return hash.to_string();
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
