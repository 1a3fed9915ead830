#include "frontends/maps/thickness_record.h"

#include <algorithm>
#include <bit>

namespace lodestone {

namespace {

constexpr std::size_t kHalf = 1 << 16;

/// The first entry at which the running sum exceeds `rank`. `rank` becomes the rank within that entry.
std::size_t locate(const std::vector<std::int64_t>& counts, std::int64_t& rank) {
  std::size_t i = 0;
  for (; i + 1 < counts.size() && rank >= counts[i]; ++i) rank -= counts[i];
  return i;
}

}  // namespace

ThicknessRecord::ThicknessRecord(const std::string& folder) : spool_(folder), upper_counts_(kHalf, 0) {}

void ThicknessRecord::add(const std::vector<float>& thickness) {
  // Non-negative floats have the same order as their bits.
  for (const float value : thickness) ++upper_counts_[std::bit_cast<std::uint32_t>(value) >> 16];
  spool_.append(thickness.data(), thickness.size() * sizeof(float));
}

template <class Use>
void ThicknessRecord::for_each(Use use) const {
  std::vector<float> part(1 << 16);
  const std::int64_t count = size();
  for (std::int64_t begin = 0; begin < count; begin += static_cast<std::int64_t>(part.size())) {
    const auto length = static_cast<std::size_t>(std::min(count - begin, static_cast<std::int64_t>(part.size())));
    spool_.read(begin * static_cast<std::int64_t>(sizeof(float)), part.data(), length * sizeof(float));
    std::for_each_n(part.begin(), length, use);
  }
}

float ThicknessRecord::of_rank(std::size_t wanted) const {
  if (spool_.size() == 0) return 0.0F;
  auto rank = static_cast<std::int64_t>(wanted);
  const auto upper = static_cast<std::uint32_t>(locate(upper_counts_, rank));
  std::vector<std::int64_t> lower_counts(kHalf, 0);
  for_each([&](float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    if (bits >> 16 == upper) ++lower_counts[bits & 0xFFFFU];
  });
  return std::bit_cast<float>(upper << 16 | static_cast<std::uint32_t>(locate(lower_counts, rank)));
}

std::int64_t ThicknessRecord::count_up_to(double limit) const {
  std::int64_t count = 0;
  for_each([&](float value) { count += static_cast<double>(value) <= limit ? 1 : 0; });
  return count;
}

}  // namespace lodestone
