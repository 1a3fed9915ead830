#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/magnetometer/magnetic_map.h"
#include "core/mapping/field_kernel_fit.h"
#include "core/mapping/survey_errors.h"

namespace lodestone {

struct MagneticMapOptions {
  FieldMethod method = FieldMethod::sliding_gpr;
  double resolution_m = 0.1;  ///< spacing of the map's nodes
  /// Map z of the layers. Empty: one at the survey's mean sensor height; several where the survey's height varies.
  std::vector<double> heights_m;
  double max_sigma_ut = 0.0;      ///< nodes with larger σ have no field; 0: 0.71 of the signal sigma, and the offsets
  double tile_m = 6.4;            ///< side of the file's tiles, rounded to a multiple of 16 nodes
  double held_out_block_m = 6.0;  ///< every tenth block of way is held out as a test; 0: no test
  /// Prior sigmas of each magnetometer's constant error in its own axes, and of the offset of their clock
  /// (survey_errors); 0: not estimated.
  double offset_sigma_ut = 1.0;
  double clock_sigma_s = 0.05;
  SlidingGprOptions regression;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("method", method,
                  "s-gpr (each component separately) or curl-free (one potential for all components)");
    visitor.field("resolution_m", resolution_m, "spacing of the map's nodes");
    visitor.field("heights_m", heights_m,
                  "map z of the layers; empty: one at the survey's mean sensor height, several if its height varies");
    visitor.field("max_sigma_ut", max_sigma_ut,
                  "nodes with larger sigma have no field; 0: 0.71 of the signal sigma, and the offsets");
    visitor.field("tile_m", tile_m, "side of the image's tiles, rounded to a multiple of 16 nodes");
    visitor.field("held_out_block_m", held_out_block_m,
                  "length of blocks of way; every tenth block is held out to test the regression; 0: no test");
    visitor.field("offset_sigma_ut", offset_sigma_ut,
                  "expected size of each magnetometer's constant error in its own axes, which is found and subtracted; "
                  "0: not estimated");
    visitor.field("clock_sigma_s", clock_sigma_s,
                  "expected size of the offset of the magnetometers' clock, which is found and corrected; 0: not "
                  "estimated");
    visitor.section("regression", regression);
  }

  /// Throws InputError if a value is out of range.
  void check() const;

  int tile_nodes() const;  ///< nodes along one side of a tile
};

struct MagneticMapResult {
  MagneticMap map;
  FieldKernelFit fit;
  std::size_t cells = 0;         ///< training cells after thinning
  std::size_t nodes = 0;         ///< with σ within the limit
  double median_sigma_ut = 0.0;  ///< over these nodes
  double high_sigma_ut = 0.0;    ///< 95 % quantile over these nodes
  /// What the readings were corrected for: offsets of the magnetometers and of their clock.
  SurveyErrors errors;
};

/// Called by the thread that builds a map, with the share of the rows of nodes that are done: 0 while kernels are
/// fitted. What it throws ends the work.
using MapProgress = std::function<void(double share)>;

/// Sigma of the survey's height about a layer up to which one layer serves.
double most_height_sigma_m(const FieldKernelFit& fit);

/// Builds the grid map of a survey. A node's σ is the expected difference of a reading of another drive from the map,
/// without white noise: posterior of the regression and DriveError; the root mean square over the three components. The
/// grid spans the survey and the regression's reach. Its origin is a multiple of the resolution. Throws InputError if
/// the survey is too short, if the grid would exceed 2·10⁸ nodes, or if the method does not support the survey. Memory:
/// 16 bytes per node with field, and the readings.
///
/// Readings are corrected for the offsets of the magnetometers and of their clock if held-out readings are then
/// predicted better (survey_errors.h).
MagneticMapResult build_magnetic_map(const std::vector<FieldObservation>& observations,
                                     const MagneticMapOptions& options, const MapProgress& progress = {});

/// Prediction errors of a regression on held-out readings.
struct HeldOutScore {
  std::size_t cells = 0;                     ///< held-out cells (thinned like the training) with a prediction
  std::size_t refused = 0;                   ///< held-out cells with too large a sigma
  Vector3 rms_ut = Vector3::Zero();          ///< of cell mean minus prediction, per component
  Vector3 normalized_rms = Vector3::Zero();  ///< the same over the predicted sigma; 1 is consistent
};

/// Predicts the held-out cells of a survey, thinned to fit.cell_m, from the rest with the kernels of `fit`. Only
/// predictions with σ up to `max_sigma_ut` count.
HeldOutScore score_held_out(const SurveySplit& split, const FieldKernelFit& fit, double max_sigma_ut,
                            const SlidingGprOptions& options);

/// The same for every tenth stretch of options.held_out_block_m along the survey's way, with the kernels of `result`,
/// which was built from all `observations`. Empty if the length is zero or the survey is too short.
std::optional<HeldOutScore> score_held_out_blocks(const std::vector<FieldObservation>& observations,
                                                  const MagneticMapResult& result, const MagneticMapOptions& options);

}  // namespace lodestone
