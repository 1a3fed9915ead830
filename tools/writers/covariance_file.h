#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/geometry/so3.h"
#include "core/time.h"

namespace lodestone {

struct StampedCovariance {
  Time time = 0;
  Matrix6 covariance = Matrix6::Zero();  ///< tangent order φ (right, body; rad), p (map; m)
};

/// The header of covariance.csv, with its newline: t_s and the 21 upper entries, row by row.
std::string covariance_header();

/// One row of covariance.csv, with its newline; nine significant digits.
std::string covariance_row(Time time, const Matrix6& covariance);

/// Reads covariance.csv. Throws InputError with the line if the format is wrong.
std::vector<StampedCovariance> read_covariances(const std::filesystem::path& path);

}  // namespace lodestone
