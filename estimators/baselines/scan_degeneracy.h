#pragma once

#include "core/observability/degeneracy.h"
#include "estimators/factory.h"

namespace lodestone {

/// What the scan of `bundle` alone observes at `state`, the state at the scan's end, by point-to-plane distances and
/// the marginal rule. For estimators without an analysis of their own: without it, health takes every direction for
/// observed (docs/design/050-health.md). The input must have a cloud map, the bundle IMU samples.
Degeneracy scan_degeneracy(const EstimatorInput& input, const ScanBundle& bundle, const NavState& state);

/// The same for an estimate at the scan's end, into its diagnostics. Nothing without scan, IMU samples or cloud map.
void judge_degeneracy(const EstimatorInput& input, const ScanBundle& bundle, Estimate& estimate);

}  // namespace lodestone
