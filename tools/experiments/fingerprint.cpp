#include "tools/experiments/fingerprint.h"

#include <fmt/format.h>

#include "frontends/configuration/text_file.h"

namespace lodestone::reproduce {

void Fingerprint::add_bytes(std::string_view bytes) {
  for (const char byte : bytes) {
    state_ ^= static_cast<unsigned char>(byte);
    state_ *= 1099511628211ULL;
  }
}

Fingerprint& Fingerprint::add(std::string_view text) {
  add_bytes(fmt::format("{}:", text.size()));
  add_bytes(text);
  return *this;
}

Fingerprint& Fingerprint::add_file(const std::string& path) {
  return add(read_text_file(path));
}

std::string Fingerprint::to_string() const {
  return fmt::format("{:016x}", state_);
}

}  // namespace lodestone::reproduce
