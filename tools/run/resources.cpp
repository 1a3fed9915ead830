#include "tools/run/resources.h"

#include <sys/resource.h>

#include <fstream>
#include <string>

#include "frontends/configuration/number_text.h"
#include "frontends/csv_text.h"

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

}  // namespace lodestone
