#pragma once

#include <vector>

#include "core/magnetometer/array_reading.h"
#include "core/magnetometer/magnetic_map.h"
#include "estimators/initialization/place_search.h"

namespace lodestone {

/// Places at which one array's readings fit the magnetic map and `points` the cloud map: wherever on the levels of
/// `search` the map has field, every 0.15 m. Gravity being known, the direction of the horizontal field gives the
/// heading, so that only places need to be tried. Best first by both together, none within 0.3 m and 10° of a better
/// one, up to a hundred. `attitude`: of the imu at yaw 0; `height_m`: of the imu above the floor. This
/// finds what LiDAR cannot tell apart: a place on an open floor, or along a corridor.
std::vector<Place> search_field(const ArrayReading& array, const Quaternion& attitude, double height_m,
                                const MagneticMap& map, const PlaceSearch& search, std::span<const SearchPoint> points);

}  // namespace lodestone
