#include "tools/run/fingerprint.h"

#include <fmt/format.h>

#include "frontends/configuration/text_file.h"

namespace lodestone {

std::uint64_t hash_of(std::string_view bytes, std::uint64_t hash) {
  for (const char byte : bytes) {
    hash ^= static_cast<unsigned char>(byte);
    hash *= 1099511628211ULL;
  }
  return hash;
}

Fingerprint& Fingerprint::add(std::string_view text) {
  state_ = hash_of(text, hash_of(fmt::format("{}:", text.size()), state_));
  return *this;
}

Fingerprint& Fingerprint::add_file(const std::string& path) {
  return add(read_text_file(path));
}

std::string Fingerprint::to_string() const {
  return fmt::format("{:016x}", state_);
}

}  // namespace lodestone
