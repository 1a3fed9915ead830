#pragma once

#include <cstdint>
#include <vector>

#include "core/mapping/field_survey.h"

namespace lodestone {

struct SlidingGprOptions {
  int window_points = 350;              ///< most training cells of a window (s-GPR; curl-free uses all)
  double window_length_scales = 1.25;   ///< spacing of window centres, in length scales
  double margin_length_scales = 2.0;    ///< margin of training cells around a window's support
  double reach_length_scales = 1.5;     ///< no field farther than this from the nearest training cell
  double cells_per_length_scale = 8.0;  ///< limit of thinning: averaging smooths the field (l/4 is too coarse)
  int fit_windows = 12;                 ///< windows whose likelihood chooses the hyperparameters
  int fit_points = 200;                 ///< training cells of each of these windows
  int seed = 1;                         ///< random choice of these windows
  double calibration_block_m = 6.0;     ///< blocks of way that calibrate the errors, see fit_field_kernels; 0: none
  double scale_prior_points = 50.0;     ///< weight of the map-wide variance against the window's
  double domain_margin_length_scales =
      1.5;                    ///< curl-free: margin of the basis functions' box around the training cells
  double basis_cutoff = 5.0;  ///< curl-free: largest wave number of the basis, times the length scale

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("window_points", window_points, "most training cells of one window (s-gpr; curl-free uses all)");
    visitor.field("window_length_scales", window_length_scales, "spacing of window centres in length scales");
    visitor.field("margin_length_scales", margin_length_scales,
                  "margin of training cells around a window in length scales");
    visitor.field("reach_length_scales", reach_length_scales,
                  "no field farther than this from the survey, in length scales");
    visitor.field("cells_per_length_scale", cells_per_length_scale,
                  "the survey is thinned to at least this many cells per length scale");
    visitor.field("fit_windows", fit_windows, "windows used to fit the hyperparameters");
    visitor.field("fit_points", fit_points, "training cells of each of these windows");
    visitor.field("seed", seed, "seed of the choice of windows for the fit");
    visitor.field("calibration_block_m", calibration_block_m,
                  "length of held-out blocks of way that calibrate the survey's errors; 0: no calibration");
    visitor.field("scale_prior_points", scale_prior_points,
                  "weight of the map-wide variance against the window's variance");
    visitor.field("domain_margin_length_scales", domain_margin_length_scales,
                  "curl-free: margin of the basis functions' box around the training cells, in length scales");
    visitor.field(
        "basis_cutoff", basis_cutoff,
        "curl-free: largest wave number of the basis, over the length scale; the cost grows with the sixth power");
  }

  /// Throws InputError if a value is out of range.
  void check() const;
};

struct FieldPrediction {
  Vector3 field_ut = Vector3::Zero();
  Vector3 sigma_ut = Vector3::Zero();  ///< of the field, without measurement noise
  bool supported = false;              ///< false: no training cell within the reach; the values are invalid
};

/// Regression of a survey in square windows of the x-y plane that overlap by half. Overlapping posteriors are blended
/// by C¹ weights that sum to one, so that there is no seam. The variance is that of the mixture: it includes the
/// disagreement of the windows. Derived classes solve a window. One kernel cannot fit racks and open floor alike: each
/// window's variance is scaled by its squared Mahalanobis distance per value if that exceeds one, shrunk towards one by
/// `scale_prior_points`. The posterior mean does not change.
class WindowedRegression {
 public:
  virtual ~WindowedRegression() = default;

  /// The field at `points` (map, metres). Same bits on any number of threads.
  std::vector<FieldPrediction> predict(const std::vector<Vector3>& points) const;

  /// Posteriors of one window at points of its support: N×3 each, one column per component.
  struct WindowPrediction {
    Eigen::MatrixX3d mean;      ///< µT
    Eigen::MatrixX3d variance;  ///< µT²
  };
  virtual WindowPrediction solve_window(std::int64_t row, std::int64_t column,
                                        const std::vector<Vector3>& points) const = 0;

  /// Window centres have integer coordinates (column, row). Supported points have positive coordinates.
  Eigen::Vector2d window_coordinates(const Vector3& point) const {
    return {(point.x() - origin_x()) / stride_, (point.y() - origin_y()) / stride_};
  }

  /// Points farther than this (metres, in the x-y plane) from every cell have no prediction.
  double reach_m() const { return reach_; }

  /// True if a cell is within the reach, in the x-y plane.
  bool supports(const Vector3& point) const;

 protected:
  /// The shortest length scale gives the spacing of windows, the longest gives the margin of training cells. Throws
  /// std::invalid_argument without cells.
  WindowedRegression(std::vector<FieldCell> cells, double shortest_length_scale_m, double longest_length_scale_m,
                     const SlidingGprOptions& options);

  const std::vector<FieldCell>& cells() const { return cells_; }
  const SlidingGprOptions& options() const { return options_; }

  /// Map, metres; z = 0.
  Vector3 window_centre(std::int64_t row, std::int64_t column) const;

  /// Half a side of the square of a window's training cells.
  double training_half_side_m() const { return stride_ + margin_; }

  /// The cells within that square, nearest to the window's centre first, at most `most`.
  std::vector<int> training_cells(const Vector3& centre, std::size_t most) const;

  /// Scale of a window's variance, from the `squared_mahalanobis` of its `values`.
  double variance_scale(double squared_mahalanobis, std::size_t values) const;

 private:
  // Window centres begin one stride outside the reach.
  double origin_x() const { return min_x_ - reach_ - stride_; }
  double origin_y() const { return min_y_ - reach_ - stride_; }
  /// Calls `visit(index)` for every cell in buckets that overlap the box, in a fixed order.
  template <class Visit>
  bool any_in_box(double min_x, double min_y, double max_x, double max_y, Visit&& visit) const;

  std::vector<FieldCell> cells_;
  SlidingGprOptions options_;
  double stride_ = 0.0;  ///< spacing of window centres; the side of a window's support is twice the stride
  double margin_ = 0.0;
  double reach_ = 0.0;
  double min_x_ = 0.0;
  double min_y_ = 0.0;
  int bucket_columns_ = 0;
  int bucket_rows_ = 0;
  std::vector<int> bucket_begin_;  ///< first entry of each bucket in bucket_cells_; a bucket's side is the stride
  std::vector<int> bucket_cells_;
};

}  // namespace lodestone
