#pragma once

#include <filesystem>
#include <vector>

#include "core/evaluation/association.h"
#include "core/geometry/so3.h"

namespace lodestone {

/// The error of one scan's pose against the ground truth.
struct ErrorRow {
  Time time = 0;                         ///< the scan's end
  Vector3 position_m = Vector3::Zero();  ///< estimate − ground truth, map axes
  double norm_m = 0.0;
  double heading_deg = 0.0;       ///< −180 to 180, about the map's z
  double position_sigma_m = 0.0;  ///< √ of the trace of the position covariance
};

/// The rows of `pairs`. `covariances`: 6×6, one per pair, order φ, p; rad² and m².
/// Throws std::invalid_argument if the sizes differ.
std::vector<ErrorRow> error_rows(const PosePairs& pairs, const std::vector<Matrix6>& covariances);

/// Writes errors.csv: a header row, then one row per scan. Throws InputError if the file cannot be written.
void write_errors(const std::filesystem::path& path, const std::vector<ErrorRow>& rows);

/// Reads errors.csv; rows are optional. Throws InputError with the line if the format is wrong.
std::vector<ErrorRow> read_errors(const std::filesystem::path& path);

}  // namespace lodestone
