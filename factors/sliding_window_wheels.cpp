// The wheels' factors, calibration and slip in the window.
#include <algorithm>
#include <cmath>

#include "factors/sliding_window_parts.h"

namespace lodestone {

namespace {

// The slip is constant over an epoch (docs/design/049-wheels.md).
constexpr double kSlipEpoch_s = 0.5;

}  // namespace

SlidingWindow::SlipEpoch* SlidingWindow::slip_epoch_at(Time time, double jump) {
  if (calibration_.wheels.slip_sigma == 0.0) jump = 0.0;
  if (!slips_.empty() && jump == 0.0 && to_seconds(time - slips_.back()->start) < kSlipEpoch_s - 1e-6) {
    return slips_.back().get();
  }
  auto epoch = std::make_unique<SlipEpoch>();
  epoch->start = time;
  epoch->slip = {BlockKind::euclidean, {0.0}};
  add_block(epoch->slip);
  const double sigma = std::max(calibration_.wheels.slip_sigma, kHeldSigma);
  if (slips_.empty()) {
    epoch->step = add_factor(std::make_unique<SlipFactor>(sigma, 0.0, jump), {&epoch->slip});
  } else {
    SlipEpoch& before = *slips_.back();
    const double decay = std::exp(-to_seconds(time - before.start) / kSlipCorrelation_s);
    epoch->slip.values[0] = decay * before.slip.values[0];
    epoch->step = add_factor(std::make_unique<SlipFactor>(sigma, decay, jump), {&before.slip, &epoch->slip});
  }
  slips_.push_back(std::move(epoch));
  return slips_.back().get();
}

double SlidingWindow::slip_step_sigma() const {
  return calibration_.wheels.slip_sigma * std::sqrt(1.0 - std::exp(-2.0 * kSlipEpoch_s / kSlipCorrelation_s));
}

void SlidingWindow::set_wheels(std::size_t k, const WheelReading& reading, double slip_jump) {
  changed();
  KeyframeFactors& keyframe = *keyframes_[k];
  if (keyframe.wheels) {
    keyframe.wheels.change().set(reading);
    return;
  }
  const double turn_sigma_rad = std::max(calibration_.wheels.rotation_sigma_deg * M_PI / 180.0, kHeldSigma);
  add_calibration(
      wheel_calibration_, wheel_calibration_prior_,
      {std::max(calibration_.wheels.scale_sigma, kHeldSigma), turn_sigma_rad, turn_sigma_rad, turn_sigma_rad});
  keyframe.slip = slip_epoch_at(keyframe.time, slip_jump);
  ++keyframe.slip->keyframes;
  keyframe.wheels = add_factor(std::make_unique<WheelFactor>(reading),
                               {&keyframe.pose, &keyframe.motion, &wheel_calibration_, &keyframe.slip->slip});
}

SlidingWindow::SlipEpoch* SlidingWindow::leaving_slip(const KeyframeFactors& oldest,
                                                      std::vector<WindowFactor>& involved,
                                                      std::vector<WindowBlock*>& eliminated) {
  if (slips_.size() < 2) return nullptr;
  SlipEpoch& first = *slips_.front();
  if (first.keyframes - (oldest.slip == &first ? 1 : 0) > 0) return nullptr;
  eliminated.push_back(&first.slip);
  if (first.step) involved.push_back(first.step);
  involved.push_back(slips_[1]->step);
  return &first;
}

void SlidingWindow::remove_slip(SlipEpoch* leaving) {
  if (leaving == nullptr) return;
  remove_factor(leaving->step);
  remove_factor(slips_[1]->step);
  remove_block(leaving->slip);
  slips_.pop_front();
}

double SlidingWindow::wheel_slip(std::size_t k) const {
  const SlipEpoch* epoch = keyframes_[k]->slip;
  if (epoch == nullptr && !slips_.empty()) epoch = slips_.back().get();
  return epoch == nullptr ? 0.0 : epoch->slip.values[0];
}

WheelCorrection SlidingWindow::wheel_correction(std::size_t k) const {
  if (!wheel_calibration_prior_) return {};
  const double* values = wheel_calibration_.values.data();
  return {values[0] + wheel_slip(k), Vector3(values + 1)};
}

}  // namespace lodestone
