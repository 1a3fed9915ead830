#include "tools/check/mounting_checks.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/nearest_name.h"

namespace lodestone {
namespace {

constexpr double same_place_m = 1e-3;  // two chips on one board are farther apart

bool is_guess(const Platform& platform, std::size_t magnetometer) {
  const std::string key = fmt::format("magnetometers[{}].T_imu_mag", magnetometer);
  return std::find(platform.guesses.begin(), platform.guesses.end(), key) != platform.guesses.end();
}

}  // namespace

Findings check_mountings(const Platform& platform, SensorChoice needed) {
  Findings findings;
  if (!platform.guesses.empty()) {
    findings.push_back({Severity::warning, "platform.guesses",
                        fmt::format("{}: nobody measured {}: a run may be off by the error of these values, and no "
                                    "check finds it",
                                    platform.file_name(), join_names(platform.guesses)),
                        "measure and correct them, then remove them from guesses"});
  }
  const std::vector<MagnetometerModel>& magnetometers = platform.suite.magnetometers;
  for (std::size_t i = 0; needed.magnetometers && i < magnetometers.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Vector3 apart = magnetometers[i].T_imu_mag.position - magnetometers[j].T_imu_mag.position;
      if (apart.norm() >= same_place_m || is_guess(platform, i) || is_guess(platform, j)) continue;
      findings.push_back({Severity::error, "magnetometer.same_place",
                          fmt::format("{} and {} have the same position in {}", magnetometers[j].name,
                                      magnetometers[i].name, platform.file_name()),
                          fmt::format("measure magnetometers[{}].T_imu_mag, or remove a magnetometer that is listed "
                                      "twice",
                                      i),
                          std::nullopt, i});
      return findings;  // one line for an array without any position
    }
  }
  return findings;
}

}  // namespace lodestone
