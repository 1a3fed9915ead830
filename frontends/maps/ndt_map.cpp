#include "frontends/maps/ndt_map.h"

#include <fmt/format.h>
#include <pcl/console/print.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/ndt.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/lidar/voxel_planes.h"
#include "core/middle_value.h"
#include "frontends/maps/plane_map_loader.h"
#include "frontends/maps/point_cloud_file.h"

namespace lodestone {

namespace {

using NdtCloud = pcl::PointCloud<pcl::PointXYZ>;

constexpr double kNdtTile_m = 32.0;          // rounded to whole cells; results do not depend on it but for rounding
constexpr std::size_t kNdtTargets = 4;       // around a corner of tiles
constexpr double kSmallestStep = 0.01;       // of translation (m) and angles (rad): ends the iterations
constexpr double kFarthestPosition_m = 1e6;  // beyond any map, within the range of tile indices
constexpr double kOriginStep_m = 1e4;        // a float that is half as large is exact to 0.5 mm

NdtCloud::Ptr to_pcl(std::span<const Eigen::Vector3f> points) {
  auto cloud = pcl::make_shared<NdtCloud>();
  cloud->reserve(points.size());
  for (const Eigen::Vector3f& point : points) cloud->emplace_back(point.x(), point.y(), point.z());
  return cloud;
}

/// The middle of the first points, rounded: 0 for a site near the map's origin.
Vector3 local_origin_of(std::span<const Eigen::Vector3f> first_points) {
  Vector3 origin_m;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> coordinates;
    for (const Eigen::Vector3f& point : first_points) coordinates.push_back(point[axis]);
    const long steps = std::lround(middle_value(std::move(coordinates)) / kOriginStep_m);
    origin_m[axis] = kOriginStep_m * static_cast<double>(steps);
  }
  return origin_m;
}

std::vector<Eigen::Vector3f> positions_of(const VoxelMeans& cloud) {
  std::vector<Eigen::Vector3f> positions;
  positions.reserve(cloud.size());
  for (const VoxelMean& mean : cloud.means(1)) positions.push_back(mean.position);
  return positions;
}

/// PCL's registration, with a count of the points that have a cell.
class NdtRegistration final : public pcl::NormalDistributionsTransform<pcl::PointXYZ, pcl::PointXYZ> {
 public:
  NdtRegistration(const NdtCloud::ConstPtr& target, double cell_m) {
    setResolution(static_cast<float>(cell_m));
    // PCL compares the squared translation, and the cosine of the angle. With the translation alone, iterations would
    // end after a pure rotation.
    setTransformationEpsilon(kSmallestStep * kSmallestStep);
    setTransformationRotationEpsilon(std::cos(kSmallestStep));
    setSearchMethodTarget(pcl::make_shared<KdTree>(), true);  // no tree of all points: cells have their own
    setInputTarget(target);
  }

  bool has_cells() { return !target_cells_.getCentroids()->empty(); }

  int count_near_cells(const NdtCloud& scan) const {
    return static_cast<int>(std::count_if(scan.begin(), scan.end(), [this](const pcl::PointXYZ& point) {
      std::vector<TargetGridLeafConstPtr> cells;
      std::vector<float> squared_distances;
      return target_cells_.radiusSearch(point, resolution_, cells, squared_distances, 1) > 0;
    }));
  }
};

}  // namespace

/// The tiles around one place.
struct NdtMap::Target {
  Target(std::vector<TileIndex> tiles_in, const NdtCloud::ConstPtr& cloud, double cell_m)
      : tiles(std::move(tiles_in)), registration(cloud, cell_m) {}
  std::vector<TileIndex> tiles;
  NdtRegistration registration;
};

NdtMap::NdtMap(const VoxelMeans& cloud, const NdtOptions& options, double reach_m, const Vector3& local_origin_m)
    : options_(options),
      reach_m_(reach_m),
      tile_m_(options.cell_m * std::max(1.0, std::round(kNdtTile_m / options.cell_m))),
      local_origin_m_(local_origin_m) {
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // what fails is reported by the result
  // A cell must not be divided: cells are numbered in floats, as PCL numbers them.
  const auto cells_a_tile = static_cast<float>(std::lround(tile_m_ / options.cell_m));
  const float cells_a_metre = 1.0F / static_cast<float>(options.cell_m);
  for (const Eigen::Vector3f& point : positions_of(cloud)) {
    const auto tile_of = [&](float coordinate) {
      return static_cast<int>(std::floor(std::floor(coordinate * cells_a_metre) / cells_a_tile));
    };
    tiles_[{tile_of(point.x()), tile_of(point.y())}].push_back(point);
    ++points_;
  }
}

NdtMap::~NdtMap() = default;

NdtMap::Target& NdtMap::target_around(const Vector3& position) {
  const auto tile_of = [&](double coordinate) { return static_cast<int>(std::floor(coordinate / tile_m_)); };
  const TileIndex here{tile_of(position.x()), tile_of(position.y())};
  std::vector<TileIndex> near;
  for (const auto& [tile, points] : tiles_) {
    // Tiles between the two, by which their edges are apart.
    const double columns = std::max(0, std::abs(tile.first - here.first) - 1);
    const double rows = std::max(0, std::abs(tile.second - here.second) - 1);
    if (tile_m_ * std::hypot(columns, rows) <= reach_m_) near.push_back(tile);
  }
  const auto known =
      std::find_if(targets_.begin(), targets_.end(), [&](const auto& target) { return target->tiles == near; });
  if (known != targets_.end()) {
    std::rotate(known, known + 1, targets_.end());
    return *targets_.back();
  }
  if (targets_.size() == kNdtTargets) targets_.pop_front();
  std::vector<Eigen::Vector3f> points;
  for (const TileIndex& tile : near) points.insert(points.end(), tiles_.at(tile).begin(), tiles_.at(tile).end());
  const NdtCloud::ConstPtr cloud = to_pcl(points);
  targets_.push_back(std::make_unique<Target>(std::move(near), cloud, options_.cell_m));
  return *targets_.back();
}

std::optional<ScanMatch> NdtMap::match(std::span<const Eigen::Vector3f> points, const Pose& guess) {
  const Vector3 local_position = guess.position - local_origin_m_;
  // Negated, so that a position that is not a number is far too.
  if (!(local_position.cwiseAbs().maxCoeff() < kFarthestPosition_m) || !guess.rotation.coeffs().allFinite())
    return std::nullopt;
  VoxelMeans thinned(options_.thinning_m);
  for (const Eigen::Vector3f& point : points) thinned.add(point);
  NdtRegistration& registration = target_around(local_position).registration;
  if (thinned.size() == 0 || !registration.has_cells()) return std::nullopt;

  Eigen::Isometry3d begin(guess.rotation.normalized());
  begin.pretranslate(local_position);
  registration.setInputSource(to_pcl(positions_of(thinned)));
  NdtCloud aligned;
  registration.align(aligned, begin.matrix().cast<float>());
  const Eigen::Matrix4f found = registration.getFinalTransformation();
  if (!registration.hasConverged() || !found.allFinite()) return std::nullopt;

  ScanMatch match;
  match.T_map_imu.rotation = Quaternion(Matrix3(found.topLeftCorner<3, 3>().cast<double>())).normalized();
  match.T_map_imu.position = found.topRightCorner<3, 1>().cast<double>() + local_origin_m_;
  match.points = static_cast<int>(thinned.size());
  match.matched = registration.count_near_cells(aligned);
  match.iterations = registration.getFinalNumIteration();
  if (match.matched == 0) return std::nullopt;  // no gradient: the result is the guess
  return match;
}

std::shared_ptr<NdtMap> load_ndt_map(const std::string& path, const NdtOptions& options,
                                     std::span<const LidarModel> lidars, WarningLog& warnings,
                                     const Vector3& origin_m) {
  VoxelMeans cloud(options.thinning_m);
  const auto reach_m = static_cast<float>(voxels_reach_m(options.thinning_m));
  std::int64_t far = 0;
  WarningLog counted_by_load_planes;
  std::optional<Vector3> local_origin_m;
  const auto add = [&](std::span<const Eigen::Vector3f> piece) {
    if (!local_origin_m && !piece.empty()) local_origin_m = local_origin_of(piece);
    for (const Eigen::Vector3f& in_map : piece) {
      const Eigen::Vector3f point = in_map - local_origin_m->cast<float>();
      if (point.cwiseAbs().maxCoeff() < reach_m) {
        cloud.add(point);
      } else {
        ++far;
      }
    }
  };
  stream_point_cloud(path, counted_by_load_planes, add, origin_m);
  if (far > 0) {
    warnings.add(
        "cloud.far_points",
        fmt::format("{}: map points farther than {:.0f} m from ({:.0f}, {:.0f}, {:.0f}) m, the limit for "
                    "ndt.registration.thinning_m = {:g}, were dropped",
                    path, reach_m, local_origin_m->x(), local_origin_m->y(), local_origin_m->z(), options.thinning_m),
        0, far);
  }
  return std::make_shared<NdtMap>(cloud, options, map_reach_m(lidars), local_origin_m.value_or(Vector3::Zero()));
}

}  // namespace lodestone
