#pragma once

#include <map>
#include <utility>

#include "tools/experiments/plan.h"

namespace lodestone::reproduce {

/// How long steps take: a guess at first, then what steps of the same kind took, best in the same world.
class StepTimes {
 public:
  void learn(const Step& step, double seconds);

  /// Seconds that `step` will take.
  double expected(const Step& step) const;

 private:
  struct Mean {
    double seconds = 0.0;
    double parts = 0.0;
  };
  std::map<std::pair<StepKind, std::string>, Mean> known_;  ///< by kind and world; the empty world: all of them
};

}  // namespace lodestone::reproduce
