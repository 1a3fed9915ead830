#pragma once

#include <cstdint>
#include <vector>

#include "frontends/maps/spool_file.h"

namespace lodestone {

/// Exact quantiles of the thickness of all planes of a map with bounded memory: values on disk, ranked by the upper and
/// then by the lower half of their bits.
class ThicknessRecord {
 public:
  explicit ThicknessRecord(const std::string& folder);

  /// Non-negative values, metres.
  void add(const std::vector<float>& thickness);

  std::int64_t size() const { return spool_.size() / static_cast<std::int64_t>(sizeof(float)); }

  /// The value of this rank in ascending order, as in std::nth_element; 0 if there is none.
  float of_rank(std::size_t wanted) const;

  /// Number of values up to `limit`.
  std::int64_t count_up_to(double limit) const;

 private:
  template <class Use>
  void for_each(Use use) const;

  SpoolFile spool_;
  std::vector<std::int64_t> upper_counts_;
};

}  // namespace lodestone
