#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/mapping/windowed_regression.h"

namespace lodestone {

/// Predictions of a sliding-window regression for points that come in order of their y: windows are solved row by row,
/// each once, and memory holds the points of a few rows alone. The results do not depend on how often `complete_below`
/// is called, nor on threads.
class GprSweep {
 public:
  using Emit = std::function<void(std::int64_t tag, const FieldPrediction& prediction)>;

  /// `emit` is called once a point, in no particular order, by the thread that sweeps.
  GprSweep(const WindowedRegression& regression, Emit emit) : regression_(regression), emit_(std::move(emit)) {}

  /// A point (map, metres) that the regression supports. Tags tell points apart, and give their order in a window's
  /// solve.
  void add(const Vector3& point, std::int64_t tag);

  /// Points to come lie at `y` or above: solves the windows that no longer depend on them.
  void complete_below(double y);

  /// Solves the rest.
  void finish();

  std::size_t waiting() const { return points_.size(); }

 private:
  struct Point {
    Vector3 position;
    std::int64_t tag;
    FieldPrediction prediction;
    int unsolved;  ///< windows
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
