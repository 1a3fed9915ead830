#pragma once

#include <vector>

#include "core/time.h"

namespace lodestone {

/// Whether the stamps of one stream can be believed, beside the recorder's clock. Taken at its word, one stamp in the
/// far future would make all that follow look late.
class StampOrder {
 public:
  struct Verdict {
    enum What { sound, broken, recorder_leapt } what = sound;
    double off_s =
        0.0;  ///< of a broken stamp, from where the recorder's clock expects it; of the recorder's clock, its leap
  };

  StampOrder() = default;

  /// `first_lags`: record time less stamp of the stream's first messages, of which some may be odd. Lags that a tenth
  /// of them have, and two at least, are good ones, that which most have is the usual one; without any the first
  /// message that is judged gives it.
  explicit StampOrder(std::vector<Time> first_lags);

  /// A stamp is broken where it is more than 10 s off the recorder's clock, unless it goes on from the last one that
  /// was taken while that clock alone leaps (it was set, or the recorder stood still): from there on both of its
  /// readings are good.
  Verdict judge(Time record_time, Time stamp);

  /// This one counts as the last.
  void take(Time record_time, Time stamp);

  bool any() const { return any_; }
  Time last_stamp() const { return last_stamp_; }
  Time usual_lag() const { return lags_.empty() ? 0 : lags_.front(); }

 private:
  std::vector<Time> lags_;  ///< of the recorder's clock behind the stamps: the usual one, and those after leaps
  Time last_stamp_ = 0;
  Time last_record_time_ = 0;
  bool any_ = false;
};

}  // namespace lodestone
