#pragma once

#include <vector>

#include "core/time.h"

namespace lodestone {

/// Checks the stamps of one stream against the recorder's clock. Without this check, a single stamp in the far future
/// would make all later messages seem late.
class StampOrder {
 public:
  struct Verdict {
    enum What { sound, broken, recorder_leapt } what = sound;
    double off_s =
        0.0;  ///< of a broken stamp, from where the recorder's clock expects it; of the recorder's clock, its leap
  };

  StampOrder() = default;

  /// `first_lags`: record time minus stamp of the stream's first messages, which may contain outliers. Lags that a
  /// tenth of them have, but at least two, are valid; the most frequent is the usual one. If empty, the first message
  /// that is checked defines the lag.
  explicit StampOrder(std::vector<Time> first_lags);

  /// A stamp is broken if it is more than 10 s off the recorder's clock. Exception: the stamps are continuous and only
  /// the recorder's clock jumps (it was set, or the recorder was suspended); from then on both lags are valid.
  Verdict judge(Time record_time, Time stamp);

  /// Stores this message as the last valid one.
  void take(Time record_time, Time stamp);

  bool any() const { return any_; }
  Time last_stamp() const { return last_stamp_; }
  Time usual_lag() const { return lags_.empty() ? 0 : lags_.front(); }

 private:
  std::vector<Time> lags_;  ///< valid lags of the recorder's clock: the usual one, then those after jumps
  Time last_stamp_ = 0;
  Time last_record_time_ = 0;
  bool any_ = false;
};

}  // namespace lodestone
