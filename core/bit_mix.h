#pragma once

#include <cstdint>

namespace lodestone {

/// The finalizer of SplitMix64 (Steele et al. 2014): a bijection of 64 bits in which every input bit affects every
/// output bit.
constexpr std::uint64_t mix(std::uint64_t value) {
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9ULL;
  value = (value ^ (value >> 27)) * 0x94d049bb133111ebULL;
  return value ^ (value >> 31);
}

}  // namespace lodestone
