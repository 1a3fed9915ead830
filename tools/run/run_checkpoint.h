#pragma once

#include <chrono>
#include <filesystem>
#include <sstream>
#include <string>

#include "estimators/estimator.h"
#include "tools/run/growing_file.h"
#include "tools/run/pass_state.h"
#include "tools/run/run_identity.h"

namespace lodestone {

/// Lets one estimator's pass over a log be killed at any moment and taken up again. Of each pass a folder holds
/// - NAME.state, where it stood last: it appears whole or stays what it was;
/// - NAME.estimates, what its sink was told, and NAME.keyframes, what its estimator keeps for good: they only grow, so that a
///   long log does not write them again and again. NAME.state says how much of them counts.
/// As a sink it takes down what the pass is told.
class RunCheckpoint final : public EstimateSink {
 public:
  /// Into `folder`, which is there. `interval_s`: from one to the next. `identity`: what the results depend on.
  RunCheckpoint(const std::filesystem::path& folder, const std::string& estimator, double interval_s, RunIdentity identity);

  /// Whether there is one to go on from.
  bool exists() const;

  /// Takes up the last one: where the pass stood. Throws InputError, one line that names what differs, where it is of
  /// another call, and where it is damaged.
  PassState read();

  /// After `read`: gives `estimator` its state, but what it has to recall, and tells `sink` all that it was told.
  void restore(Estimator& estimator, EstimateSink& sink);

  void causal(const Estimate& estimate) override { take_down(Told::causal, estimate); }
  void best(const Estimate& estimate) override { take_down(Told::best, estimate); }
  void smoothed(const Estimate& estimate) override { take_down(Told::smoothed, estimate); }

  /// Whether the interval has gone by since the last one.
  bool due() const;

  /// Writes one. Throws InputError where the disk does not take it; the last one then stays.
  void write(Estimator& estimator, const PassState& pass);

 private:
  using Clock = std::chrono::steady_clock;
  enum class Told : std::uint8_t { causal, best, smoothed };
  void take_down(Told what, const Estimate& estimate);

  std::filesystem::path state_path_;
  GrowingFile estimates_;
  GrowingFile keyframes_;
  double interval_s_;
  RunIdentity identity_;
  std::ostringstream told_;  // since the last one
  Clock::time_point last_ = Clock::now();
  std::string estimator_state_;  // as read
  std::string told_before_;
  std::string lasting_before_;
};

}  // namespace lodestone
