#pragma once

#include <string>
#include <utility>
#include <vector>

#include "estimators/options.h"
#include "tools/run/run_call.h"

namespace lodestone {

/// All inputs that determine a run's bytes, by name: program, log, maps, files, options. Not the number of threads.
using RunIdentity = std::vector<std::pair<std::string, std::string>>;

/// The identity of a call with its final options. Small files are identified by content, logs and maps by size and
/// modification time.
RunIdentity identify(const RunCall& call, const RunOptions& options);

/// Hash of an identity, sixteen hexadecimal digits.
std::string digest(const RunIdentity& identity);

/// The first difference, with both values; empty if there is none.
std::string difference_between(const RunIdentity& written, const RunIdentity& now);

}  // namespace lodestone
