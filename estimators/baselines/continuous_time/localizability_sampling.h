#pragma once

#include <cstddef>
#include <deque>
#include <span>
#include <vector>

#include "core/geometry/so3.h"

namespace lodestone {

/// What one point-to-plane residual observes of the pose.
struct ObservedDirections {
  Vector3 translation = Vector3::Zero();  ///< normal of the plane, unit, map axes; zero: the point has no plane
  Vector3 rotation = Vector3::Zero();     ///< lever arm × normal, unit or zero, map axes
};

/// Localizability-aware sampling of points. The three directions of translation and the three of rotation are the
/// eigenvectors of Σ d dᵀ over this window and the windows before. The contribution of a point to a direction v is
/// |dᵀ v|. In each direction, points are kept, the largest contribution first, until the sum reaches a limit. Where
/// large contributions do not suffice, all points with a contribution are kept. Source: Shen et al., CTE-MLO (IEEE
/// Transactions on Field Robotics 2025), and the authors' program (docs/design/057-continuous-time.md).
class LocalizabilitySampling {
 public:
  /// `least`: the limit of a direction's sum. `windows`: the number of windows that the sum covers, this one included.
  LocalizabilitySampling(double least, int windows) : least_(least), windows_(windows) {}

  /// Indices of the points to keep, in ascending order. Remembers what they observe for the next windows.
  std::vector<std::size_t> sample(std::span<const ObservedDirections> points);

 private:
  double least_;
  int windows_;
  std::deque<std::vector<ObservedDirections>> before_;  // kept points of the windows before
};

}  // namespace lodestone
