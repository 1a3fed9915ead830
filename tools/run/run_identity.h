#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "estimators/options.h"
#include "tools/run/run_call.h"

namespace lodestone {

/// All inputs that determine a run's bytes, by name: program, log, maps, files, options. Not the number of threads.
using RunIdentity = std::vector<std::pair<std::string, std::string>>;

constexpr std::uint64_t kHashOfNothing = 14695981039346656037ULL;

/// FNV-1a, 64 bits, continued from `hash`. Detects damage; not cryptographic.
std::uint64_t hash_of(std::string_view bytes, std::uint64_t hash = kHashOfNothing);

/// The identity of a call with its final options. Small files are identified by content, logs and maps by size and
/// modification time.
RunIdentity identify(const RunCall& call, const RunOptions& options);

/// Hash of an identity, sixteen hexadecimal digits.
std::string digest(const RunIdentity& identity);

/// The first difference, with both values; empty if there is none.
std::string difference_between(const RunIdentity& written, const RunIdentity& now);

}  // namespace lodestone
