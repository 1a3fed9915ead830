#pragma once

#include <cmath>
#include <cstdio>
#include <string>

#include "core/error.h"

namespace lodestone {

/// Bounds of option values, for the check() of option structs: each function throws InputError with key, bound and
/// value.
namespace option_checks {

inline std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%g", value);
  return text;
}

inline void fail(const std::string& key, const std::string& expected, double value) {
  throw InputError(key + ": expected " + expected + ", found " + short_number(value));
}

inline void positive(const std::string& key, double value) {
  if (!(value > 0.0 && std::isfinite(value))) fail(key, "a number above zero", value);
}

inline void not_negative(const std::string& key, double value) {
  if (!(value >= 0.0 && std::isfinite(value))) fail(key, "a number of at least zero", value);
}

inline void within(const std::string& key, double value, double least, double most) {
  if (!(value >= least && value <= most)) {
    fail(key, "a number from " + short_number(least) + " to " + short_number(most), value);
  }
}

}  // namespace option_checks
}  // namespace lodestone
