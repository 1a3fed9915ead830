#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/geometry/so3.h"
#include "frontends/configuration/output_file.h"

namespace lodestone {

/// Writes a point cloud of any size in pieces. The name's ending decides the format: PCD with floats (.pcd), or PLY
/// with doubles (.ply), both binary. The file appears under its name with `commit`; without it, the destructor deletes
/// it. Throws InputError if the file cannot be written, or has another ending.
class PointCloudWriter {
 public:
  /// `origin_m` is added to all positions. A PCD must not have one: floats are centimetres apart at coordinates of a
  /// country.
  explicit PointCloudWriter(const std::string& path, Vector3 origin_m = Vector3::Zero());

  void add(std::span<const Eigen::Vector3f> positions);

  /// Completes the header, closes and renames.
  void commit();

  std::int64_t count() const { return count_; }

 private:
  std::string header() const;

  Vector3 origin_m_;
  bool is_ply_;
  OutputFile file_;
  std::int64_t count_ = 0;
  std::vector<Vector3> piece_;
};

/// Writes positions as a binary PCD under a temporary name and renames it. Throws InputError.
void write_point_cloud(const std::string& path, const std::vector<Eigen::Vector3f>& points);

}  // namespace lodestone
