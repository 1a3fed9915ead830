#include "tools/experiments/experiment.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/nearest_name.h"
#include "tools/shipped_files.h"

namespace lodestone::reproduce {

const PublishedValue* Published::find(const std::string& row, const std::string& method) const {
  const auto found = std::find(methods.begin(), methods.end(), method);
  const auto values = rows.find(row);
  if (found == methods.end() || values == rows.end()) return nullptr;
  return &values->second[static_cast<std::size_t>(found - methods.begin())];
}

const Group* Experiment::find_group(const std::string& wanted) const {
  const auto found =
      std::find_if(groups.begin(), groups.end(), [&](const Group& group) { return group.name == wanted; });
  return found == groups.end() ? nullptr : &*found;
}

std::string row_name(const std::string& world, const std::string& sequence, std::optional<double> range_m,
                     std::optional<double> noise_ut, const std::string& scene) {
  std::string name = world + "-" + sequence;
  if (range_m) name += fmt::format("-{:g}m", *range_m);
  if (noise_ut) name += fmt::format("-{:g}ut", *noise_ut);
  return scene.empty() ? name : name + "-" + scene;
}

std::vector<Row> rows_of(const Group& group, const Drive& drive) {
  std::vector<std::optional<double>> ranges{std::nullopt};
  if (!group.ranges_m.empty()) ranges.assign(group.ranges_m.begin(), group.ranges_m.end());
  std::vector<std::string> scenes = drive.map_scenes;
  if (scenes.empty()) scenes.emplace_back();
  std::vector<Row> rows;
  for (const auto& range : ranges) {
    for (const std::string& scene : scenes) {
      rows.push_back({row_name(drive.world_name, drive.sequence, range, group.noise_ut, scene), range, scene});
    }
  }
  return rows;
}

std::size_t place_of(const std::string& text, std::vector<std::string>& texts) {
  const auto found = std::find(texts.begin(), texts.end(), text);
  const auto place = static_cast<std::size_t>(found - texts.begin());
  if (found == texts.end()) texts.push_back(text);
  return place;
}

std::vector<std::string> row_names(const Group& group) {
  std::vector<std::string> names;
  for (const Drive& drive : group.drives) {
    for (const Row& row : rows_of(group, drive)) names.push_back(row.name);
  }
  return names;
}

std::string find_experiment(const std::string& name) {
  return find_shipped("experiments", "experiment", name);
}

const std::vector<std::string>& figure_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all{"ate_m",
                                 "ate_se3_m",
                                 "max_error_m",
                                 "heading_rmse_deg",
                                 "nees_pose",
                                 "success",
                                 "real_time_factor",
                                 "wall_s",
                                 "peak_rss_mb",
                                 "degenerate_scans",
                                 "magnetic_rejected",
                                 "scans",
                                 "changed_cells",
                                 "changed_found",
                                 "unchanged_reported",
                                 "calibration.nees",
                                 "calibration.nees_lidar",
                                 "calibration.prior_nees",
                                 "calibration.parameters"};
    for (const std::string stage : {"causal", "smoothed", "batch"}) {
      for (const std::string figure :
           {"ate_m", "max_error_m", "largest_jump_m", "heading_rmse_deg", "nees_pose", "nees_rotation", "nees_position",
            "share_within_95", "share_within_100mm", "share_within_1m", "ate_over_bound"}) {
        all.push_back("stages." + stage + "." + figure);
      }
    }
    return all;
  }();
  return names;
}

const std::vector<std::string>& difference_names() {
  static const std::vector<std::string> names{"largest_ut", "mean_ut", "rms_ut", "quantile_95_ut",
                                              "area_above_threshold_m2"};
  return names;
}

}  // namespace lodestone::reproduce
