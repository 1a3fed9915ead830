#pragma once

#include <string>

#include "frontends/configuration/platform.h"

namespace lodestone {

/// Leaves in `platform` only the magnetometers that `choice` means; the log's other readings are then not read.
/// `choice` is "all", a number N (that many, as far from each other as they come: first the one farthest from the
/// array's centre, then always the one farthest from those that are in; what N - 1 takes is among what N takes), or
/// names with commas. Their order stays that of the platform. Throws InputError for a name that the platform does not
/// have, or a wrong number.
void choose_magnetometers(const std::string& choice, Platform& platform);

}  // namespace lodestone
