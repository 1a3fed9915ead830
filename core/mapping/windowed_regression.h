#pragma once

#include <cstdint>
#include <vector>

#include "core/mapping/field_survey.h"

namespace lodestone {

struct SlidingGprOptions {
  int window_points = 350;              ///< most training cells of a window (s-GPR; curl-free takes all)
  double window_length_scales = 1.25;   ///< distance of window centres, in length scales
  double margin_length_scales = 2.0;    ///< training cells reach so far beyond a window's support
  double reach_length_scales = 1.5;     ///< no field further than this from every training cell
  double cells_per_length_scale = 8.0;  ///< thinning is no coarser: averaging smooths the field (l/4 shows)
  int fit_windows = 12;                 ///< windows whose likelihood chooses the hyperparameters
  int fit_points = 200;                 ///< training cells of each of them
  int seed = 1;                         ///< which windows these are
  double calibration_block_s = 4.0;     ///< blocks of time that calibrate the noise, see fit_field_kernels; 0: none
  double scale_prior_points = 50.0;  ///< weight of the map-wide variance against a window's own; see WindowedRegression
  double domain_margin_length_scales =
      1.5;                    ///< curl-free: the basis functions' box reaches so far beyond the training cells
  double basis_cutoff = 5.0;  ///< curl-free: wave numbers of the basis, times the length scale

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("window_points", window_points, "most training cells of one window (s-gpr; curl-free takes all)");
    visitor.field("window_length_scales", window_length_scales, "distance of window centres in length scales");
    visitor.field("margin_length_scales", margin_length_scales, "training margin round a window in length scales");
    visitor.field("reach_length_scales", reach_length_scales, "no field further from the survey, in length scales");
    visitor.field("cells_per_length_scale", cells_per_length_scale, "thinning of the survey");
    visitor.field("fit_windows", fit_windows, "windows used to fit the hyperparameters");
    visitor.field("fit_points", fit_points, "training cells of each of these");
    visitor.field("seed", seed, "chooses the windows for the fit");
    visitor.field(
        "calibration_block_s", calibration_block_s,
        "length of the blocks of time whose prediction from the rest calibrates the noise; 0: no calibration");
    visitor.field("scale_prior_points", scale_prior_points, "weight of the map-wide variance against a window's own");
    visitor.field("domain_margin_length_scales", domain_margin_length_scales,
                  "curl-free: margin of the basis functions' box round the training cells, in length scales");
    visitor.field(
        "basis_cutoff", basis_cutoff,
        "curl-free: largest wave number of the basis, over the length scale; cost grows with its sixth power");
  }

  /// Throws InputError where a value is out of range.
  void check() const;
};

struct FieldPrediction {
  Vector3 field_ut = Vector3::Zero();
  Vector3 sigma_ut = Vector3::Zero();  ///< one sigma of the field itself, measurement noise not included
  bool supported = false;              ///< false: further than the reach from every training cell; the rest is void
};

/// Regression of a survey in square windows of the x-y plane that overlap by half; where they overlap the posteriors
/// are blended by C¹ weights that sum to one, so that no seam shows. The variance is that of the mixture: it contains
/// how far the windows disagree. What a window makes of its cells is the derived class's. One kernel cannot fit racks
/// and open floor alike: each window's variance is scaled by its own squared Mahalanobis distance per value where that
/// exceeds one, shrunk towards one by `scale_prior_points`; the posterior mean does not change.
class WindowedRegression {
 public:
  virtual ~WindowedRegression() = default;

  /// The field at `points` (map, metres). The same bits on any number of threads.
  std::vector<FieldPrediction> predict(const std::vector<Vector3>& points) const;

  /// Posteriors of one window at points of its support: N×3 each, a column a component.
  struct WindowPrediction {
    Eigen::MatrixX3d mean;      ///< µT
    Eigen::MatrixX3d variance;  ///< µT²
  };
  virtual WindowPrediction solve_window(std::int64_t row, std::int64_t column,
                                        const std::vector<Vector3>& points) const = 0;

  /// Windows' centres lie at whole numbers of these coordinates (column, row); those of supported points are positive.
  Eigen::Vector2d window_coordinates(const Vector3& point) const {
    return {(point.x() - origin_x()) / stride_, (point.y() - origin_y()) / stride_};
  }

  /// No prediction further than this (metres, in the x-y plane) from every cell.
  double reach_m() const { return reach_; }

  /// True within the reach of a cell, in the x-y plane.
  bool supports(const Vector3& point) const;

 protected:
  /// Windows are spaced by the shortest length scale; training cells lie within a margin that the longest asks for.
  /// Throws std::invalid_argument without cells.
  WindowedRegression(std::vector<FieldCell> cells, double shortest_length_scale_m, double longest_length_scale_m,
                     const SlidingGprOptions& options);

  const std::vector<FieldCell>& cells() const { return cells_; }
  const SlidingGprOptions& options() const { return options_; }

  /// Map, metres; z = 0.
  Vector3 window_centre(std::int64_t row, std::int64_t column) const;

  /// Half a side of the square that holds a window's training cells.
  double training_half_side_m() const { return stride_ + margin_; }

  /// Those within that square, nearest to the window's centre first, at most `most`.
  std::vector<int> training_cells(const Vector3& centre, std::size_t most) const;

  /// What a window's variance is scaled by; `squared_mahalanobis` of its `values`.
  double variance_scale(double squared_mahalanobis, std::size_t values) const;

 private:
  // Windows' centres lie one stride beyond the reach all round.
  double origin_x() const { return min_x_ - reach_ - stride_; }
  double origin_y() const { return min_y_ - reach_ - stride_; }
  /// Calls `visit(index)` for every cell in buckets that overlap the box, in a fixed order.
  template <class Visit>
  bool any_in_box(double min_x, double min_y, double max_x, double max_y, Visit&& visit) const;

  std::vector<FieldCell> cells_;
  SlidingGprOptions options_;
  double stride_ = 0.0;  ///< distance of window centres; a window's support is twice this a side
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
