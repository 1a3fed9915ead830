#include "frontends/maps/point_cloud_writer.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <utility>

#include "core/error.h"
#include "frontends/configuration/aside.h"

namespace lodestone {

static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float), "three floats without padding, as the file has them");
static_assert(sizeof(Vector3) == 3 * sizeof(double), "three doubles without padding, as the file has them");

PointCloudWriter::PointCloudWriter(std::string path, Vector3 origin_m)
    : path_(std::move(path)), aside_(aside_name(path_)), origin_m_(std::move(origin_m)) {
  const std::string ending = std::filesystem::path(path_).extension().string();
  is_ply_ = ending == ".ply";
  if (!is_ply_ && ending != ".pcd") {
    throw InputError(fmt::format("{}: expected a name ending in .pcd or .ply, found '{}'", path_, ending));
  }
  if (!is_ply_ && !origin_m_.isZero(0.0)) {
    throw InputError(path_ +
                     ": a PCD has floats, which are too coarse for these coordinates; expected a name ending "
                     "in .ply");
  }
  stream_.open(aside_, std::ios::binary | std::ios::trunc);
  if (!stream_) fail();
  stream_ << header();
}

PointCloudWriter::~PointCloudWriter() {
  if (!stream_.is_open()) return;
  stream_.close();
  std::remove(aside_.c_str());
}

void PointCloudWriter::fail() const {
  std::remove(aside_.c_str());
  throw InputError(path_ + ": cannot be written; check the folder and the free space");
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
    stream_.write(reinterpret_cast<const char*>(piece_.data()),
                  static_cast<std::streamsize>(piece_.size() * sizeof(Vector3)));
  } else {
    stream_.write(reinterpret_cast<const char*>(positions.data()),
                  static_cast<std::streamsize>(positions.size_bytes()));
  }
  if (!stream_) fail();
}

void PointCloudWriter::commit() {
  stream_.seekp(0);
  stream_ << header();
  stream_.close();
  std::error_code code;
  if (stream_) std::filesystem::rename(aside_, path_, code);
  if (!stream_ || code) fail();
}

void write_point_cloud(const std::string& path, const std::vector<Eigen::Vector3f>& points) {
  PointCloudWriter writer(path);
  writer.add(points);
  writer.commit();
}

}  // namespace lodestone
