#include "tools/report/estimator_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "core/angles.h"
#include "core/evaluation/errors.h"
#include "core/evaluation/statistics.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/report/page_data.h"

namespace lodestone {

namespace {

using Json = nlohmann::ordered_json;
constexpr double kUnseen = 1e6;  // metres; replaces an infinite sigma in charts
constexpr int kPositionDecimals = 3;

bool has_poses(const std::filesystem::path& path) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line.front() != '#') return true;
  }
  return false;
}

double position_sigma_m(const Matrix6& covariance) {
  return std::sqrt(covariance.bottomRightCorner<3, 3>().trace());
}

/// For a ground robot, the rotation about the body's z axis equals the heading, except for tilt.
double heading_sigma_deg(const Matrix6& covariance) {
  return degrees_per_radian * std::sqrt(covariance(2, 2));
}

void add_sigmas(Json& json, const EstimatorFiles& files, const TimeBuckets& buckets) {
  if (files.covariances.empty()) return;
  std::vector<Time> times;
  std::vector<double> position;
  std::vector<double> heading;
  for (const StampedCovariance& entry : files.covariances) {
    times.push_back(entry.time);
    position.push_back(position_sigma_m(entry.covariance));
    heading.push_back(heading_sigma_deg(entry.covariance));
  }
  json["sigma"] = rounded(buckets.summarize(times, position, Summary::largest), 4, kUnseen);
  json["sigma_heading"] = rounded(buckets.summarize(times, heading, Summary::largest), 4, kUnseen);
}

/// Quantiles of the error for shares 0, 1/400, … 1 of the scans; null beyond the share with an error.
Json distribution_json(const std::vector<double>& errors, std::size_t scans) {
  const ErrorDistribution distribution(errors);
  std::vector<double> quantiles;
  constexpr std::size_t kParts = 400;
  const std::size_t whole = std::max(scans, errors.size());
  for (std::size_t i = 0; i <= kParts; ++i) {
    const bool reached = !errors.empty() && i * whole <= kParts * errors.size();
    quantiles.push_back(
        reached ? distribution.quantile(static_cast<double>(i * whole) / static_cast<double>(kParts * errors.size()))
                : std::nan(""));
  }
  return rounded(quantiles, 4);
}

void add_errors(Json& json, const EstimatorFiles& files, const Trajectory& truth, const TimeBuckets& buckets) {
  const std::size_t scans = truth_at(files.diagnostics_times, truth).size();
  if (scans == 0) return;
  const PosePairs pairs = associate_interpolated(files.trajectory, truth);
  std::vector<Time> times;
  for (const PosePair& pair : pairs) times.push_back(pair.time);
  const std::vector<double> errors = translation_errors(pairs);
  std::vector<double> heading = heading_errors(pairs);
  for (double& value : heading) value = degrees_per_radian * std::abs(value);
  json["error"] = rounded(buckets.summarize(times, errors, Summary::largest), 4);
  json["heading"] = rounded(buckets.summarize(times, heading, Summary::largest), 4);
  json["distribution"] = distribution_json(errors, scans);
}

/// Removes field values without samples on the map; runs of older versions have zeros there.
std::vector<double> mask_unsampled(std::vector<double> values, const std::vector<double>& samples) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!(samples[i] > 0.0)) values[i] = std::nan("");
  }
  return values;
}

void add_diagnostics(Json& json, const EstimatorFiles& files, const TimeBuckets& buckets) {
  const auto add = [&](const char* name, const std::vector<double>& values, Summary summary) {
    json[name] = rounded(buckets.summarize(files.diagnostics_times, values, summary), 4, kUnseen);
  };
  const CsvTable& table = files.diagnostics;
  for (int i = 1; i <= 6; ++i) {
    add(fmt::format("direction_{}", i).c_str(), table.numbers(fmt::format("direction_{}_sigma_m", i)),
        Summary::largest);
  }
  add("degenerate", table.numbers("degenerate_directions"), Summary::largest);
  const std::vector<double> samples = table.numbers("magnetic_samples");
  add("weight", mask_unsampled(table.numbers("magnetic_weight"), samples), Summary::smallest);
  add("shrink", mask_unsampled(table.numbers("magnetic_shrink"), samples), Summary::smallest);
  add("residual", mask_unsampled(table.numbers("magnetic_residual_ut"), samples), Summary::largest);
}

}  // namespace

EstimatorFiles read_estimator(const std::filesystem::path& folder) {
  EstimatorFiles files{folder.filename().string(), {}, CsvTable(folder / "diagnostics.csv"), {}, {}, folder};
  files.diagnostics_times = files.diagnostics.stamps("t_s");
  const std::filesystem::path trajectory = folder / "trajectory.tum";
  if (!has_poses(trajectory)) return files;
  files.trajectory = read_tum(trajectory.string());
  const std::filesystem::path covariances = folder / "covariance.csv";
  if (std::filesystem::exists(covariances)) files.covariances = read_covariances(covariances);
  return files;
}

Json position_series(const Trajectory& trajectory, const TimeBuckets& buckets) {
  std::vector<Time> times;
  std::array<std::vector<double>, 3> positions;
  for (const StampedPose& pose : trajectory) {
    times.push_back(pose.time);
    for (int axis = 0; axis < 3; ++axis) positions[axis].push_back(pose.pose.position(axis));
  }
  Json json;
  constexpr std::array<const char*, 3> kNames{"x", "y", "z"};
  for (int axis = 0; axis < 3; ++axis) {
    json[kNames[axis]] = with_decimals(buckets.summarize(times, positions[axis], Summary::last), kPositionDecimals);
  }
  return json;
}

Json estimator_series(const EstimatorFiles& files, const Trajectory* truth, const TimeBuckets& buckets) {
  Json json = position_series(files.trajectory, buckets);
  add_sigmas(json, files, buckets);
  if (truth != nullptr) add_errors(json, files, *truth, buckets);
  add_diagnostics(json, files, buckets);
  return json;
}

Json health_json(const EstimatorFiles& files, Time begin) {
  const CsvTable& table = files.diagnostics;
  if (!table.has("health") || !table.has("health_reason")) return nullptr;
  const std::vector<std::string> health = table.texts("health");
  const std::vector<std::string> reasons = table.texts("health_reason");
  const std::vector<double> degenerate = table.numbers("degenerate_directions");
  const std::vector<double> magnetic = table.numbers("magnetic_samples");
  const std::vector<double> wheels = table.numbers("wheel_weight");
  std::set<Time> good;
  std::size_t unobserved = 0;
  Json stretches = Json::array();
  for (std::size_t i = 0; i < health.size(); ++i) {
    if (health[i] == "good") {
      good.insert(files.diagnostics_times[i]);
      if (degenerate[i] > 0.0 && !(magnetic[i] > 0.0) && !(wheels[i] > 0.0)) ++unobserved;
      continue;
    }
    const double at_s = to_seconds(files.diagnostics_times[i] - begin);
    if (i == 0 || health[i] != health[i - 1]) {
      stretches.push_back({{"health", health[i]}, {"reasons", Json::array()}, {"from_s", at_s}});
    }
    Json& stretch = stretches.back();
    stretch["to_s"] = at_s;
    Json& known = stretch["reasons"];
    if (std::find(known.begin(), known.end(), reasons[i]) == known.end()) known.push_back(reasons[i]);
  }
  double sigma_m = 0.0;
  double heading_deg = 0.0;
  for (const StampedCovariance& entry : files.covariances) {
    if (!good.contains(entry.time)) continue;
    sigma_m = std::max(sigma_m, position_sigma_m(entry.covariance));
    heading_deg = std::max(heading_deg, heading_sigma_deg(entry.covariance));
  }
  return {{"scans", health.size()},
          {"good", good.size()},
          {"unobserved", unobserved},
          {"largest_sigma_m", sigma_m},
          {"largest_heading_sigma_deg", heading_deg},
          {"stretches", stretches}};
}

Json table_json(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) return nullptr;
  const CsvTable table(path);
  Json json;
  json["columns"] = table.columns();
  json["rows"] = Json::array();
  for (std::size_t row = 0; row < table.rows(); ++row) json["rows"].push_back(Json::array());
  for (const std::string& name : table.columns()) {
    const std::vector<std::string> column = table.texts(name);
    for (std::size_t row = 0; row < table.rows(); ++row) json["rows"][row].push_back(column[row]);
  }
  return json;
}

}  // namespace lodestone
