#include "frontends/readers/point_cloud_file.h"

#include <fmt/format.h>
#include <pcl/PCLPointCloud2.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "frontends/configuration/nearest_name.h"

namespace lodestone {
namespace {

enum class Format { pcd, ply };

/// Told by the file's first bytes, not by its name.
Format format_of(const std::string& path) {
  std::error_code code;
  if (!std::filesystem::exists(path, code)) throw InputError(path + ": there is no such file");
  if (!std::filesystem::is_regular_file(path, code)) throw InputError(path + ": expected a PCD or PLY file");
  std::ifstream stream(path, std::ios::binary);
  std::string line;
  while (std::getline(stream, line) && line.size() < 4096) {
    if (line.rfind("ply", 0) == 0) return Format::ply;
    if (line.rfind("VERSION", 0) == 0 || line.rfind("FIELDS", 0) == 0) return Format::pcd;
    if (!line.empty() && line[0] != '#' && line != "\r") break;
  }
  throw InputError(path + ": is neither a PCD nor a PLY file; expected a point-cloud map in one of these formats");
}

/// One coordinate of every point; PCL's own conversion to PointXYZ refuses doubles.
void copy_coordinate(const std::string& path, const pcl::PCLPointCloud2& cloud, const char* name, int row,
                     std::vector<Eigen::Vector3f>& points) {
  const auto field = std::find_if(cloud.fields.begin(), cloud.fields.end(),
                                  [name](const pcl::PCLPointField& each) { return each.name == name; });
  if (field == cloud.fields.end()) {
    std::vector<std::string> names;
    for (const auto& each : cloud.fields) names.push_back(each.name);
    throw InputError(fmt::format("{}: the points have no field '{}'; the file has {}", path, name, join_names(names)));
  }
  const bool is_double = field->datatype == pcl::PCLPointField::FLOAT64;
  if (!is_double && field->datatype != pcl::PCLPointField::FLOAT32) {
    throw InputError(fmt::format("{}: the field '{}' is no floating-point number", path, name));
  }
  const std::uint8_t* data = cloud.data.data() + field->offset;
  for (Eigen::Vector3f& point : points) {
    if (is_double) {
      double value = 0.0;
      std::memcpy(&value, data, sizeof(value));
      point[row] = static_cast<float>(value);
    } else {
      std::memcpy(&point[row], data, sizeof(float));
    }
    data += cloud.point_step;
  }
}

}  // namespace

std::vector<Eigen::Vector3f> read_point_cloud(const std::string& path, WarningLog& warnings) {
  const Format format = format_of(path);
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // its complaints are ours to word
  pcl::PCLPointCloud2 cloud;
  int result = -1;
  std::string reason = "it is malformed or truncated";
  try {
    result = format == Format::pcd ? pcl::PCDReader().read(path, cloud) : pcl::PLYReader().read(path, cloud);
  } catch (const std::exception& error) {
    reason = error.what();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
  }
  const std::size_t count = std::size_t{cloud.width} * cloud.height;
  if (result < 0 || cloud.data.size() < count * cloud.point_step) {
    throw InputError(path + ": the point cloud cannot be read: " + reason);
  }
  if (count == 0) throw InputError(path + ": the point cloud has no points; expected a map of the site");
  std::vector<Eigen::Vector3f> points(count);
  copy_coordinate(path, cloud, "x", 0, points);
  copy_coordinate(path, cloud, "y", 1, points);
  copy_coordinate(path, cloud, "z", 2, points);
  const auto finite_end =
      std::remove_if(points.begin(), points.end(), [](const Eigen::Vector3f& point) { return !point.allFinite(); });
  const auto dropped = static_cast<std::int64_t>(points.end() - finite_end);
  points.erase(finite_end, points.end());
  if (points.empty()) throw InputError(path + ": the point cloud has no finite points; expected a map of the site");
  if (dropped > 0) {
    warnings.add("cloud.nan_points", path + ": map points without a finite position were dropped", 0, dropped);
  }
  return points;
}

void write_point_cloud(const std::string& path, const std::vector<Eigen::Vector3f>& points) {
  const std::string aside = path + ".part";
  std::ofstream stream(aside, std::ios::binary | std::ios::trunc);
  stream << "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
         << "WIDTH " << points.size() << "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << points.size()
         << "\nDATA binary\n";
  static_assert(sizeof(Eigen::Vector3f) == 12, "three floats without padding, as the file has them");
  stream.write(reinterpret_cast<const char*>(points.data()), static_cast<std::streamsize>(points.size() * 12));
  stream.close();
  std::error_code code;
  if (stream) std::filesystem::rename(aside, path, code);
  if (!stream || code) {
    std::remove(aside.c_str());
    throw InputError(path + ": cannot be written; check the folder and the free space");
  }
}

}  // namespace lodestone
