#pragma once

#include <array>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "core/geometry/so3.h"

namespace lodestone {

/// Streams the positions of a LAS file (ASPRS LAS 1.0 to 1.4, point formats 0 to 10, not compressed). Points that the
/// surveyor has marked as withheld or as noise (classes 7 and 18) are ignored. Announced sizes are not trusted.
class LasPoints {
 public:
  /// Reads the header. Throws InputError if the file is compressed (LAZ), cut off, or its header is invalid.
  explicit LasPoints(const std::string& path);

  /// Number of points in the file, with those that are ignored.
  std::uint64_t count() const { return count_; }

  /// The next point's position in the file's coordinates, metres; false after the last one. Throws InputError if the
  /// file cannot be read.
  bool next(Vector3& position);

  /// Points ignored so far.
  std::int64_t left_out() const { return left_out_; }

 private:
  [[noreturn]] void fail(const std::string& what) const;
  void read_header();
  bool is_left_out(const std::uint8_t* point) const;

  std::string path_;
  std::ifstream stream_;
  int format_ = 0;
  std::size_t point_bytes_ = 0;
  std::uint64_t count_ = 0;
  std::uint64_t read_ = 0;  ///< points taken from the file into part_
  std::array<double, 3> scale_{};
  std::array<double, 3> offset_{};
  std::vector<std::uint8_t> part_;
  std::size_t at_ = 0;  ///< byte of the next point in part_
  std::int64_t left_out_ = 0;
};

}  // namespace lodestone
