#include "frontends/maps/las_points.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "core/error.h"

namespace lodestone {
namespace {

// Bytes of the public header block, ASPRS LAS specification 1.4 R15, table 3.
constexpr std::size_t kHeaderBytes = 227;      // up to version 1.2
constexpr std::size_t kLongHeaderBytes = 375;  // version 1.4
constexpr std::size_t kMajorVersion = 24;
constexpr std::size_t kMinorVersion = 25;
constexpr std::size_t kOwnBytes = 94;
constexpr std::size_t kPointsBegin = 96;
constexpr std::size_t kPointFormat = 104;
constexpr std::size_t kPointBytes = 105;
constexpr std::size_t kPointCount = 107;  // 32 bits, of formats 0 to 5
constexpr std::size_t kScale = 131;
constexpr std::size_t kOffset = 155;
constexpr std::size_t kLongPointCount = 247;  // 64 bits, from version 1.4 on

/// LASzip sets these bits of the point format.
constexpr int kCompressedBits = 0xC0;

/// Least bytes of a point of each format, tables 7 to 17.
constexpr std::array<std::size_t, 11> kLeastBytes{20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};
constexpr int kFirstLongFormat = 6;

// Of a point of formats 0 to 5, and of formats 6 to 10.
constexpr std::size_t kClass = 15;
constexpr int kClassBits = 0x1F;
constexpr int kWithheldBit = 0x80;
constexpr std::size_t kLongFlags = 15;
constexpr std::size_t kLongClass = 16;
constexpr int kLongWithheldBit = 0x04;
constexpr int kLowNoise = 7;
constexpr int kHighNoise = 18;

constexpr std::uint64_t kPartPoints = 1 << 15;

/// LAS is little-endian, as are the machines that this program supports.
template <class Value>
Value value_at(const std::uint8_t* bytes, std::size_t at) {
  Value value;
  std::memcpy(&value, bytes + at, sizeof(value));
  return value;
}

}  // namespace

LasPoints::LasPoints(const std::string& path) : path_(path), stream_(path, std::ios::binary) {
  if (!stream_) throw InputError(path_ + ": the point cloud cannot be read: the file cannot be opened");
  read_header();
}

void LasPoints::fail(const std::string& what) const {
  throw InputError(fmt::format("{}: the point cloud cannot be read: {}; copy or write it again", path_, what));
}

void LasPoints::read_header() {
  std::array<std::uint8_t, kLongHeaderBytes> header{};
  stream_.read(reinterpret_cast<char*>(header.data()), static_cast<std::streamsize>(header.size()));
  const auto found = static_cast<std::size_t>(stream_.gcount());
  stream_.clear();
  const std::uint8_t* bytes = header.data();
  if (found < kHeaderBytes) fail("the header is cut off");
  const int major = bytes[kMajorVersion], minor = bytes[kMinorVersion];
  if (major != 1 || minor > 4) {
    throw InputError(fmt::format("{}: expected LAS 1.0 to 1.4, found version {}.{}", path_, major, minor));
  }
  if (bytes[kPointFormat] & kCompressedBits) {
    throw InputError(path_ +
                     ": is compressed (LAZ); write it as LAS, for example with `laszip -i map.laz -o map.las` or "
                     "`pdal translate map.laz map.las`");
  }
  format_ = bytes[kPointFormat];
  if (format_ >= static_cast<int>(kLeastBytes.size())) {
    throw InputError(fmt::format("{}: expected a LAS point format from 0 to 10, found {}", path_, format_));
  }
  const std::size_t own = value_at<std::uint16_t>(bytes, kOwnBytes);
  const std::uint64_t begin = value_at<std::uint32_t>(bytes, kPointsBegin);
  point_bytes_ = value_at<std::uint16_t>(bytes, kPointBytes);
  if (own < kHeaderBytes || begin < own) fail("the header's sizes contradict each other");
  if (point_bytes_ < kLeastBytes[static_cast<std::size_t>(format_)]) {
    fail(fmt::format("points of {} bytes are too small for point format {}", point_bytes_, format_));
  }
  count_ = value_at<std::uint32_t>(bytes, kPointCount);
  if (minor == 4 && own >= kLongHeaderBytes && found >= kLongHeaderBytes) {
    count_ = std::max(count_, value_at<std::uint64_t>(bytes, kLongPointCount));
  }
  for (std::size_t row = 0; row < 3; ++row) {
    scale_[row] = value_at<double>(bytes, kScale + 8 * row);
    offset_[row] = value_at<double>(bytes, kOffset + 8 * row);
    if (!std::isfinite(scale_[row]) || scale_[row] == 0.0 || !std::isfinite(offset_[row])) {
      fail("the header's scales and offsets are not finite numbers");
    }
  }
  std::error_code code;
  const std::uint64_t size = std::filesystem::file_size(path_, code);
  const std::uint64_t there = code || size < begin ? 0 : (size - begin) / point_bytes_;
  if (there < count_) {
    throw InputError(fmt::format(
        "{}: is cut off: the header announces {} points of {} bytes, but {} points follow; copy or write it again",
        path_, count_, point_bytes_, there));
  }
  stream_.seekg(static_cast<std::streamoff>(begin));
}

bool LasPoints::is_left_out(const std::uint8_t* point) const {
  if (format_ < kFirstLongFormat) {
    return (point[kClass] & kWithheldBit) != 0 || (point[kClass] & kClassBits) == kLowNoise;
  }
  const int kind = point[kLongClass];
  return (point[kLongFlags] & kLongWithheldBit) != 0 || kind == kLowNoise || kind == kHighNoise;
}

bool LasPoints::next(Vector3& position) {
  while (true) {
    if (at_ == part_.size()) {
      if (read_ == count_) return false;
      const std::uint64_t points = std::min(kPartPoints, count_ - read_);
      part_.resize(static_cast<std::size_t>(points) * point_bytes_);
      if (!stream_.read(reinterpret_cast<char*>(part_.data()), static_cast<std::streamsize>(part_.size()))) {
        fail("the file ends too early");
      }
      read_ += points;
      at_ = 0;
    }
    const std::uint8_t* point = part_.data() + at_;
    at_ += point_bytes_;
    if (is_left_out(point)) {
      ++left_out_;
      continue;
    }
    for (std::size_t row = 0; row < 3; ++row) {
      position[static_cast<Eigen::Index>(row)] = scale_[row] * value_at<std::int32_t>(point, 4 * row) + offset_[row];
    }
    return true;
  }
}

}  // namespace lodestone
