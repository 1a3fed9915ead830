#pragma once

#include <vector>

#include "bindings/bindings.h"
#include "core/sensor_suite.h"
#include "estimators/estimate.h"
#include "factors/calibration_estimate.h"

namespace lodestone::python {

/// Estimates as a dict of arrays; the keys are the fields of lodestone.Estimates.
py::dict arrays_of(const std::vector<Estimate>& estimates);

/// The columns of diagnostics.csv (docs/user/diagnostics.md), by their names. NaN: not measured.
py::dict diagnostics_of(const std::vector<Estimate>& estimates);

/// A calibration as nested dicts; magnetometers by name.
py::dict dict_of(const CalibrationEstimate& calibration, const SensorSuite& suite);

}  // namespace lodestone::python
