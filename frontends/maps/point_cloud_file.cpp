#include "frontends/maps/point_cloud_file.h"

#include <fmt/format.h>
#include <pcl/PCLPointCloud2.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/configuration/missing_file.h"
#include "frontends/maps/las_points.h"
#include "frontends/maps/pcd_check.h"
#include "frontends/maps/pcd_layout.h"
#include "frontends/maps/ply_vertices.h"

namespace lodestone {
namespace {

/// Limit for clouds that PCL reads at once. Larger clouds must be uncompressed binary PCD, which is streamed.
constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 34;

enum class Format { pcd, ply, las };

/// The format by the file's first bytes, not by its name.
Format format_of(const std::string& path) {
  std::error_code code;
  if (!std::filesystem::exists(path, code)) throw missing_file(path);
  if (!std::filesystem::is_regular_file(path, code)) {
    throw InputError(path + ": expected a PCD, PLY or LAS file" +
                     (std::filesystem::is_directory(path, code) ? ", found a folder" : ""));
  }
  if (std::filesystem::file_size(path, code) == 0) {
    throw InputError(path + ": the file is empty (0 bytes); expected a PCD, PLY or LAS file; copy it again");
  }
  std::ifstream stream(path, std::ios::binary);
  std::string line;
  while (std::getline(stream, line) && (line.size() < 4096 || line.rfind("LASF", 0) == 0)) {
    if (line.rfind("ply", 0) == 0) return Format::ply;
    if (line.rfind("LASF", 0) == 0) return Format::las;
    if (line.rfind("VERSION", 0) == 0 || line.rfind("FIELDS", 0) == 0) return Format::pcd;
    if (!line.empty() && line[0] != '#' && line != "\r") break;
  }
  throw InputError(path + ": is no PCD, PLY or LAS file; expected a point-cloud map in one of these formats" +
                   looks_like(path));
}

/// Offset and type (float or double) of a coordinate in a point.
struct Coordinate {
  std::int64_t offset;
  bool is_double;
};

/// Layout of x, y and z in points of `bytes`. PCL's conversion to PointXYZ refuses doubles.
struct PositionLayout {
  PositionLayout(const std::string& path, const std::vector<PointFieldLayout>& fields, std::int64_t point_bytes)
      : bytes(point_bytes) {
    for (int row = 0; row < 3; ++row) {
      const std::string name(1, "xyz"[row]);
      const auto field = std::find_if(fields.begin(), fields.end(),
                                      [&name](const PointFieldLayout& each) { return each.name == name; });
      if (field == fields.end()) {
        throw InputError(fmt::format("{}: the points have no field '{}'; the file has {}", path, name,
                                     join_names(fields, &PointFieldLayout::name)));
      }
      if (field->type != 'F' || (field->size != 4 && field->size != 8)) {
        throw InputError(fmt::format(
            "{}: the field '{}' is not a floating-point number; write x, y and z as floats or doubles, in metres", path,
            name));
      }
      coordinates[row] = {field->offset, field->size == 8};
    }
  }

  Vector3 position(const std::uint8_t* point) const {
    Vector3 result;
    for (int row = 0; row < 3; ++row) {
      const std::uint8_t* data = point + coordinates[row].offset;
      if (coordinates[row].is_double) {
        std::memcpy(&result[row], data, sizeof(double));
      } else {
        float value = 0.0F;
        std::memcpy(&value, data, sizeof(value));
        result[row] = value;
      }
    }
    return result;
  }

  std::int64_t bytes;
  Coordinate coordinates[3];
};

[[noreturn]] void fail_to_read(const std::string& path, const std::string& reason) {
  throw InputError(path + ": the point cloud cannot be read: " + reason);
}

constexpr const char* kMalformed = "it is malformed or truncated";

[[noreturn]] void fail_empty(const std::string& path) {
  throw InputError(path + ": the point cloud has no points; expected a map of the site");
}

/// Farther away, floats are more than a centimetre apart, m: coordinates of a country, not of a site. Voxels of an
/// eighth of a metre have indices up to here.
constexpr double kLargestSite_m = 131'072.0;
/// Limit of plausible coordinates.
constexpr double kFarthest_m = 1e7;
/// The origin that is proposed for a georeferenced cloud, rounded to this.
constexpr double kRoundOrigin_m = 1000.0;

/// Passes finite positions, less the origin, on in pieces and counts the others.
class PositionStream {
 public:
  PositionStream(const PointSink& sink, Vector3 origin_m) : sink_(sink), origin_m_(std::move(origin_m)) {
    piece_.reserve(kPointsAPiece);
  }

  void add(const PositionLayout& layout, const std::uint8_t* points, std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i) {
      add(layout.position(points + i * layout.bytes));
    }
  }

  void add(const Vector3& in_file) {
    const Vector3 position = in_file - origin_m_;
    if (!position.allFinite()) {
      ++dropped_;
      return;
    }
    const double away_m = position.cwiseAbs().maxCoeff();
    if (away_m > kFarthest_m) {
      ++too_far_;
      return;
    }
    if (away_m > kLargestSite_m) {
      if (off_site_++ == 0) first_off_site_ = position;
      return;
    }
    piece_.emplace_back(position.cast<float>());
    if (piece_.size() == kPointsAPiece) flush();
  }

  void finish(const std::string& path, WarningLog& warnings) {
    flush();
    if (kept_ == 0 && off_site_ == 0) {
      throw InputError(
          path + ": the point cloud has no finite points within 10,000 km of its origin; expected a map of the site");
    }
    if (off_site_ > kept_) {
      const Vector3 near = kRoundOrigin_m * ((first_off_site_ + origin_m_) / kRoundOrigin_m).array().round();
      throw InputError(fmt::format(
          "{}: the origin is far away, a point is at ({:.0f}, {:.0f}, {:.0f}) m, where the precision of floats is "
          "centimetres or worse; expected metres from an origin at the site; {}",
          path, first_off_site_.x(), first_off_site_.y(), first_off_site_.z(),
          near.isZero(0.0)
              ? "omit --origin"
              : fmt::format("give --origin {:.0f},{:.0f},{:.0f}, or subtract it from all files of the site "
                            "with `lodestone shift`",
                            near.x(), near.y(), near.z())));
    }
    if (off_site_ + too_far_ > 0) {
      warnings.add("cloud.far_points", path + ": map points farther than 131 km from the origin were dropped", 0,
                   off_site_ + too_far_);
    }
    if (dropped_ > 0) {
      warnings.add("cloud.nan_points", path + ": map points without a finite position were dropped", 0, dropped_);
    }
  }

  static constexpr std::size_t kPointsAPiece = 1 << 16;

 private:
  void flush() {
    if (piece_.empty()) return;
    sink_(piece_);
    kept_ += static_cast<std::int64_t>(piece_.size());
    piece_.clear();
  }

  const PointSink& sink_;
  Vector3 origin_m_;
  std::vector<Eigen::Vector3f> piece_;
  std::int64_t kept_ = 0;
  std::int64_t dropped_ = 0;   ///< not finite
  std::int64_t too_far_ = 0;   ///< also dropped
  std::int64_t off_site_ = 0;  ///< also dropped; nearer than the limit of plausible coordinates
  Vector3 first_off_site_ = Vector3::Zero();
};

void stream_binary_pcd(const std::string& path, const PcdLayout& pcd, PositionStream& positions) {
  if (pcd.points == 0) fail_empty(path);
  const auto there = static_cast<std::int64_t>(std::filesystem::file_size(path)) - pcd.data_offset;
  if (there / pcd.point_bytes < pcd.points) {
    throw InputError(
        fmt::format("{}: is cut off: the header announces {} points of {} bytes, but {} points ({} bytes) follow; "
                    "copy or write it again",
                    path, pcd.points, pcd.point_bytes, there / pcd.point_bytes, there));
  }
  const PositionLayout layout(path, pcd.fields, pcd.point_bytes);
  std::ifstream stream(path, std::ios::binary);
  stream.seekg(pcd.data_offset);
  // Points with many fields must not make pieces large.
  constexpr std::int64_t kPartBytes = std::int64_t{1} << 22;
  const std::int64_t part_points =
      std::clamp<std::int64_t>(kPartBytes / pcd.point_bytes, 1, PositionStream::kPointsAPiece);
  std::vector<std::uint8_t> part(static_cast<std::size_t>(part_points * pcd.point_bytes));
  for (std::int64_t begin = 0; begin < pcd.points; begin += part_points) {
    const std::int64_t count = std::min(part_points, pcd.points - begin);
    if (!stream.read(reinterpret_cast<char*>(part.data()), count * pcd.point_bytes)) fail_to_read(path, kMalformed);
    positions.add(layout, part.data(), count);
  }
}

void stream_ply(const std::string& path, PositionStream& positions) {
  PlyVertices vertices(path);
  if (vertices.count() == 0) fail_empty(path);
  for (std::uint64_t i = 0; i < vertices.count(); ++i) positions.add(vertices.next());
}

void stream_las(const std::string& path, WarningLog& warnings, PositionStream& positions) {
  LasPoints points(path);
  if (points.count() == 0) fail_empty(path);
  for (Vector3 position; points.next(position);) positions.add(position);
  if (points.left_out() > 0) {
    warnings.add("cloud.marked_points", path + ": map points that the file marks as withheld or noise were dropped", 0,
                 points.left_out());
  }
}

/// Text or packed PCD is read at once by PCL.
void read_by_pcl(const std::string& path, PositionStream& positions) {
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // errors are reported by InputError
  pcl::PCLPointCloud2 cloud;
  int result = -1;
  std::string reason = kMalformed;
  check_pcd(path, kMostBytes, "copy or write it again");
  try {
    result = pcl::PCDReader().read(path, cloud);
  } catch (const std::exception& error) {
    reason = error.what();
    std::replace(reason.begin(), reason.end(), '\n', ' ');
  }
  const std::size_t count = std::size_t{cloud.width} * cloud.height;
  if (result < 0 || cloud.data.size() < count * cloud.point_step) fail_to_read(path, reason);
  if (count == 0) fail_empty(path);
  std::vector<PointFieldLayout> fields;
  for (const pcl::PCLPointField& field : cloud.fields) {
    const bool is_float =
        field.datatype == pcl::PCLPointField::FLOAT32 || field.datatype == pcl::PCLPointField::FLOAT64;
    fields.push_back(
        {field.name, is_float ? 'F' : 'I', field.datatype == pcl::PCLPointField::FLOAT64 ? 8 : 4, field.offset});
  }
  positions.add(PositionLayout(path, fields, cloud.point_step), cloud.data.data(), static_cast<std::int64_t>(count));
}

}  // namespace

void stream_point_cloud(const std::string& path, WarningLog& warnings, const PointSink& sink, const Vector3& origin_m) {
  const Format format = format_of(path);
  PositionStream positions(sink, origin_m);
  if (format == Format::las) {
    stream_las(path, warnings, positions);
  } else if (format == Format::ply) {
    stream_ply(path, positions);
  } else if (const auto pcd = read_binary_pcd_layout(path)) {
    stream_binary_pcd(path, *pcd, positions);
  } else {
    read_by_pcl(path, positions);
  }
  positions.finish(path, warnings);
}

std::vector<Eigen::Vector3f> read_point_cloud(const std::string& path, WarningLog& warnings, const Vector3& origin_m) {
  std::vector<Eigen::Vector3f> points;
  stream_point_cloud(
      path, warnings,
      [&](std::span<const Eigen::Vector3f> piece) { points.insert(points.end(), piece.begin(), piece.end()); },
      origin_m);
  return points;
}

}  // namespace lodestone
