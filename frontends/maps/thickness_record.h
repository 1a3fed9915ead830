#pragma once

#include <cstdint>
#include <vector>

#include "frontends/maps/spool_file.h"

namespace lodestone {

/// The thickness of every plane of a map, of which exact ranks are wanted in memory that does not grow with the map:
/// values on disk, ranked by the upper and then by the lower half of their bits.
class ThicknessRecord {
 public:
  explicit ThicknessRecord(const std::string& folder);

  /// Values of at least zero, metres.
  void add(const std::vector<float>& thickness);

  std::int64_t size() const { return spool_.size() / static_cast<std::int64_t>(sizeof(float)); }

  /// The value of this rank from below, as std::nth_element has it; 0 where there is none.
  float of_rank(std::size_t wanted) const;

  /// How many are at most `limit`.
  std::int64_t count_up_to(double limit) const;

 private:
  template <class Use>
  void for_each(Use use) const;

  SpoolFile spool_;
  std::vector<std::int64_t> upper_counts_;
};

}  // namespace lodestone
