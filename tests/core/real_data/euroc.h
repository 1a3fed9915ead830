#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/measurements.h"

/// The files of EuRoC's V1_01 in the real data.
namespace lodestone::euroc {

inline std::filesystem::path imu_folder() {
  const char* folder = std::getenv("LODESTONE_DATA");
  const std::filesystem::path source = LODESTONE_SOURCE_DIR;
  return (folder != nullptr ? std::filesystem::path(folder) : source.parent_path() / "shared/data") / "imu";
}

/// A row of a csv: an integer stamp in nanoseconds, which a double would round, and `columns` numbers.
template <std::size_t columns>
struct Row {
  Time time = 0;
  std::array<double, columns> values{};

  Vector3 vector(std::size_t column) const { return Vector3(values.data() + column); }
};

template <std::size_t columns>
std::vector<Row<columns>> load(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<Row<columns>> rows;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line.front() == '#') continue;
    Row<columns> row;
    const char* const end = line.data() + line.size();
    const char* place = std::from_chars(line.data(), end, row.time).ptr;
    for (double& value : row.values) {
      if (place == end) throw std::runtime_error(path.string() + ": a row is short: " + line);
      place = std::from_chars(place + 1, end, value).ptr;
    }
    rows.push_back(row);
  }
  return rows;
}

inline ImuSample interpolate(const ImuSample& before, const ImuSample& after, Time time) {
  const double share = to_seconds(time - before.time) / to_seconds(after.time - before.time);
  return {time, before.angular_velocity + share * (after.angular_velocity - before.angular_velocity),
          before.linear_acceleration + share * (after.linear_acceleration - before.linear_acceleration)};
}

/// The samples over [begin, end], interpolated at both; empty if the log does not cover the interval or has a gap.
inline std::vector<ImuSample> samples_between(const std::vector<ImuSample>& log, Time begin, Time end) {
  const auto earlier = [](Time time, const ImuSample& sample) { return time < sample.time; };
  const auto first = std::upper_bound(log.begin(), log.end(), begin, earlier);
  const auto last = std::lower_bound(log.begin(), log.end(), end,
                                     [](const ImuSample& sample, Time time) { return sample.time < time; });
  if (first == log.begin() || first == log.end() || last == log.end()) return {};
  std::vector<ImuSample> result{interpolate(*(first - 1), *first, begin)};
  result.insert(result.end(), first, last);
  result.push_back(last == log.begin() ? *last : interpolate(*(last - 1), *last, end));
  for (std::size_t i = 1; i < result.size(); ++i) {
    if (result[i].time - result[i - 1].time > 20'000'000) return {};
  }
  return result;
}

}  // namespace lodestone::euroc
