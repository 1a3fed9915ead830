#include "core/mapping/gpr_sweep.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/parallel.h"

namespace lodestone {
namespace {

/// Weight of a window at a distance of `share` strides from its centre, per axis. C¹, with w(s) + w(1 − s) = 1.
double blend_weight(double share) {
  return 1.0 - share * share * (3.0 - 2.0 * share);
}

}  // namespace

void GprSweep::add(const Vector3& point, std::int64_t tag) {
  const Eigen::Vector2d place = regression_.window_coordinates(point);
  const auto column = static_cast<std::int64_t>(std::floor(place.x()));
  const auto row = static_cast<std::int64_t>(std::floor(place.y()));
  int windows = 0;
  for (int step_row = 0; step_row < 2; ++step_row) {
    for (int step_column = 0; step_column < 2; ++step_column) {
      const double weight = blend_weight(std::abs(place.x() - static_cast<double>(column + step_column))) *
                            blend_weight(std::abs(place.y() - static_cast<double>(row + step_row)));
      if (weight <= 0.0) continue;
      ++windows;
      unsolved_.push_back(
          {row + step_row, column + step_column, tag, points_.size(), weight, Vector3::Zero(), Vector3::Zero()});
    }
  }
  FieldPrediction nothing;
  nothing.supported = true;
  points_.push_back({point, tag, nothing, windows});
}

void GprSweep::complete_below(double y) {
  // Points to come belong to windows of this row and above.
  solve_up_to(static_cast<std::int64_t>(std::floor(regression_.window_coordinates({0.0, y, 0.0}).y())) - 1);
}

void GprSweep::finish() {
  solve_up_to(std::numeric_limits<std::int64_t>::max());
}

void GprSweep::solve_up_to(std::int64_t row) {
  const auto later = std::stable_partition(unsolved_.begin(), unsolved_.end(),
                                           [row](const Membership& membership) { return membership.row <= row; });
  std::vector<Membership> now(unsolved_.begin(), later);
  unsolved_.erase(unsolved_.begin(), later);
  const auto window_of = [](const Membership& membership) { return std::tie(membership.row, membership.column); };
  std::sort(now.begin(), now.end(), [](const Membership& a, const Membership& b) {
    return std::tie(a.row, a.column, a.tag) < std::tie(b.row, b.column, b.tag);
  });
  std::vector<std::size_t> begins;
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (i == 0 || window_of(now[i]) != window_of(now[i - 1])) begins.push_back(i);
  }
  begins.push_back(now.size());
  parallel_for(std::size_t{0}, begins.size() - 1, [&](std::size_t index) {
    const std::size_t begin = begins[index];
    const std::size_t end = begins[index + 1];
    std::vector<Vector3> targets;
    for (std::size_t i = begin; i < end; ++i) targets.push_back(points_[now[i].point].position);
    WindowedRegression::WindowPrediction prediction =
        regression_.solve_window(now[begin].row, now[begin].column, targets);
    for (std::size_t i = begin; i < end; ++i) {
      now[i].mean = prediction.mean.row(static_cast<Eigen::Index>(i - begin));
      now[i].variance = prediction.variance.row(static_cast<Eigen::Index>(i - begin));
    }
  });
  for (const Membership& membership : now) --points_[membership.point].unsolved;
  solved_.insert(solved_.end(), now.begin(), now.end());
  emit_solved();
}

void GprSweep::emit_solved() {
  // The sum follows the order of the windows, row by row, and not the order in which threads finished.
  for (const Membership& membership : solved_) {
    Point& point = points_[membership.point];
    if (point.unsolved == 0) point.prediction.field_ut += membership.weight * membership.mean;
  }
  for (const Membership& membership : solved_) {
    Point& point = points_[membership.point];
    if (point.unsolved > 0) continue;
    point.prediction.sigma_ut +=
        membership.weight * (membership.variance + (membership.mean - point.prediction.field_ut).cwiseAbs2());
  }
  std::vector<std::size_t> place(points_.size());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].unsolved > 0) {
      place[i] = kept;
      points_[kept++] = points_[i];
      continue;
    }
    place[i] = std::numeric_limits<std::size_t>::max();
    points_[i].prediction.sigma_ut = points_[i].prediction.sigma_ut.cwiseSqrt();
    emit_(points_[i].tag, points_[i].prediction);
  }
  points_.resize(kept);
  const auto move = [&](std::vector<Membership>& memberships) {
    std::erase_if(memberships, [&](const Membership& membership) {
      return place[membership.point] == std::numeric_limits<std::size_t>::max();
    });
    for (Membership& membership : memberships) membership.point = place[membership.point];
  };
  move(solved_);
  move(unsolved_);
}

}  // namespace lodestone
