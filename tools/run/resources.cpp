#include "tools/run/resources.h"

#include <sys/resource.h>
#include <tbb/global_control.h>

#include <fstream>
#include <optional>
#include <string>

#include "frontends/configuration/number_text.h"
#include "frontends/logs/csv/csv_text.h"

// Debian's alternatives select OpenBLAS or BLIS at installation. Either may be absent.
extern "C" void openblas_set_num_threads(int) __attribute__((weak));
extern "C" void bli_thread_set_num_threads(long) __attribute__((weak));

namespace lodestone {

void reset_peak_memory() {
  std::ofstream("/proc/self/clear_refs") << "5";
}

double peak_memory_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    const std::vector<std::string_view> words = split_cells(line, ' ');
    double kib = 0.0;  // in kB of the kernel (1024 bytes)
    if (words.size() == 3 && words[0] == "VmHWM:" && parse_number(words[1], kib)) return kib * 1.024e-3;
  }
  rusage usage{};
  return getrusage(RUSAGE_SELF, &usage) == 0 ? static_cast<double>(usage.ru_maxrss) * 1.024e-3 : 0.0;
}

struct ThreadLimit::Control {
  std::optional<tbb::global_control> limit;
};

ThreadLimit::ThreadLimit(int threads) : control_(std::make_unique<Control>()) {
  if (threads > 0) {
    control_->limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  }
  if (openblas_set_num_threads != nullptr) openblas_set_num_threads(1);
  if (bli_thread_set_num_threads != nullptr) bli_thread_set_num_threads(1);
}

ThreadLimit::~ThreadLimit() = default;

}  // namespace lodestone
