#include "frontends/maps/point_cloud_writer.h"

#include <fmt/format.h>

#include <filesystem>
#include <utility>

#include "core/error.h"

namespace lodestone {

static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float), "three floats without padding, as the file has them");
static_assert(sizeof(Vector3) == 3 * sizeof(double), "three doubles without padding, as the file has them");

namespace {

bool is_ply(const std::string& path, const Vector3& origin_m) {
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending == ".ply") return true;
  if (ending != ".pcd") {
    throw InputError(fmt::format("{}: expected a name ending in .pcd or .ply, found '{}'", path, ending));
  }
  if (!origin_m.isZero(0.0)) {
    throw InputError(path +
                     ": a PCD has floats, which are too coarse for these coordinates; expected a name ending "
                     "in .ply");
  }
  return false;
}

template <class Position>
std::string_view bytes_of(std::span<const Position> positions) {
  return {reinterpret_cast<const char*>(positions.data()), positions.size_bytes()};
}

}  // namespace

PointCloudWriter::PointCloudWriter(const std::string& path, Vector3 origin_m)
    : origin_m_(std::move(origin_m)), is_ply_(is_ply(path, origin_m_)), file_(path) {
  file_.write(header());
}

/// The number of points has leading zeros, so that the header's length does not depend on it.
std::string PointCloudWriter::header() const {
  if (is_ply_) {
    return fmt::format(
        "ply\nformat binary_little_endian 1.0\nelement vertex {:012}\nproperty double x\nproperty double y\n"
        "property double z\nend_header\n",
        count_);
  }
  return fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
      "WIDTH {0:012}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0:012}\nDATA binary\n",
      count_);
}

void PointCloudWriter::add(std::span<const Eigen::Vector3f> positions) {
  count_ += static_cast<std::int64_t>(positions.size());
  if (is_ply_) {
    piece_.clear();
    for (const Eigen::Vector3f& position : positions) piece_.emplace_back(position.cast<double>() + origin_m_);
    file_.write(bytes_of<Vector3>(piece_));
  } else {
    file_.write(bytes_of(positions));
  }
}

void PointCloudWriter::commit() {
  file_.rewrite(0, header());
  file_.commit();
}

void write_point_cloud(const std::string& path, const std::vector<Eigen::Vector3f>& points) {
  PointCloudWriter writer(path);
  writer.add(points);
  writer.commit();
}

}  // namespace lodestone
