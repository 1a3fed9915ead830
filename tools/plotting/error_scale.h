#pragma once

#include <vector>

#include "tools/plotting/axes.h"

namespace lodestone::figures {

/// An axis for errors of several methods: linear from 0 if the largest error is below 15 times the smallest median,
/// otherwise logarithmic. Both ends are 1, 2 or 5 times a power of ten. The axis ends at 100 m: larger errors are lost.
Scale error_scale(const std::vector<std::vector<double>>& errors_m);

/// The same, always logarithmic.
Scale logarithmic_error_scale(const std::vector<std::vector<double>>& errors_m);

}  // namespace lodestone::figures
