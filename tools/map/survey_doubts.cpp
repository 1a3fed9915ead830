#include "tools/map/survey_doubts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

constexpr double kSeveral = 3.0;
constexpr std::size_t kEnoughCells = 20;

double rms(const Vector3& components) {
  return components.norm() / std::sqrt(3.0);
}

}  // namespace

const char* const kSurveyCauses =
    "check that the trajectory is of this drive and clock, and check T_imu_mag and the calibration in the platform "
    "file";

std::string survey_doubts(const FieldKernelFit& fit, double reading_noise_ut,
                          const std::optional<HeldOutScore>& held_out) {
  const double noise = rms({fit.kernels[0].noise_sigma, fit.kernels[1].noise_sigma, fit.kernels[2].noise_sigma});
  const double by_likelihood = rms(fit.uncalibrated_noise);
  if (noise > kSeveral * reading_noise_ut) {
    return fmt::format(
        "the readings vary by {:.2f} uT per cell, but the platform's noise of one reading is {:.2f} uT: {}", noise,
        reading_noise_ut, kSurveyCauses);
  }
  if (noise > reading_noise_ut && noise > kSeveral * by_likelihood) {
    return fmt::format("the readings vary by {:.2f} uT per cell, {:.1f} times more than within one pass: {}", noise,
                       noise / by_likelihood, kSurveyCauses);
  }
  if (held_out && held_out->cells >= kEnoughCells && rms(held_out->normalized_rms) > kSeveral) {
    return fmt::format("held-out readings differ from the map of the others by {:.1f} sigma: {}",
                       rms(held_out->normalized_rms), kSurveyCauses);
  }
  return {};
}

std::string unreached_heights(const std::vector<FieldObservation>& readings, const MagneticMap& map) {
  constexpr std::size_t kLooks = 2000;
  if (readings.empty()) return {};
  const auto lower = [](const FieldObservation& a, const FieldObservation& b) {
    return a.position.z() < b.position.z();
  };
  const auto [low, high] = std::minmax_element(readings.begin(), readings.end(), lower);
  std::string heights;
  for (const double height : map.grid().heights_m) {
    if (height >= low->position.z() && height <= high->position.z()) continue;
    bool reached = false;
    for (std::size_t i = 0; i < readings.size() && !reached; i += 1 + readings.size() / kLooks) {
      const Vector3& at = readings[i].position;
      reached = map.query({at.x(), at.y(), height}, FieldInterpolation::bilinear).has_value();
    }
    if (!reached) heights += fmt::format("{}{:g}", heights.empty() ? "" : ", ", height);
  }
  if (heights.empty()) return {};
  return fmt::format(
      "no field at the height {} m: the survey's readings are at {:.3f} to {:.3f} m; change heights_m, or survey "
      "there",
      heights, low->position.z(), high->position.z());
}

}  // namespace lodestone
