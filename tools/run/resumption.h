#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "tools/run/run_call.h"
#include "tools/run/run_identity.h"

namespace lodestone {

/// OUT/checkpoint/NAME.estimates: the estimates of an estimator that has ended. The folder exists from a call's begin
/// until all of its results are written.
std::filesystem::path recording_of(const RunCall& call, const std::string& estimator);

/// Makes OUT/checkpoint and writes there what the call is made from. Without --resume the folder is empty otherwise;
/// with
/// --resume the recordings of this very call stay. If all results of this very call are there already, returns the exit
/// code that the call ended with. Throws InputError, naming what differs, if the recordings are of another call.
std::optional<int> begin_or_resume(const RunCall& call, const RunIdentity& identity);

/// Removes OUT/checkpoint. Throws InputError if the folder holds a file that no run wrote.
void remove_recordings(const RunCall& call);

}  // namespace lodestone
