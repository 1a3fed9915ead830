#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/time.h"

namespace lodestone {

/// How much something found in a log matters.
enum class Severity {
  error,    ///< a run would be refused, lost or wrong
  warning,  ///< a run would be worse than it need be
  note      ///< worth knowing; also on a log without fault
};

/// One thing that a check saw.
struct Finding {
  Severity severity = Severity::note;
  std::string kind;  ///< a short stable name in the form part.what, for example "imu.gap"
  std::string seen;  ///< one line: topic, numbers with their units
  std::string
      change;  ///< the line of the configuration to change, or what else to do; empty where nothing is to be done
  std::optional<Time> time = std::nullopt;                 ///< when it was seen first
  std::optional<std::size_t> magnetometer = std::nullopt;  ///< index, where it concerns but one
};

using Findings = std::vector<Finding>;

/// What another part of the house refuses, as a finding: an InputError ends with what to change, after its last
/// semicolon.
inline Finding error_finding(const std::string& kind, const InputError& error) {
  const std::string text = error.what();
  const std::size_t cut = text.rfind("; ");
  if (cut == std::string::npos) return {Severity::error, kind, text, ""};
  return {Severity::error, kind, text.substr(0, cut), text.substr(cut + 2)};
}

inline bool has_error(const Findings& findings) {
  return std::any_of(findings.begin(), findings.end(),
                     [](const Finding& one) { return one.severity == Severity::error; });
}

/// Whether there is a finding of this kind, at least so severe.
inline bool has(const Findings& findings, const std::string& kind, Severity at_least) {
  return std::any_of(findings.begin(), findings.end(),
                     [&](const Finding& one) { return one.kind == kind && one.severity <= at_least; });
}

inline void append(Findings& findings, Findings more) {
  findings.insert(findings.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

}  // namespace lodestone
