#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/options.h"
#include "core/time.h"

namespace lodestone {

/// Severity of a finding.
enum class Severity {
  error,    ///< a run would be refused, lost or wrong
  warning,  ///< a run would be worse than necessary
  note      ///< information; also on healthy logs
};

constexpr auto enum_names(Severity) {
  return EnumNames<Severity, 3>{{{Severity::error, "error"}, {Severity::warning, "warning"}, {Severity::note, "note"}}};
}

/// One result of a check.
struct Finding {
  Severity severity = Severity::note;
  std::string kind;    ///< a short stable name in the form part.what, for example "imu.gap"
  std::string seen;    ///< one line: topic, numbers with their units
  std::string change;  ///< the line of the configuration to change, or another remedy; empty if there is none
  std::optional<Time> time = std::nullopt;                 ///< of the first occurrence
  std::optional<std::size_t> magnetometer = std::nullopt;  ///< index, if it concerns a single one
};

using Findings = std::vector<Finding>;

/// Converts an InputError to a finding. The text after the error's last semicolon is what to change.
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

/// True if there is a finding of this kind with at least this severity.
inline bool has(const Findings& findings, const std::string& kind, Severity at_least) {
  return std::any_of(findings.begin(), findings.end(),
                     [&](const Finding& one) { return one.kind == kind && one.severity <= at_least; });
}

inline void append(Findings& findings, Findings more) {
  findings.insert(findings.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

}  // namespace lodestone
