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

#include "core/geometry/nav_state.h"
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

inline std::filesystem::path imu_file() {
  return imu_folder() / "euroc_V1_01_imu.csv";
}

inline std::filesystem::path truth_file() {
  return imu_folder() / "euroc_V1_01_truth.csv";
}

/// Why a test is skipped; empty if the files are there.
inline std::string absent() {
  if (std::filesystem::exists(imu_file()) && std::filesystem::exists(truth_file())) return {};
  return imu_file().string() + " or its truth is absent; set LODESTONE_DATA to the real data";
}

inline std::vector<ImuSample> load_imu() {
  std::vector<ImuSample> samples;
  for (const auto& row : load<6>(imu_file())) samples.push_back({row.time, row.vector(0), row.vector(3)});
  return samples;
}

struct Truth {
  Time time = 0;
  NavState state;
};

inline std::vector<Truth> load_truth() {
  std::vector<Truth> truth;
  for (const auto& row : load<16>(truth_file())) {
    Truth entry{row.time, {}};
    entry.state.T_map_imu.position = row.vector(0);
    entry.state.T_map_imu.rotation =
        Quaternion(row.values[3], row.values[4], row.values[5], row.values[6]).normalized();
    entry.state.velocity = row.vector(7);
    entry.state.gyroscope_bias = row.vector(10);
    entry.state.accelerometer_bias = row.vector(13);
    entry.state.gravity = Vector3(0.0, 0.0, -9.81);
    truth.push_back(entry);
  }
  return truth;
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
