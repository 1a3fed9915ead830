#include "tests/benchmarks/kidnapped/site_maps.h"

#include <cmath>
#include <filesystem>
#include <limits>

#include "core/mapping/magnetic_map_builder.h"
#include "core/parallel.h"
#include "core/random_stream.h"
#include "estimators/initialization/place_search.h"
#include "frontends/maps/magnetic_map_file.h"
#include "frontends/maps/point_cloud_file.h"
#include "frontends/maps/point_cloud_writer.h"
#include "frontends/synchronizer/survey.h"
#include "tests/estimators/initialization/random_starts.h"
#include "tools/simulate/cloud_map.h"

namespace lodestone {
namespace {

constexpr std::uint64_t map_seed = 1;
constexpr int viewpoints = 300;

std::vector<Eigen::Vector3f> make_cloud(simulation::World world, const simulation::Environment& environment,
                                        MapKind kind) {
  if (kind == MapKind::site) {
    simulation::RandomStarts places;
    places.count = viewpoints;
    places.seed = 1000;
    places.moving_share = 0.0;
    int index = 0;
    for (const simulation::RandomStart& start : random_starts(environment, places)) {
      world = simulation::with_sequence(std::move(world), "viewpoint " + std::to_string(index++), start.sequence);
    }
  }
  return sample_cloud(world, environment, map_seed);
}

MagneticMap survey_field(const simulation::World& world,
                         const std::shared_ptr<const simulation::Environment>& environment) {
  std::vector<FieldObservation> observations;
  for (const auto& [name, sequence] : world.sequences) {
    simulation::SimulationSource source(world, environment, name, simulation::SimulationSource::Drive::survey, map_seed,
                                        1e9);
    const FieldSurvey survey =
        read_survey(source, source.trajectory(), simulation::sensor_suite(world), from_seconds(0.25));
    observations.insert(observations.end(), survey.observations.begin(), survey.observations.end());
  }
  return build_magnetic_map(observations, {}).map;
}

/// The true field everywhere a robot can stand, with a smooth error.
MagneticMap site_field(const simulation::World& world, const simulation::Environment& environment,
                       const PlaneMap& planes) {
  constexpr double error_ut = 0.5;
  constexpr int error_nodes = 2;  // distance between independent errors, in nodes
  const std::vector<SiteLevel> levels = find_levels(planes, 4);
  const SiteLevel& floor = levels.front();
  FieldGrid grid;
  grid.resolution_m = 0.2;
  grid.origin = floor.origin_m;
  grid.columns = static_cast<int>(floor.columns * floor.cell_m / grid.resolution_m);
  grid.rows = static_cast<int>(floor.rows * floor.cell_m / grid.resolution_m);
  grid.heights_m = {world.imu.height_m + world.magnetometers.mounts.front().T_imu_mag().position.z()};
  const float none = std::numeric_limits<float>::quiet_NaN();
  std::vector<Eigen::Vector4f> nodes(static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows),
                                     Eigen::Vector4f::Constant(none));
  const auto error_at = [&](int row, int column) {
    const std::uint64_t index = static_cast<std::uint64_t>(row) << 32U | static_cast<std::uint64_t>(column);
    return RandomStream(map_seed, "error of the site's field", index).normal3();
  };
  parallel_for(0, grid.rows, [&](int row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector2d place = grid.origin + grid.resolution_m * Eigen::Vector2d(column, row);
      const int x = floor.column_of(place.x());
      const int y = floor.row_of(place.y());
      if (!floor.contains(x, y) || (floor.cells[floor.index(x, y)] & SiteLevel::standable) == 0) continue;
      const int r = row / error_nodes;
      const int c = column / error_nodes;
      const double u = static_cast<double>(row % error_nodes) / error_nodes;
      const double v = static_cast<double>(column % error_nodes) / error_nodes;
      const Vector3 error = (1.0 - u) * ((1.0 - v) * error_at(r, c) + v * error_at(r, c + 1)) +
                            u * ((1.0 - v) * error_at(r + 1, c) + v * error_at(r + 1, c + 1));
      const Vector3 point(place.x(), place.y(), grid.heights_m.front());
      const Vector3 field = environment.field.field_ut(point) + error_ut * error;
      nodes[static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.columns) + static_cast<std::size_t>(column)] =
          Eigen::Vector4f(static_cast<float>(field.x()), static_cast<float>(field.y()), static_cast<float>(field.z()),
                          static_cast<float>(error_ut));
    }
  });
  return MagneticMap(grid, nodes, 3.0);
}

}  // namespace

SiteMaps make_maps(const simulation::World& world, std::shared_ptr<const simulation::Environment> environment,
                   MapKind kind, const std::string& folder) {
  const std::filesystem::path place = folder;
  const std::string cloud_file = folder.empty() ? "" : (place / "cloud.pcd").string();
  const std::string field_file = folder.empty() ? "" : (place / "field.yaml").string();
  if (!folder.empty()) std::filesystem::create_directories(place);
  SiteMaps maps;
  WarningLog warnings;
  std::vector<Eigen::Vector3f> cloud;
  if (!folder.empty() && std::filesystem::exists(cloud_file)) {
    cloud = read_point_cloud(cloud_file, warnings);
  } else {
    cloud = make_cloud(world, *environment, kind);
    if (!folder.empty()) write_point_cloud(cloud_file, cloud);
  }
  maps.planes = std::make_shared<const PlaneMap>(cloud, PlaneMapOptions{});
  if (!folder.empty() && std::filesystem::exists(field_file)) {
    maps.field = std::make_shared<const MagneticMap>(read_magnetic_map(field_file));
  } else {
    maps.field = std::make_shared<const MagneticMap>(
        kind == MapKind::site ? site_field(world, *environment, *maps.planes) : survey_field(world, environment));
    if (!folder.empty()) write_magnetic_map(*maps.field, {{"made_by", "lodestone_kidnapped"}}, field_file);
  }
  return maps;
}

}  // namespace lodestone
