#pragma once

#include "frontends/configuration/sensor_choice.h"
#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// Reports topics of the platform that are missing or have another type, with the best topic of the log; topics of
/// known types that the platform does not use; and messages that cannot be decoded. A missing topic that is not
/// `needed` is a note.
Findings check_topics(const LogSample& sample, const Platform& platform, SensorChoice needed = {});

}  // namespace lodestone
