#pragma once

namespace lodestone {

/// A small office and a drive of a second and a half with few beams: many runs take seconds.
inline constexpr const char* office_world = R"(
name: office
earth_field_ut: [20, 0, -40]
start_time_s: 1700000000
sensors:
  lidar: {rows: 8, columns: 256, min_range_m: 0.1, max_range_m: 40}
cloud: {point_spacing_m: 0.1}
solids:
  - {shape: box, at_m: [0, 0, 1.5], size_m: [14, 10, 3]}
  - {shape: box, at_m: [2, 3, 1], size_m: [1, 2, 2]}
sequences:
  short: {waypoints_m: [[-2, -2], [3, -2]], speed: [[0, 1.5]], rest_s: 0.5}
)";

}  // namespace lodestone
