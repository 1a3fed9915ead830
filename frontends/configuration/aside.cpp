#include "frontends/configuration/aside.h"

#include <unistd.h>

namespace lodestone {

namespace {

constexpr const char* kMark = ".partial-";

}  // namespace

std::string aside_name(const std::string& path) {
  return path + kMark + std::to_string(getpid());
}

bool is_aside_name(const std::string& name) {
  return name.find(kMark) != std::string::npos;
}

}  // namespace lodestone
