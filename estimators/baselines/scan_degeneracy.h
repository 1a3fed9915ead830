#pragma once

#include "core/lidar/plane_map_source.h"
#include "core/observability/degeneracy.h"
#include "estimators/factory.h"

namespace lodestone {

/// Whether the map can number the voxels of a scan at this position. False if the position is not finite.
bool has_voxels_around(const PlaneMapSource& planes, const Vector3& position);

/// Degeneracy of the pose by the point-to-plane information of one scan, with the default limit of the sigma; options
/// under `degeneracy` do not apply. For estimators without an analysis of their own: health needs it
/// (docs/design/050-health.md). `estimate`: at the scan's end, with its covariance. Without points, and if the estimate
/// is not finite or far beyond any map, nothing is observed. The input must have a cloud map.
Degeneracy scan_degeneracy(const EstimatorInput& input, const ScanBundle& bundle, const Estimate& estimate);

/// Writes the same, and how many directions the scan does not observe at all, to the estimate's diagnostics.
void set_degeneracy(const EstimatorInput& input, const ScanBundle& bundle, Estimate& estimate);

}  // namespace lodestone
