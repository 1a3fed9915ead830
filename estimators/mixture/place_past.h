#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "estimators/mixture/place_mixture.h"

namespace lodestone {

/// The places before a scan given those after it: the smoother of Rauch, Tung and Striebel (AIAA Journal 1965) for one
/// component. `before`: after the readings of its scan; `increment`: IMU from there to `after`, which is smoothed.
PlaceComponent smoothed_before(const PlaceComponent& before, const Preintegration& increment,
                               const PlaceComponent& after, const ImuNoise& noise);

/// The last scans of a PlaceMixture, until they are smoothed with the readings after them. Each component of a scan
/// has the weight of those of the newest scan that come from it, and is smoothed along them.
class PlacePast {
 public:
  explicit PlacePast(const ImuNoise& noise) : noise_(noise) {}

  /// The newest scan. `increment`: from the scan before; none if the IMU has a gap.
  void add(std::optional<Preintegration> increment, std::vector<PlaceComponent> places);

  /// Places of the oldest scans, `count` of them, smoothed with the scans up to `last` and weighted by the newest one.
  /// Places that are left by (nearly) all weight are missing. Forgets these scans.
  std::vector<std::vector<PlaceComponent>> take(std::size_t count, std::size_t last);

 private:
  struct Scan {
    std::optional<Preintegration> increment;
    std::vector<PlaceComponent> places;
  };

  void forget_childless();

  ImuNoise noise_;
  std::deque<Scan> scans_;
};

}  // namespace lodestone
