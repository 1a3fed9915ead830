#include "core/aside.h"

#include <unistd.h>

namespace lodestone {

std::string aside_name(const std::string& path) { return path + ".partial-" + std::to_string(getpid()); }

}  // namespace lodestone
