#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lodestone::reproduce {

/// A running hash (FNV-1a, 64 bits) of everything that a step's result depends on. It tells apart what was made from
/// other input; it protects against nobody.
class Fingerprint {
 public:
  /// Adds `text` and its length, so that "ab", "c" differs from "a", "bc".
  Fingerprint& add(std::string_view text);

  /// Adds the bytes of a file. Throws InputError where it cannot be read.
  Fingerprint& add_file(const std::string& path);

  /// Sixteen hexadecimal digits.
  std::string to_string() const;

 private:
  void add_bytes(std::string_view bytes);
  std::uint64_t state_ = 14695981039346656037ULL;
};

}  // namespace lodestone::reproduce
