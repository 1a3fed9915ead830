#pragma once

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "core/sensor_suite.h"
#include "core/warnings.h"
#include "estimators/estimate.h"

namespace lodestone {

/// Warns of wheels that slip for long: over two seconds, their slip exceeds 3.5 of its sigmas, or their velocity has
/// little weight.
class WheelWatch {
 public:
  /// `warnings`: may be null.
  WheelWatch(const WheelCalibrationSigmas& sigmas, WarningLog* warnings) : sigmas_(sigmas), warnings_(warnings) {}

  void add(const Estimate& estimate) {
    const Diagnostics& diagnostics = estimate.diagnostics;
    if (warnings_ == nullptr || diagnostics.wheel_weight < 0.0) return;
    const bool by_slip =
        sigmas_.slip_sigma > 0.0 && std::abs(diagnostics.wheel_slip) > kSlipSigmas * sigmas_.slip_sigma;
    const bool slips = by_slip || diagnostics.wheel_weight < kLittleWeight;
    if (!slips) {
      since_.reset();
      warned_ = false;
      return;
    }
    if (!since_) since_ = estimate.time;
    if (warned_ || to_seconds(estimate.time - *since_) < kLong_s) return;
    warned_ = true;
    warnings_->add("wheels.slip",
                   fmt::format("the wheels' velocity contradicts the estimate since {:.3f} s (slip {:.1f} %, weight "
                               "{:.2f}); check the tyres, wheels.scale and wheels.calibration in the platform file",
                               to_seconds(*since_), 100.0 * diagnostics.wheel_slip, diagnostics.wheel_weight),
                   *since_);
  }

 private:
  static constexpr double kLong_s = 2.0;
  static constexpr double kLittleWeight = 0.5;  // as Diagnostics::magnetic_rejected
  static constexpr double kSlipSigmas = 3.5;

  WheelCalibrationSigmas sigmas_;
  WarningLog* warnings_;
  std::optional<Time> since_;
  bool warned_ = false;
};

}  // namespace lodestone
