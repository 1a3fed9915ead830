#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "estimators/options.h"
#include "tools/run/run_call.h"

namespace lodestone {

/// What a run's bytes depend on, by name: the program, the log, maps and files, every option. Not the number of
/// threads, on which nothing depends.
using RunIdentity = std::vector<std::pair<std::string, std::string>>;

constexpr std::uint64_t kHashOfNothing = 14695981039346656037ULL;

/// FNV-1a, 64 bits, continued from `hash`. Finds damage; protects against nobody.
std::uint64_t hash_of(std::string_view bytes, std::uint64_t hash = kHashOfNothing);

/// Of a call with the options in force. Small files are told by their content, logs and maps by size and time of
/// change.
RunIdentity identify(const RunCall& call, const RunOptions& options);

/// Sixteen hexadecimal digits that stand for all of it.
std::string digest(const RunIdentity& identity);

/// The first part that differs, with both values; empty where none does.
std::string difference_between(const RunIdentity& written, const RunIdentity& now);

}  // namespace lodestone
