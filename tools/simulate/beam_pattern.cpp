#include "tools/simulate/beam_pattern.h"

#include <cmath>
#include <numbers>

#include "core/angles.h"

namespace lodestone::simulation {
namespace {

constexpr double turn = 2.0 * std::numbers::pi;

// The rosette's constants are measured from the scan pattern that Livox publishes for the Mid-360
// (livox_laser_simulation, scan_mode/mid360.csv; 50 000 firings of four lines per second): the azimuth decreases by one
// turn in 282.0 firings; the zenith angle of the fan's middle goes from 42 to 94 degrees in 50 ms and back; the lines
// are 2.0 (low) to 2.8 degrees (high) apart where the fan is upright, and change order on the other side. The model
// keeps the lines 2.5 degrees apart; its middle line stays within 3 degrees of the published one.
constexpr int rosette_lines = 4;
constexpr double line_spacing_deg = 2.5;
constexpr double turns_hz = 177.309;
// Assumption: the turns per nod are a noble number (17.72; published: 17.7). Fractions approximate noble numbers worst:
// the tracks of each nod fall between those of all earlier nods.
constexpr double turns_a_nod = 18.0 - 1.0 / (2.0 + std::numbers::phi);

}  // namespace

BeamPattern::BeamPattern(const LidarOptions& options)
    : pattern_(options.pattern), first_scan_s_(options.first_scan_s), rate_hz_(options.rate_hz) {
  if (pattern_ == LidarPattern::rotating) {
    firings_ = options.columns;
    lines_ = options.rows;
    const double field_of_view = options.vertical_field_of_view_deg * degree;
    for (int row = 0; row < lines_; ++row) {
      const double share = lines_ > 1 ? static_cast<double>(row) / (lines_ - 1) : 0.5;
      const double elevation = field_of_view * (0.5 - share);
      line_directions_.emplace_back(std::cos(elevation), 0.0, std::sin(elevation));
    }
    return;
  }
  lines_ = rosette_lines;
  firings_ = static_cast<int>(std::lround(options.points_per_second / (rosette_lines * options.rate_hz)));
  const double half_fan_deg = 0.5 * (rosette_lines - 1) * line_spacing_deg;
  for (int line = 0; line < lines_; ++line) {
    const double angle = (line * line_spacing_deg - half_fan_deg) * degree;
    line_directions_.emplace_back(std::sin(angle), 0.0, std::cos(angle));
  }
  const double nearest_zenith_deg = 90.0 - options.highest_elevation_deg + half_fan_deg;
  const double farthest_zenith_deg = 90.0 - options.lowest_elevation_deg - half_fan_deg;
  nod_center_rad_ = 0.5 * (nearest_zenith_deg + farthest_zenith_deg) * degree;
  nod_swing_rad_ = 0.5 * (farthest_zenith_deg - nearest_zenith_deg) * degree;
}

double BeamPattern::seconds(int scan, int firing) const {
  return first_scan_s_ + (scan + static_cast<double>(firing) / firings_) / rate_hz_;
}

void BeamPattern::directions(int scan, int firing, std::span<Vector3> beams) const {
  if (pattern_ == LidarPattern::rotating) return rotating(firing, beams);
  rosette(seconds(scan, firing), beams);
}

void BeamPattern::rotating(int firing, std::span<Vector3> beams) const {
  // The head starts at azimuth 180° (behind) and turns clockwise seen from above.
  const double azimuth = std::numbers::pi - 2.0 * std::numbers::pi * firing / firings_;
  const double cosine = std::cos(azimuth), sine = std::sin(azimuth);
  for (int line = 0; line < lines_; ++line) {
    const Vector3& d = line_directions_[line];
    beams[line] = Vector3(d.x() * cosine, d.x() * sine, d.z());
  }
}

void BeamPattern::rosette(double seconds, std::span<Vector3> beams) const {
  const double azimuth = -turn * std::fmod(turns_hz * seconds, 1.0);
  const double nod = turn * std::fmod(turns_hz / turns_a_nod * seconds, 1.0);
  // Two counter-rotating wedges of deflection c and s: the zenith angle dwells at its ends as in the published pattern.
  const double c = nod_center_rad_, s = nod_swing_rad_;
  const double zenith = std::sqrt(c * c + s * s - 2.0 * c * s * std::cos(nod));
  const Vector3 middle(std::sin(zenith) * std::cos(azimuth), std::sin(zenith) * std::sin(azimuth), std::cos(zenith));
  const Vector3 mirror = (Vector3::UnitZ() - middle).normalized();  // reflects the beam on the axis into `middle`
  for (int line = 0; line < lines_; ++line) {
    const Vector3& d = line_directions_[line];
    beams[line] = d - 2.0 * d.dot(mirror) * mirror;
  }
}

}  // namespace lodestone::simulation
