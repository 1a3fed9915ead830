#include "estimators/mixture/guarded_smoother.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/robust_weight.h"
#include "core/stopwatch.h"

namespace lodestone {

namespace {

constexpr double kProbability = 0.999;     ///< that a pose is within the gate
constexpr double kUnsure_m = 0.3;          ///< sigma of an estimate that knows several places, or none
constexpr double kSurerByVariance = 25.0;  ///< of two estimates by the same readings, one of which is unsure

bool is_unsure(const Estimate& estimate) {
  return !(position_variance_m2(estimate.covariance) < kUnsure_m * kUnsure_m);
}

bool within_gate(const Estimate& a, const Estimate& b, const Matrix6& covariance) {
  const Vector6 apart = a.state.T_map_imu.boxminus(b.state.T_map_imu);
  static const double gate = std::pow(mahalanobis_quantile(6, kProbability), 2);
  return apart.dot(covariance.llt().solve(apart)) < gate;
}

/// What to report of a scan. The mixture has no clock offset, no slip and no odd magnetometers of its own.
Estimate reported(const Estimate& window, const Estimate& place) {
  if (!is_replaced(window, place)) return window;
  Estimate result = place;
  const Diagnostics& of_window = window.diagnostics;
  result.diagnostics.clock_offset_s = of_window.clock_offset_s;
  result.diagnostics.clock_sigma_s = of_window.clock_sigma_s;
  result.diagnostics.wheel_slip = of_window.wheel_slip;
  result.diagnostics.magnetic_set_aside = of_window.magnetic_set_aside;
  result.diagnostics.iterations = of_window.iterations;
  return result;
}

}  // namespace

bool differ(const Estimate& window, const Estimate& place) {
  if (!within_gate(window, place, window.covariance + place.covariance)) return true;
  if (!is_unsure(window) && !is_unsure(place)) return false;
  const auto [surer_m2, other_m2] =
      std::minmax({position_variance_m2(window.covariance), position_variance_m2(place.covariance)});
  return other_m2 > kSurerByVariance * surer_m2;
}

bool is_replaced(const Estimate& window, const Estimate& place) {
  if (!place.covariance.allFinite() || !place.state.T_map_imu.position.allFinite()) return false;
  return differ(window, place) || !within_gate(window, place, place.covariance);
}

class GuardedSmoother::PlaceSink final : public EstimateSink {
 public:
  explicit PlaceSink(GuardedSmoother& owner) : owner_(owner) {}
  void causal(const Estimate& estimate) override { owner_.newest_place_ = estimate; }
  void best(const Estimate& estimate) override {
    owner_.best_.places.push_back(estimate);
    if (owner_.input_.options.smoother.refine != Refinement::none) owner_.smoothed_.places.push_back(estimate);
  }

 private:
  GuardedSmoother& owner_;
};

class GuardedSmoother::WindowSink final : public EstimateSink {
 public:
  explicit WindowSink(GuardedSmoother& owner) : owner_(owner) {}
  void causal(const Estimate& estimate) override { owner_.newest_window_ = estimate; }
  void smoothed(const Estimate& estimate) override { owner_.smoothed_.windows.push_back(estimate); }
  void best(const Estimate& estimate) override { owner_.best_.windows.push_back(estimate); }

 private:
  GuardedSmoother& owner_;
};

GuardedSmoother::GuardedSmoother(EstimatorInput input, Make make)
    : input_(std::move(input)), make_(make), smoother_(make_(input_)), mixture_(input_) {}

void GuardedSmoother::process(const ScanBundle& bundle, EstimateSink& sink) {
  const Stopwatch step;
  PlaceSink places(*this);
  WindowSink windows(*this);
  parallel_for(0, 2, [&](int i) { i == 0 ? mixture_.process(bundle, places) : smoother_->process(bundle, windows); });
  Estimate causal = reported(newest_window_, newest_place_);
  causal.diagnostics.step_ms = step.elapsed_ms();
  sink.causal(causal);
  if (is_unsure(newest_place_) || !differ(newest_window_, newest_place_)) {
    elsewhere_since_.reset();
  } else if (!elsewhere_since_) {
    elsewhere_since_ = causal.time;
  }
  report(sink);
  if (elsewhere_since_ && was_elsewhere_ && *elsewhere_since_ <= *was_elsewhere_) begin_again(sink);
}

void GuardedSmoother::report(EstimateSink& sink) {
  report(smoothed_, &EstimateSink::smoothed, sink);
  report(best_, &EstimateSink::best, sink);
}

void GuardedSmoother::report(Pairs& pairs, Emit emit, EstimateSink& sink) {
  while (!pairs.places.empty() && !pairs.windows.empty()) {
    const Estimate& window = pairs.windows.front();
    const Estimate& place = pairs.places.front();
    if (window.time > begun_ && !is_unsure(place)) {
      was_elsewhere_ = differ(window, place) ? std::optional(window.time) : std::nullopt;
    }
    (sink.*emit)(reported(window, place));
    pairs.places.pop_front();
    pairs.windows.pop_front();
  }
}

void GuardedSmoother::begin_again(EstimateSink& sink) {
  WindowSink windows(*this);
  smoother_->finish(windows);
  report(sink);
  const NavState& state = newest_place_.state;
  if (input_.warnings != nullptr) {
    const Vector3& p = state.T_map_imu.position;
    input_.warnings->add("smoother.wrong_place",
                         fmt::format("later readings show another place; the window begins again at the position "
                                     "{:.2f} {:.2f} {:.2f} at {:.3f} s",
                                     p.x(), p.y(), p.z(), to_seconds(newest_place_.time)),
                         newest_place_.time);
  }
  EstimatorInput input = input_;
  input.initial_pose = state.T_map_imu;
  input.initial_velocity = state.velocity;
  InitialOptions& initial = input.options.initial;
  initial.position_sigma_m =
      std::max(initial.position_sigma_m, std::sqrt(position_variance_m2(newest_place_.covariance)));
  const double turn_sigma_rad = std::sqrt(newest_place_.covariance.diagonal().head<3>().maxCoeff());
  initial.rotation_sigma_deg = std::max(initial.rotation_sigma_deg, turn_sigma_rad * 180.0 / M_PI);
  initial.search_m = 0.0;  // the mixture has searched
  smoother_ = make_(std::move(input));
  begun_ = newest_place_.time;
  elsewhere_since_.reset();
  was_elsewhere_.reset();
}

void GuardedSmoother::finish(EstimateSink& sink) {
  PlaceSink places(*this);
  WindowSink windows(*this);
  mixture_.finish(places);
  smoother_->finish(windows);
  report(sink);
  if (was_elsewhere_ && begun_ < 0 && input_.warnings != nullptr) {
    input_.warnings->add("smoother.wrong_place",
                         "at the end, later readings show another place than the window's: no calibration",
                         *was_elsewhere_);
  }
}

const CalibrationEstimate* GuardedSmoother::calibration() const {
  return begun_ < 0 && !was_elsewhere_ ? smoother_->calibration() : nullptr;
}

}  // namespace lodestone
