#pragma once

#include <filesystem>
#include <vector>

#include "core/evaluation/association.h"
#include "core/geometry/so3.h"

namespace lodestone {

/// One scan's error against the truth.
struct ErrorRow {
  Time time = 0;                         ///< the scan's end
  Vector3 position_m = Vector3::Zero();  ///< estimate − truth, map axes
  double norm_m = 0.0;
  double heading_deg = 0.0;       ///< −180 to 180, about the map's z
  double position_sigma_m = 0.0;  ///< √ of the trace of the position covariance
};

/// The rows of `pairs`. `covariances`: 6×6, one a pair, order φ, p; rad² and m².
/// Throws std::invalid_argument when the sizes differ.
std::vector<ErrorRow> error_rows(const PosePairs& pairs, const std::vector<Matrix6>& covariances);

/// errors.csv: a header row, then a row a scan. Throws InputError where the file cannot be written.
void write_errors(const std::filesystem::path& path, const std::vector<ErrorRow>& rows);

/// Reads errors.csv; it may be without rows. Throws InputError, naming the line, where it is none.
std::vector<ErrorRow> read_errors(const std::filesystem::path& path);

}  // namespace lodestone
