#pragma once

#include <string>

#include "frontends/configuration/platform.h"

namespace lodestone {

/// Removes all magnetometers from `platform` but those of `choice`; readings of the others are ignored. `choice` is
/// "all", names separated by commas, or a number N: N magnetometers as far apart as possible, first the one farthest
/// from the array's centre, then always the one farthest from those chosen (the choice for N contains that for N − 1).
/// The order of the platform is kept. Throws InputError for an unknown name or a wrong number.
void choose_magnetometers(const std::string& choice, Platform& platform);

}  // namespace lodestone
