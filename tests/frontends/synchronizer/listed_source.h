#pragma once

#include <utility>
#include <vector>

#include "core/measurement_source.h"

namespace lodestone::testing {

/// A source of given measurements.
class ListedSource : public MeasurementSource {
 public:
  explicit ListedSource(std::vector<Measurement> measurements) : measurements_(std::move(measurements)) {}
  bool next(Measurement& measurement) override {
    if (next_ == measurements_.size()) return false;
    measurement = measurements_[next_++];
    return true;
  }
  Time begin_time() const override { return 0; }
  Time end_time() const override { return 0; }

 private:
  std::vector<Measurement> measurements_;
  std::size_t next_ = 0;
};

}  // namespace lodestone::testing
