#include <fmt/format.h>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

#include <filesystem>

#include "core/error.h"
#include "frontends/simulation/cloud_map.h"

namespace lodestone::simulation {

void write_pcd(const std::string& path, const std::vector<Eigen::Vector3f>& points) {
  if (points.empty())
    throw InputError(path + ": no surface of the world is seen from its paths; the cloud map is empty");
  pcl::PointCloud<pcl::PointXYZ> cloud;
  cloud.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) cloud[i].getVector3fMap() = points[i];
  const std::string aside = path + ".partial";
  try {
    if (pcl::PCDWriter().writeBinary(aside, cloud) != 0) throw InputError(path + ": cannot write the cloud map");
    std::filesystem::rename(aside, path);
  } catch (const pcl::IOException& error) {
    throw InputError(fmt::format("{}: cannot write the cloud map: {}", path, error.what()));
  } catch (const std::filesystem::filesystem_error& error) {
    throw InputError(fmt::format("{}: cannot write the cloud map: {}", path, error.code().message()));
  }
}

}  // namespace lodestone::simulation
