#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lodestone {

constexpr std::uint64_t kHashOfNothing = 14695981039346656037ULL;

/// FNV-1a, 64 bits, continued from `hash`. Detects damage and changes; not cryptographic.
std::uint64_t hash_of(std::string_view bytes, std::uint64_t hash = kHashOfNothing);

/// An incremental hash of several texts.
class Fingerprint {
 public:
  /// Adds `text` and its length: "ab", "c" differs from "a", "bc".
  Fingerprint& add(std::string_view text);

  /// Adds the bytes of a file. Throws InputError if the file cannot be read.
  Fingerprint& add_file(const std::string& path);

  /// Sixteen hexadecimal digits.
  std::string to_string() const;

 private:
  std::uint64_t state_ = kHashOfNothing;
};

}  // namespace lodestone
