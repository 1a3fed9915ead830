#pragma once

namespace lodestone {

/// Restarts the measurement of the process's peak memory, so that each estimator has its own figure. If the kernel does
/// not support this, the peak is that of the whole process.
void reset_peak_memory();

/// Peak resident memory since `reset_peak_memory` or the program's begin, MB (10⁶ bytes); 0 if unknown.
double peak_memory_mb();

}  // namespace lodestone
