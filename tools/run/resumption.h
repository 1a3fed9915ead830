#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "tools/run/run_call.h"
#include "tools/run/run_identity.h"

namespace lodestone {

/// summary.json in a folder of results; no object if there is none.
nlohmann::json summary_in(const std::filesystem::path& out);

/// OUT/checkpoint/NAME.estimates: the estimates of a finished estimator. The folder exists from a call's begin until
/// all results are written.
std::filesystem::path recording_of(const RunCall& call, const std::string& estimator);

/// Creates OUT/checkpoint with the identity of the call. Without --resume, the folder is emptied; with --resume,
/// recordings of the same call are kept. If all results of the same call exist, returns its exit code. Throws
/// InputError with the difference if --resume finds recordings or results of another call.
std::optional<int> begin_or_resume(const RunCall& call, const RunIdentity& identity);

/// Once all results exist: moves the identity of the call to OUT/call.json and removes OUT/checkpoint. Throws
/// InputError if that folder has a file that no run wrote.
void finish_recordings(const RunCall& call);

}  // namespace lodestone
