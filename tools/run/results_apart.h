#pragma once

#include "tools/run/run_call.h"

namespace lodestone {

/// Throws InputError where the results of a run would take the place of what it reads, or would be read as a part of
/// it: --out in the log's own folder, or an input among the files that a run writes to --out.
void check_results_apart(const RunCall& call);

}  // namespace lodestone
