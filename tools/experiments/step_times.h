#pragma once

#include <map>
#include <utility>

#include "tools/experiments/plan.h"

namespace lodestone::reproduce {

/// Expected duration of steps: first a guess, then the mean of finished steps of the same kind, if possible in the same
/// world.
class StepTimes {
 public:
  void learn(const Step& step, double seconds);

  /// Expected seconds of `step`.
  double expected(const Step& step) const;

 private:
  struct Mean {
    double seconds = 0.0;
    double parts = 0.0;
  };
  std::map<std::pair<StepKind, std::string>, Mean> known_;  ///< by kind and world; empty world: all worlds
};

}  // namespace lodestone::reproduce
