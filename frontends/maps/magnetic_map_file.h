#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/magnetometer/magnetic_map.h"

namespace lodestone {

/// Origin of a map, as names and values, kept in its file.
using Provenance = std::vector<std::pair<std::string, std::string>>;

/// A magnetic map consists of two files, as in map_server:
///
///   field.yaml   resolution_m, origin_m [x, y], heights_m [z, …], unit (microtesla), frame, max_sigma_ut,
///                error_correlation_m and sigma_shares [x, y, z] (if known), image, provenance
///   field.tif    float32 pages of one size: B_x, B_y, B_z, σ of the lowest layer, then of the next
///
/// A pixel is a node. The first row of a page has the largest y, so that QGIS and ImageJ show the map with y up;
/// origin_m is the centre of the lower left pixel. NaN marks nodes without field. The image is deflated in tiles, so
/// that regions without survey need little space, and has a georeference for QGIS.
///
/// Writes both (the image is `yaml_path` with .tif) under temporary names and renames them. `tile`: pixels per side of
/// a tile, a multiple of 16. Throws InputError if this fails.
void write_magnetic_map(const MagneticMap& map, const Provenance& provenance, const std::string& yaml_path,
                        int tile = 64);

/// Default memory of a map that is read from a file, bytes.
constexpr std::size_t default_magnetic_map_bytes = 64U << 20U;

/// Opens both; the nodes have the same bits as written. Nodes are read on demand, and up to `max_bytes` of them stay in
/// memory. Also supports images in strips or without compression. `origin_m` is subtracted from the nodes' positions,
/// which are then rounded to a micrometre: what is shifted there and back is what it was. Throws InputError if a file
/// is missing, cut off or malformed, a key is unknown or missing, a unit is unknown, or the pages are not four per
/// layer, of equal size, float32.
MagneticMap read_magnetic_map(const std::string& yaml_path, std::size_t max_bytes = default_magnetic_map_bytes,
                              const Vector3& origin_m = Vector3::Zero());

/// The image file named by the map's YAML. Throws InputError if the YAML cannot be read or names no image.
std::string image_of_magnetic_map(const std::string& yaml_path);

/// "at 0.600 m height" or "8 layers from 0.000 to 1.050 m height".
std::string heights_text(const FieldGrid& grid);

}  // namespace lodestone
