#include "tools/init/standstill_noise.h"

#include <cmath>

#include "tools/check/imu_checks.h"

namespace lodestone {
namespace {

constexpr Time standstill_length = 2'000'000'000;
constexpr std::size_t fewest_field_samples = 20;  // the sigma of 60 numbers is known to 10 %

/// The standard deviation of the readings within the span, over all components.
double field_noise_ut(const std::vector<MagneticSample>& field, const RestSpan& span) {
  Vector3 sum = Vector3::Zero();
  Vector3 square_sum = Vector3::Zero();
  std::optional<Vector3> origin;  // differences to the first reading keep the digits
  std::size_t count = 0;
  for (const MagneticSample& sample : field) {
    if (sample.time < span.begin || sample.time > span.end) continue;
    if (!origin) origin = sample.field_ut;
    const Vector3 difference = sample.field_ut - *origin;
    sum += difference;
    square_sum += difference.cwiseAbs2();
    ++count;
  }
  if (count < fewest_field_samples) return 0.0;
  const auto n = static_cast<double>(count);
  return std::sqrt((square_sum - sum.cwiseAbs2() / n).sum() / (3.0 * (n - 1.0)));
}

}  // namespace

std::optional<StandstillNoise> standstill_noise(const LogSample& sample, double period_s) {
  const std::optional<RestSpan> span = calmest_span(sample.imu, standstill_length);
  if (!span || !span->at_rest) return std::nullopt;
  StandstillNoise noise;
  noise.duration_s = to_seconds(span->end - span->begin);
  noise.gyroscope_density = span->shaking_rad_s * std::sqrt(period_s);
  noise.accelerometer_density = span->shaking_m_s2 * std::sqrt(period_s);
  for (const std::vector<MagneticSample>& field : sample.fields)
    noise.fields_ut.push_back(field_noise_ut(field, *span));
  return noise;
}

}  // namespace lodestone
