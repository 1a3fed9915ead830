#include "estimators/mixture/guarded_smoother.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

constexpr double kGate = 16.27;            ///< χ² of three degrees of freedom, 0.999
constexpr double kSeveralPlaces_m = 0.3;   ///< sigma of a mixture with several places
constexpr double kSurerByVariance = 25.0;  ///< than the mixture on the same readings

double position_variance_m2(const Estimate& estimate) {
  return estimate.covariance.diagonal().tail<3>().maxCoeff();
}

bool has_several_places(const Estimate& place) {
  return !(position_variance_m2(place) < kSeveralPlaces_m * kSeveralPlaces_m);
}

}  // namespace

bool contradicts(const Estimate& window, const Estimate& place) {
  const Vector3 apart = window.state.T_map_imu.position - place.state.T_map_imu.position;
  const Matrix3 covariance = window.covariance.bottomRightCorner<3, 3>() + place.covariance.bottomRightCorner<3, 3>();
  if (!(apart.dot(covariance.llt().solve(apart)) < kGate)) return true;
  return has_several_places(place) && position_variance_m2(place) > kSurerByVariance * position_variance_m2(window);
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
  PlaceSink places(*this);
  WindowSink windows(*this);
  mixture_.process(bundle, places);
  smoother_->process(bundle, windows);
  const bool contradicted = contradicts(newest_window_, newest_place_);
  Estimate causal = contradicted ? newest_place_ : newest_window_;
  causal.diagnostics.step_ms = newest_place_.diagnostics.step_ms + newest_window_.diagnostics.step_ms;
  sink.causal(causal);
  report(sink);
  if (wrong_place_ && contradicted && !has_several_places(newest_place_)) begin_again(sink);
}

void GuardedSmoother::report(EstimateSink& sink) {
  report(smoothed_, &EstimateSink::smoothed, sink);
  report(best_, &EstimateSink::best, sink);
}

void GuardedSmoother::report(Pairs& pairs, Emit emit, EstimateSink& sink) {
  while (!pairs.places.empty() && !pairs.windows.empty()) {
    const Estimate& window = pairs.windows.front();
    const Estimate& place = pairs.places.front();
    const bool wrong = contradicts(window, place);
    if (window.time > begun_) wrong_place_ = wrong;
    (sink.*emit)(wrong ? place : window);
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
  initial.position_sigma_m = std::max(initial.position_sigma_m, std::sqrt(position_variance_m2(newest_place_)));
  smoother_ = make_(std::move(input));
  begun_ = newest_place_.time;
  wrong_place_ = false;
}

void GuardedSmoother::finish(EstimateSink& sink) {
  PlaceSink places(*this);
  WindowSink windows(*this);
  mixture_.finish(places);
  smoother_->finish(windows);
  report(sink);
}

const CalibrationEstimate* GuardedSmoother::calibration() const {
  return begun_ < 0 && !wrong_place_ ? smoother_->calibration() : nullptr;
}

}  // namespace lodestone
