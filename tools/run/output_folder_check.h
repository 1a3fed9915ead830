#pragma once

#include <filesystem>

#include "tools/run/run_call.h"

namespace lodestone {

/// Whether a run may write this file, relative to its folder of results.
bool is_run_output(const std::filesystem::path& in_out);

/// Throws InputError if the results of a run would replace an input or would be read as a part of it: --out in the
/// log's folder, or an input among the files that a run writes to --out. Also if such a file exists in a folder that
/// has neither results nor recordings of a run.
void check_output_folder(const RunCall& call);

}  // namespace lodestone
