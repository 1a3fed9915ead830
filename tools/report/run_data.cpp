#include "tools/report/run_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/warnings.h"
#include "frontends/configuration/configuration_node.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/point_cloud_file.h"
#include "tools/markup.h"
#include "tools/plotting/method_style.h"
#include "tools/progress.h"
#include "tools/report/cloud_thinning.h"
#include "tools/report/estimator_data.h"
#include "tools/report/field_raster.h"
#include "tools/report/json_file.h"
#include "tools/report/page_data.h"

namespace lodestone {

namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

/// The scan ends of all estimators. They share a log, but one may have ended early.
std::vector<Time> all_stamps(const std::vector<EstimatorFiles>& estimators) {
  std::vector<Time> stamps;
  for (const EstimatorFiles& files : estimators) {
    stamps.insert(stamps.end(), files.diagnostics_times.begin(), files.diagnostics_times.end());
    for (const StampedPose& pose : files.trajectory) stamps.push_back(pose.time);
  }
  std::sort(stamps.begin(), stamps.end());
  stamps.erase(std::unique(stamps.begin(), stamps.end()), stamps.end());
  return stamps;
}

/// The estimator's limit for degenerate directions, metres, from the configuration.
Json degeneracy_limit(const ConfigurationNode& configuration, const std::string& estimator) {
  const ConfigurationNode* own = configuration.find(estimator);
  for (const ConfigurationNode* scope : {own, &configuration}) {
    const ConfigurationNode* group = scope != nullptr ? scope->find("degeneracy") : nullptr;
    const ConfigurationNode* value = group != nullptr ? group->find("max_sigma_m") : nullptr;
    if (value != nullptr) return value->as_double();
  }
  return nullptr;
}

Json field_json(const fs::path& path, std::size_t limit) {
  const PlanRaster raster = coarsened(read_raster(path), limit);
  const RasterImage image = to_image(raster);
  Json json;
  json["image"] = data_uri("image/png", image.png);
  json["columns"] = raster.values.cols;
  json["rows"] = raster.values.rows;
  json["resolution_m"] = raster.resolution_m;
  json["x_m"] = raster.x_m;
  json["y_m"] = raster.y_m;
  json["height_m"] = raster.height_m;
  json["low_ut"] = image.low_ut;
  json["high_ut"] = image.high_ut;
  return json;
}

/// Positions as 16-bit shares of their box, three per point: a millimetre in 65 m. `spacing_m`: of the stored cloud.
Json cloud_json(const fs::path& path, double spacing_m, std::size_t limit) {
  WarningLog ignored;  // NaN points were already dropped for the overview
  const std::vector<Eigen::Vector3f> cloud = read_point_cloud(path.string(), ignored);
  CloudThinning thinning({-1e9, 1e9, -1e9, 1e9}, limit, spacing_m);
  thinning.add(cloud);
  const std::vector<Eigen::Vector3f>& points = cloud.size() <= limit ? cloud : thinning.points();
  Eigen::Vector3f low = points.front();
  Eigen::Vector3f high = points.front();
  for (const Eigen::Vector3f& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Eigen::Vector3f step = ((high - low) / 65535.0F).cwiseMax(1e-6F);
  std::string bytes;
  bytes.reserve(points.size() * 6);
  for (const Eigen::Vector3f& point : points) {
    for (int axis = 0; axis < 3; ++axis) {
      const auto share = static_cast<std::uint16_t>(std::lround((point(axis) - low(axis)) / step(axis)));
      bytes += static_cast<char>(share & 0xffU);  // little-endian on every machine
      bytes += static_cast<char>(share >> 8);
    }
  }
  Json json;
  json["count"] = points.size();
  json["spacing_m"] = cloud.size() <= limit ? spacing_m : thinning.voxel_m();
  json["low_m"] = {low.x(), low.y(), low.z()};
  json["step_m"] = {step.x(), step.y(), step.z()};
  json["positions"] = base64(bytes);
  return json;
}

/// A value of the call as text: a list becomes one text; nothing if empty.
Json display_value(const Json& list) {
  if (list.is_boolean()) return list.get<bool>() ? "yes" : "no";
  if (!list.is_array()) return list;
  std::string text;
  for (const Json& value : list)
    text += (text.empty() ? "" : ", ") + (value.is_string() ? value.get<std::string>() : value.dump());
  return text.empty() ? Json(nullptr) : Json(text);
}

struct OverviewNotes {
  Time begin = 0;  ///< of the log
  double cloud_voxel_m = 0.1;
};

/// `first_scan`: the begin of the log if there are no notes.
OverviewNotes overview_notes(const fs::path& overview, Time first_scan) {
  OverviewNotes notes{first_scan};
  const fs::path path = overview / "overview.json";
  if (!fs::exists(path)) return notes;
  const Json json = read_json(path);
  values_of(path, [&]() {
    parse_stamp(json.value("log_begin_s", ""), notes.begin);
    notes.cloud_voxel_m = json.value("cloud_voxel_m", notes.cloud_voxel_m);
    return Json();
  });
  return notes;
}

Json run_json(const fs::path& folder, const DetailLimits& limits, const Json& summary) {
  std::vector<EstimatorFiles> estimators;
  for (const auto& [name, figures] : summary["estimators"].items()) {
    estimators.push_back(read_estimator(folder / name));
    throw_if_interrupted();
  }
  const TimeBuckets buckets(all_stamps(estimators), limits.points_per_series);
  if (buckets.size() == 0)
    throw InputError(
        fmt::format("{}: no estimator has a scan; use the folder of a run with estimates", folder.string()));

  const fs::path overview = folder / "overview";
  const OverviewNotes notes = overview_notes(overview, buckets.times().front());
  Json json;
  json["inputs"] = Json::object();
  for (const auto& [name, value] : summary.items()) {
    if (name != "estimators" && name != "status" && name != "call") json["inputs"][name] = value;
  }
  if (summary.contains("call") && summary["call"].is_object()) {
    for (const auto& [name, value] : summary["call"].items()) json["inputs"][name] = display_value(value);
  }
  json["status"] = summary.value("status", "done");
  json["begin_s"] = format_stamp(notes.begin);
  json["scans_a_point"] = buckets.width();
  std::vector<double> seconds;
  for (const Time time : buckets.times()) seconds.push_back(to_seconds(time - notes.begin));
  json["t"] = with_decimals(seconds, 3);

  Trajectory truth;
  if (fs::exists(overview / "truth.tum")) {
    truth = read_tum((overview / "truth.tum").string());
    json["truth"] = position_series(truth, buckets);
  }
  const std::string configuration =
      fs::exists(folder / "config.yaml") ? read_text_file((folder / "config.yaml").string()) : std::string();
  const ConfigurationNode options = ConfigurationNode::parse(configuration, (folder / "config.yaml").string());
  json["estimators"] = Json::array();
  std::vector<std::string> names;
  for (const EstimatorFiles& files : estimators) names.push_back(files.name);
  const std::vector<std::size_t> colors = figures::method_colors(names);
  for (const EstimatorFiles& files : estimators) {
    Json entry;
    entry["name"] = files.name;
    entry["color"] = colors[json["estimators"].size()];
    entry["summary"] = summary["estimators"][files.name];
    entry["status"] = entry["summary"].value("status", json["status"]);
    entry["degeneracy_limit_m"] = degeneracy_limit(options, files.name);
    entry["series"] = estimator_series(files, truth.empty() ? nullptr : &truth, buckets);
    entry["health"] = health_json(files, notes.begin);
    entry["stale_places"] = table_json(files.folder / "stale_places.csv");
    entry["calibration"] = table_json(files.folder / "calibration.csv");
    json["estimators"].push_back(std::move(entry));
  }
  if (fs::exists(overview / "field.png")) json["field"] = field_json(overview / "field.png", limits.field_values);
  if (fs::exists(overview / "cloud.pcd")) {
    json["cloud"] = cloud_json(overview / "cloud.pcd", notes.cloud_voxel_m, limits.cloud_points);
  }
  json["configuration"] = configuration;
  return json;
}

}  // namespace

bool is_run_folder(const fs::path& folder) {
  return fs::exists(folder / "summary.json");
}

Json read_run(const fs::path& folder, const DetailLimits& limits) {
  const fs::path path = folder / "summary.json";
  const Json summary = read_json(path);
  if (!summary.is_object() || !summary.contains("estimators") || !summary["estimators"].is_object()) {
    throw InputError(fmt::format(
        "{}: expected the summary of a run with 'estimators'; use the --out folder of `lodestone run`", path.string()));
  }
  return values_of(path, [&]() { return run_json(folder, limits, summary); });
}

}  // namespace lodestone
