#pragma once

#include "frontends/configuration/sensor_choice.h"
#include "tools/check/finding.h"
#include "tools/check/log_sample.h"

namespace lodestone {

/// Topics of the platform that the log has not, or has with another type, each with the topic of the log that fits
/// best; topics of known types that the platform does not name; messages that cannot be decoded. What `needed` leaves
/// out may be missing: that is a note.
Findings check_topics(const LogSample& sample, const Platform& platform, SensorChoice needed = {});

}  // namespace lodestone
