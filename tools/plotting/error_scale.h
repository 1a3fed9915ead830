#pragma once

#include <vector>

#include "tools/plotting/axes.h"

namespace lodestone::figures {

/// An axis for errors of several methods: linear from 0 on where the largest is below 15 times the smallest median,
/// else logarithmic. Both ends are 1, 2 or 5 times a power of ten. Beyond 100 m nothing is shown: lost is lost.
Scale error_scale(const std::vector<std::vector<double>>& errors_m);

/// The same, always logarithmic.
Scale logarithmic_error_scale(const std::vector<std::vector<double>>& errors_m);

}  // namespace lodestone::figures
