#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/mapping/windowed_regression.h"

namespace lodestone {

/// Predictions of a sliding-window regression for points in ascending order of y. Windows are solved once, row by row.
/// Memory contains the points of a few rows only. The results depend neither on the calls of `complete_below` nor on
/// the number of threads.
class GprSweep {
 public:
  using Emit = std::function<void(std::int64_t tag, const FieldPrediction& prediction)>;

  /// `emit` is called once per point, in no particular order, by the calling thread.
  GprSweep(const WindowedRegression& regression, Emit emit) : regression_(regression), emit_(std::move(emit)) {}

  /// Adds a point (map, metres) that the regression supports. Tags identify points, and give their order in a window's
  /// solve.
  void add(const Vector3& point, std::int64_t tag);

  /// Promises that later points have this `y` or more. Solves the windows that no longer depend on them.
  void complete_below(double y);

  /// Solves the remaining windows.
  void finish();

  std::size_t waiting() const { return points_.size(); }

 private:
  struct Point {
    Vector3 position;
    std::int64_t tag;
    FieldPrediction prediction;
    int unsolved;  ///< number of windows
  };
  /// One point in one window.
  struct Membership {
    std::int64_t row;  ///< of the window's centre
    std::int64_t column;
    std::int64_t tag;
    std::size_t point;
    double weight;
    Vector3 mean;
    Vector3 variance;
  };
  void solve_up_to(std::int64_t row);
  void emit_solved();

  const WindowedRegression& regression_;
  Emit emit_;
  std::vector<Point> points_;
  std::vector<Membership> unsolved_;
  std::vector<Membership> solved_;
};

}  // namespace lodestone
