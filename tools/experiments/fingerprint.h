#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lodestone::reproduce {

/// An incremental hash (FNV-1a, 64 bits) of all inputs of a step. It detects changed inputs; it is not cryptographic.
class Fingerprint {
 public:
  /// Adds `text` and its length: "ab", "c" differs from "a", "bc".
  Fingerprint& add(std::string_view text);

  /// Adds the bytes of a file. Throws InputError if the file cannot be read.
  Fingerprint& add_file(const std::string& path);

  /// Sixteen hexadecimal digits.
  std::string to_string() const;

 private:
  void add_bytes(std::string_view bytes);
  std::uint64_t state_ = 14695981039346656037ULL;
};

}  // namespace lodestone::reproduce
