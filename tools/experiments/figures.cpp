// Collects the data of figures from the folders of runs; tools/plotting draws the figures.
#include "tools/experiments/figures.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/error.h"
#include "core/middle_value.h"
#include "frontends/maps/magnetic_map_file.h"
#include "tools/plotting/error_distribution.h"
#include "tools/plotting/error_grid.h"
#include "tools/plotting/plan_figures.h"
#include "tools/plotting/run_folder.h"
#include "tools/simulate/world_queries.h"
#include "tools/writers/output_folder.h"

namespace lodestone::reproduce {

namespace fs = std::filesystem;

namespace {

/// The finished runs of a figure, and their files.
class Shown {
 public:
  Shown(const FigureChoice& figure, const Results& results, fs::path root)
      : figure_(figure), results_(results), root_(std::move(root)) {
    for (const std::size_t i : shown_runs(figure, results.runs())) {
      if (results.is_done(i)) indices_.push_back(i);
    }
  }

  const std::vector<std::size_t>& indices() const { return indices_; }
  const Run& run(std::size_t i) const { return results_.runs()[i]; }
  fs::path file(const std::string& name) const { return root_ / name; }

  /// Folders of the estimators that are shown for a run.
  std::vector<fs::path> folders(std::size_t i) const {
    std::vector<fs::path> folders;
    for (const std::string& name : run(i).estimators) {
      const auto& wanted = figure_.estimators;
      if (wanted.empty() || std::find(wanted.begin(), wanted.end(), name) != wanted.end()) {
        folders.push_back(root_ / run(i).folder / name);
      }
    }
    return folders;
  }

  std::size_t scans(std::size_t i, const std::string& estimator) const {
    return static_cast<std::size_t>(value_of(results_.find(i, estimator), "scans").value_or(0.0));
  }

 private:
  const FigureChoice& figure_;
  const Results& results_;
  fs::path root_;
  std::vector<std::size_t> indices_;
};

std::string range_heading(const Run& run) {
  return run.range_m ? fmt::format("LiDAR range {:g} m", *run.range_m) : std::string("LiDAR range of the platform");
}

/// Heading of a grid's row: the drive, if there are several, and the field noise.
std::string noise_heading(const Run& run, bool several_drives) {
  const double noise = run.noise_ut ? *run.noise_ut : simulation::magnetometer_noise_ut(run.world);
  const std::string drive =
      fmt::format("{} {}{}{}, ", run.world_name, run.sequence, run.scene.empty() ? "" : " ", run.scene);
  return fmt::format("{}noise {:g} µT", several_drives ? drive : "", noise);
}

bool draw_grid(const Shown& shown, const fs::path& path) {
  std::set<std::string> drives;
  for (const std::size_t i : shown.indices())
    drives.insert(shown.run(i).world + shown.run(i).sequence + shown.run(i).scene);
  figures::ErrorGrid grid;
  std::vector<std::pair<std::size_t, std::size_t>> places;
  for (const std::size_t i : shown.indices()) {
    places.emplace_back(place_of(noise_heading(shown.run(i), drives.size() > 1), grid.rows),
                        place_of(range_heading(shown.run(i)), grid.columns));
  }
  grid.panels.resize(grid.rows.size() * grid.columns.size());
  for (std::size_t k = 0; k < places.size(); ++k) {
    figures::ErrorPanel& panel = grid.panels[places[k].first * grid.columns.size() + places[k].second];
    const std::vector<fs::path> folders = shown.folders(shown.indices()[k]);
    if (folders.empty() || !panel.series.empty()) continue;
    const Time begin = figures::begin_of(folders.front());
    for (const fs::path& folder : folders) panel.series.push_back(figures::read_error_series(folder, begin));
    panel.degenerate = figures::read_degenerate_stretches(folders.front(), begin);
  }
  figures::draw_error_grid(path, grid);
  return true;
}

bool draw_distributions(const Shown& shown, const fs::path& path) {
  std::vector<figures::DistributionPanel> panels;
  std::set<std::string> grades;
  for (const std::size_t i : shown.indices()) grades.insert(shown.run(i).grade);
  std::vector<std::string> headings;
  for (const std::size_t i : shown.indices()) {
    const std::size_t place = place_of(grades.size() > 1 ? shown.run(i).grade : shown.run(i).world_name, headings);
    if (place == panels.size()) panels.push_back({headings.back(), {}});
    std::vector<figures::MethodErrors>& methods = panels[place].methods;
    std::size_t most = 0;  // number of scans of the method that got furthest: the expected number for all methods
    for (const fs::path& folder : shown.folders(i)) most = std::max(most, shown.scans(i, folder.filename()));
    for (const fs::path& folder : shown.folders(i)) {
      const figures::ErrorSeries series = figures::read_error_series(folder, figures::begin_of(folder));
      auto method =
          std::find_if(methods.begin(), methods.end(), [&](const auto& one) { return one.method == series.method; });
      if (method == methods.end()) method = methods.insert(methods.end(), {series.method, {}, 0});
      method->error_m.insert(method->error_m.end(), series.error_m.begin(), series.error_m.end());
      method->expected += std::max(most, series.error_m.size());
    }
  }
  figures::draw_error_distributions(path, panels);
  return true;
}

PlanRaster difference_of(const Shown& shown, const Run& run) {
  const MagneticMap own = read_magnetic_map(shown.file(run.own_field).string());
  const MagneticMap other = read_magnetic_map(shown.file(run.field).string());
  return difference_raster(own, other, middle_value(other.grid().heights_m));
}

bool draw_differences(const Shown& shown, const fs::path& path) {
  std::vector<figures::DifferencePanel> panels;
  for (const std::size_t i : shown.indices()) {
    const Run& run = shown.run(i);
    const std::vector<fs::path> folders = shown.folders(i);
    panels.push_back({run.scene.empty() ? run.row : run.scene, difference_of(shown, run),
                      folders.empty() ? std::vector<Vector3>{} : figures::read_track(folders.front())});
  }
  figures::draw_map_differences(path, panels);
  return true;
}

/// Draws the first finished run: one trajectory per estimator.
bool draw_residuals(const Shown& shown, const fs::path& path) {
  const std::size_t i = shown.indices().front();
  std::vector<figures::ResidualPanel> panels;
  for (const fs::path& folder : shown.folders(i)) {
    if (fs::exists(folder / "field_residuals.csv")) {
      panels.push_back({folder.filename().string(), figures::read_residuals(folder, figures::begin_of(folder))});
    }
  }
  if (panels.empty()) return false;
  figures::draw_residuals_over_difference(path, difference_of(shown, shown.run(i)), panels);
  return true;
}

/// Both rasters on the grid of the first, which is enlarged. Values of the first have priority.
PlanRaster merged(const PlanRaster& first, const PlanRaster& second) {
  const double step = first.resolution_m;
  const int left = static_cast<int>(std::ceil(std::max(0.0, first.x_m - second.x_m) / step));
  const int below = static_cast<int>(std::ceil(std::max(0.0, first.y_m - second.y_m) / step));
  PlanRaster all = first;
  all.x_m = first.x_m - left * step;
  all.y_m = first.y_m - below * step;
  const int columns =
      1 + static_cast<int>(std::ceil((std::max(first.x_high(), second.x_high()) - all.x_m) / step - 1e-9));
  const int rows = 1 + static_cast<int>(std::ceil((std::max(first.y_high(), second.y_high()) - all.y_m) / step - 1e-9));
  all.values = values_at(second, {all.x_m, all.y_m, step, step, {columns, rows}});
  first.values.copyTo(all.values(cv::Rect({left, below}, first.values.size())), ~without_value(first.values));
  return all;
}

bool draw_overview(const Shown& shown, const fs::path& path) {
  std::vector<figures::WorldPanel> panels;
  std::vector<std::string> worlds;
  std::set<std::string> maps;
  std::set<std::string> drives;
  for (const std::size_t i : shown.indices()) {
    const Run& run = shown.run(i);
    const std::size_t place = place_of(run.world_name, worlds);
    if (maps.insert(run.field).second) {
      const MagneticMap map = read_magnetic_map(shown.file(run.field).string());
      const PlanRaster strength = strength_raster(map, middle_value(map.grid().heights_m));
      if (place == panels.size()) {
        panels.push_back({run.world_name, strength, {}});
      } else {
        panels[place].strength_ut = merged(panels[place].strength_ut, strength);
      }
    }
    const std::vector<fs::path> folders = shown.folders(i);
    if (!folders.empty() && drives.insert(run.world + "\n" + run.sequence).second) {
      panels[place].tracks.push_back({run.sequence, figures::read_track(folders.front())});
    }
  }
  figures::draw_worlds(path, panels);
  return true;
}

/// Returns false if there was nothing to draw.
bool draw(const FigureChoice& figure, const Shown& shown, const fs::path& path) {
  if (shown.indices().empty()) return false;
  switch (figure.kind) {
    case FigureKind::error_grid:
      return draw_grid(shown, path);
    case FigureKind::error_distribution:
      return draw_distributions(shown, path);
    case FigureKind::map_difference:
      return draw_differences(shown, path);
    case FigureKind::field_residual:
      return draw_residuals(shown, path);
    case FigureKind::world_overview:
      return draw_overview(shown, path);
  }
  return false;
}

}  // namespace

std::vector<DrawnFigure> draw_figures(const Experiment& experiment, const Results& results, const fs::path& root) {
  emptied_folder(root / "figures");
  std::vector<DrawnFigure> drawn;
  for (const FigureChoice& figure : experiment.figures) {
    const std::string path = "figures/" + figure.name;
    try {
      if (!draw(figure, Shown(figure, results, root), root / path)) continue;
    } catch (const InputError& error) {
      spdlog::warn("lodestone: figure {} is not drawn: {}", figure.name, error.what());
      continue;
    }
    drawn.push_back({figure.title, path + ".png", path + ".pdf", path + ".svg", figure.caption});
  }
  return drawn;
}

}  // namespace lodestone::reproduce
