#pragma once

#include <vector>

#include "core/magnetometer/array_reading.h"
#include "core/magnetometer/magnetic_map.h"
#include "estimators/initialization/place_search.h"

namespace lodestone {

/// Places at which one array's readings fit the magnetic map and `points` fit the cloud map, searched every 0.15 m on
/// the levels of `search` wherever the map has field. Gravity is known, so the horizontal field gives the heading and
/// only positions are searched. First up to 100 places, those with the largest likelihood of both; then up to 50 by
/// the field alone, because a scan may see only what is not on the map. No two are within 0.3 m and 10°. `attitude`:
/// of the imu at yaw 0; `height_m`: of the imu above the floor. Resolves what LiDAR cannot: a place on an open floor
/// or along a corridor.
std::vector<Place> search_field(const ArrayReading& array, const Quaternion& attitude, double height_m,
                                const MagneticMap& map, const PlaceSearch& search, std::span<const SearchPoint> points);

}  // namespace lodestone
