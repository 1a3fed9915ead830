#pragma once

#include "frontends/configuration/platform.h"
#include "tools/check/finding.h"

namespace lodestone {

/// Checks what the platform file states about mountings: values that nobody measured, and two magnetometers at one
/// place. A log alone shows no wrong lever arm. `needed`: sensors that the run reads.
Findings check_mountings(const Platform& platform, SensorChoice needed);

}  // namespace lodestone
