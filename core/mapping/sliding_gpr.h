#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/mapping/field_survey.h"
#include "core/mapping/gaussian_process.h"

namespace lodestone {

struct SlidingGprOptions {
  int window_points = 350;          ///< most training cells of a window
  double window_length_scales = 1.25;  ///< distance of window centres, in length scales
  double margin_length_scales = 2.0;   ///< training cells reach so far beyond a window's support
  double reach_length_scales = 1.5;    ///< no field further than this from every training cell
  double cells_per_length_scale = 8.0;  ///< thinning is no coarser: averaging smooths the field (l/4 shows)
  int fit_windows = 12;             ///< windows whose likelihood chooses the hyperparameters
  int fit_points = 200;             ///< training cells of each of them
  int seed = 1;                     ///< which windows these are
  double calibration_block_s = 4.0;  ///< blocks of time that calibrate the noise, see fit_field_kernels; 0: none
  double scale_prior_points = 50.0;  ///< weight of the map-wide variance against a window's own; see SlidingGpr

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("window_points", window_points, "most training cells of one window");
    visitor.field("window_length_scales", window_length_scales, "distance of window centres in length scales");
    visitor.field("margin_length_scales", margin_length_scales, "training margin round a window in length scales");
    visitor.field("reach_length_scales", reach_length_scales, "no field further from the survey, in length scales");
    visitor.field("cells_per_length_scale", cells_per_length_scale, "thinning of the survey");
    visitor.field("fit_windows", fit_windows, "windows used to fit the hyperparameters");
    visitor.field("fit_points", fit_points, "training cells of each of these");
    visitor.field("seed", seed, "chooses the windows for the fit");
    visitor.field("calibration_block_s", calibration_block_s,
                  "length of the blocks of time whose prediction from the rest calibrates the noise; 0: no calibration");
    visitor.field("scale_prior_points", scale_prior_points, "weight of the map-wide variance against a window's own");
  }

  /// Throws InputError where a value is out of range.
  void check() const;
};

/// One kernel a component, in µT.
using FieldKernels = std::array<KernelParameters, 3>;

/// What the survey says of the field's kernels.
struct FieldKernelFit {
  FieldKernels kernels;
  double cell_m = 0.0;  ///< voxel side that the noise sigma of the kernels refers to
  int windows = 0;
  int evaluations = 0;
  Vector3 uncalibrated_noise = Vector3::Zero();  ///< noise_sigma of the likelihood alone, µT
};

/// Fits one set of hyperparameters a component by marginal likelihood on a deterministic choice of windows. The survey
/// is thinned to voxels of `finest_cell_m`, or coarser where the length scale allows (options.cells_per_length_scale).
/// The likelihood takes errors of the survey that are alike along a stretch (a turn's calibration error, a stamp that is
/// late, a drift) for structure of the field; only another pass tells them apart. So the noise is then calibrated: some
/// blocks of time are predicted from the rest, and where they miss by more than predicted the noise is raised.
/// Surveys without stamps, or without a second pass, keep the likelihood's noise. Throws InputError where there are fewer
/// than 10 cells.
FieldKernelFit fit_field_kernels(const std::vector<FieldObservation>& observations, double finest_cell_m,
                                 const SlidingGprOptions& options);

struct FieldPrediction {
  Vector3 field_ut = Vector3::Zero();
  Vector3 sigma_ut = Vector3::Zero();  ///< one sigma of the field itself, measurement noise not included
  bool supported = false;              ///< false: further than the reach from every training cell; the rest is void
};

/// Sliding-window Gaussian-process regression (s-GPR, Lyu et al. 2024): exact regression in square windows of the
/// x-y plane that overlap by half; where they overlap the posteriors are blended by C¹ weights that sum to one, so that
/// no seam shows. The variance is that of the mixture: it contains how far the windows disagree.
/// One kernel cannot fit racks and open floor alike: each window's variance is scaled by its own squared Mahalanobis
/// distance per point where that exceeds one, shrunk towards one by `scale_prior_points`; the posterior mean does not
/// change.
class SlidingGpr {
 public:
  /// Throws std::invalid_argument without cells.
  SlidingGpr(std::vector<FieldCell> cells, const FieldKernels& kernels, const SlidingGprOptions& options);

  /// The field at `points` (map, metres). The same bits on any number of threads.
  std::vector<FieldPrediction> predict(const std::vector<Vector3>& points) const;

  /// Posteriors of one window at points of its support: N×3 each, a column a component.
  struct WindowPrediction {
    Eigen::MatrixX3d mean;      ///< µT
    Eigen::MatrixX3d variance;  ///< µT²
  };
  WindowPrediction solve_window(std::int64_t row, std::int64_t column, const std::vector<Vector3>& points) const;

  /// Windows' centres lie at whole numbers of these coordinates (column, row); those of supported points are positive.
  Eigen::Vector2d window_coordinates(const Vector3& point) const {
    return {(point.x() - origin_x()) / stride_, (point.y() - origin_y()) / stride_};
  }

  /// No prediction further than this (metres, in the x-y plane) from every cell.
  double reach_m() const { return reach_; }

  /// True within the reach of a cell, in the x-y plane.
  bool supports(const Vector3& point) const;

 private:
  // Windows' centres lie one stride beyond the reach all round.
  double origin_x() const { return min_x_ - reach_ - stride_; }
  double origin_y() const { return min_y_ - reach_ - stride_; }
  std::vector<int> training_cells(double centre_x, double centre_y) const;
  /// Calls `visit(index)` for every cell in buckets that overlap the box, in a fixed order.
  template <class Visit>
  bool any_in_box(double min_x, double min_y, double max_x, double max_y, Visit&& visit) const;

  std::vector<FieldCell> cells_;
  FieldKernels kernels_;
  SlidingGprOptions options_;
  double stride_ = 0.0;   ///< distance of window centres; a window's support is twice this a side
  double margin_ = 0.0;
  double reach_ = 0.0;
  double min_x_ = 0.0;
  double min_y_ = 0.0;
  int bucket_columns_ = 0;
  int bucket_rows_ = 0;
  std::vector<int> bucket_begin_;  ///< first entry of each bucket (side: the stride) in bucket_cells_
  std::vector<int> bucket_cells_;
};

}  // namespace lodestone
