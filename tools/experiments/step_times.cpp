#include "tools/experiments/step_times.h"

namespace lodestone::reproduce {

namespace {

/// For a drive of three minutes on one core.
double first_guess_s(StepKind kind) {
  switch (kind) {
    case StepKind::cloud:
      return 15.0;
    case StepKind::log:
      return 35.0;
    case StepKind::field:
      return 40.0;
    case StepKind::difference:
      return 3.0;
    case StepKind::run:
      break;
  }
  return 25.0;
}

}  // namespace

void StepTimes::learn(const Step& step, double seconds) {
  for (const std::string& world : {step.world_name, std::string()}) {
    Mean& mean = known_[{step.kind, world}];
    mean.seconds += seconds;
    mean.parts += static_cast<double>(step.parts);
  }
}

double StepTimes::expected(const Step& step) const {
  const double parts = static_cast<double>(step.parts);
  for (const std::string& world : {step.world_name, std::string()}) {
    const auto found = known_.find({step.kind, world});
    if (found != known_.end()) return found->second.seconds / found->second.parts * parts;
  }
  return first_guess_s(step.kind) * parts;
}

}  // namespace lodestone::reproduce
