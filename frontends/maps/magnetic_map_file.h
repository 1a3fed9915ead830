#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/magnetometer/magnetic_map.h"

namespace lodestone {

/// Where a map came from, name and value, kept in its file for people.
using Provenance = std::vector<std::pair<std::string, std::string>>;

/// A magnetic map is two files beside each other, in map_server's habit:
///
///   field.yaml   resolution_m, origin_m [x, y], heights_m [z, …], unit (microtesla), frame, max_sigma_ut, image,
///                provenance
///   field.tif    float32 pages of one size: B_x, B_y, B_z, σ of the lowest layer, then of the next
///
/// A pixel is a node. As pictures have it, the first row of a page is the one of the largest y, so that QGIS and ImageJ
/// show the map with y up; origin_m is the centre of the lower left pixel. NaN marks nodes without field. The image is
/// deflated in tiles, so that what was not surveyed takes next to nothing, and carries its place for QGIS.
///
/// Writes both (the image is `yaml_path` with .tif), each aside and then renamed. `tile`: pixels a side of a tile, a
/// multiple of 16. Throws InputError where that fails.
void write_magnetic_map(const MagneticMap& map, const Provenance& provenance, const std::string& yaml_path,
                        int tile = 64);

/// What a map read from a file takes in memory unless told otherwise, bytes.
constexpr std::size_t default_magnetic_map_bytes = 64U << 20U;

/// Opens both, to the same bits that were written; nodes are read when a query comes to them, and up to `max_bytes` of
/// them stay in memory. Images in strips or without compression, as other programs write them, do as well. Throws
/// InputError where a file is missing, cut off or malformed, a key is misspelt or missing, a unit is unknown, or the
/// pages are not four a layer, of one size, float32.
MagneticMap read_magnetic_map(const std::string& yaml_path, std::size_t max_bytes = default_magnetic_map_bytes);

/// The image that the map's YAML names. Throws InputError where it cannot be read or names none.
std::string image_of_magnetic_map(const std::string& yaml_path);

}  // namespace lodestone
