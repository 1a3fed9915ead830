#pragma once

#include <filesystem>
#include <optional>

#include "tools/run/run_call.h"
#include "tools/run/run_identity.h"

namespace lodestone {

/// OUT/checkpoint. It is there from a call's begin until all of its results are: as long as it is the call has not ended.
std::filesystem::path checkpoint_folder(const RunCall& call);

/// Makes the folder, empty unless the call resumes. With --resume tells what becomes of it; where all results of this very
/// call are there already gives the exit code that it ended with. Throws InputError, naming what differs, where the
/// checkpoints are of another call.
std::optional<int> begin_or_go_on(const RunCall& call, const RunIdentity& identity);

/// All results are there.
void forget_checkpoints(const RunCall& call);

}  // namespace lodestone
