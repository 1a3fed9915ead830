#include "frontends/configuration/magnetometer_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/number_text.h"

namespace lodestone {

namespace {

constexpr const char* kKey = "magnetic.magnetometers";
constexpr double kSame_m = 1e-9;  // smaller differences of distances are rounding errors: the platform's order decides

std::string origin(const Platform& platform) {
  return platform.file.empty() ? "the platform" : platform.file;
}

std::vector<bool> spread_out(int count, const Platform& platform) {
  const auto& magnetometers = platform.suite.magnetometers;
  if (count < 1 || static_cast<std::size_t>(count) > magnetometers.size()) {
    throw InputError(fmt::format("{}: expected 1 to {}, the magnetometers of {}, found {}", kKey, magnetometers.size(),
                                 origin(platform), count));
  }
  Vector3 center = Vector3::Zero();
  for (const MagnetometerModel& one : magnetometers)
    center += one.T_imu_mag.position / static_cast<double>(magnetometers.size());
  std::vector<bool> taken(magnetometers.size(), false);
  std::vector<double> distance;  // from the centre at first, then from the nearest chosen one
  for (const MagnetometerModel& one : magnetometers) distance.push_back((one.T_imu_mag.position - center).norm());
  for (int step = 0; step < count; ++step) {
    std::size_t next = magnetometers.size();
    for (std::size_t i = 0; i < magnetometers.size(); ++i) {
      if (!taken[i] && (next == magnetometers.size() || distance[i] > distance[next] + kSame_m)) next = i;
    }
    taken[next] = true;
    for (std::size_t i = 0; i < magnetometers.size(); ++i) {
      const double apart = (magnetometers[i].T_imu_mag.position - magnetometers[next].T_imu_mag.position).norm();
      distance[i] = step == 0 ? apart : std::min(distance[i], apart);
    }
  }
  return taken;
}

std::vector<bool> named(const std::string& choice, const Platform& platform) {
  std::vector<std::string> known;
  for (const MagnetometerModel& one : platform.suite.magnetometers) known.push_back(one.name);
  std::vector<bool> taken(known.size(), false);
  std::istringstream names(choice);
  for (std::string name; std::getline(names, name, ',');) {
    const auto first = name.find_first_not_of(' ');
    name = first == std::string::npos ? "" : name.substr(first, name.find_last_not_of(' ') - first + 1);
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end()) {
      throw InputError(fmt::format("{}: {} has no magnetometer '{}'{} (known: {}; also: all, or a number)", kKey,
                                   origin(platform), name, suggestion(name, known), join_names(known)));
    }
    const auto index = static_cast<std::size_t>(found - known.begin());
    if (taken[index]) throw InputError(fmt::format("{}: '{}' is given twice", kKey, name));
    taken[index] = true;
  }
  return taken;
}

}  // namespace

void choose_magnetometers(const std::string& choice, Platform& platform) {
  if (choice == "all") return;
  int count = -1;
  const bool number = parse_number(choice, count) && count >= 0;
  if (choice.empty()) throw InputError(fmt::format("{}: expected all, a number, or names with commas", kKey));
  const std::vector<bool> taken = number ? spread_out(count, platform) : named(choice, platform);
  std::vector<MagnetometerModel> models;
  std::vector<MagnetometerMessageLayout> layouts;
  for (std::size_t i = 0; i < taken.size(); ++i) {
    if (!taken[i]) continue;
    models.push_back(platform.suite.magnetometers[i]);
    layouts.push_back(platform.magnetometers[i]);
  }
  platform.suite.magnetometers = std::move(models);
  platform.magnetometers = std::move(layouts);
}

}  // namespace lodestone
