#include "estimators/smoother/field_error.h"

#include <algorithm>

namespace lodestone {

namespace {

constexpr double kStretch_m = 1.0;

/// The running mean is that of all metres at first, and later of so many.
constexpr double kMemory = 50.0;

}  // namespace

void FieldError::add(const Pose& T_map_imu, std::span<const FieldReading> readings,
                     std::span<const Vector3> residual_ut, std::span<const double> sensor_variance_ut2) {
  if (readings_ == 0) begin_ = T_map_imu.position;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (readings[i].weight <= 0.0) continue;
    sum_ut_ += T_map_imu.rotation * (readings[i].T_end_mag.rotation * residual_ut[i]);
    noise_sum_ut2_ += sensor_variance_ut2[i];
    ++readings_;
  }
  const double way_m = (T_map_imu.position - begin_).norm();
  if (way_m < kStretch_m || readings_ == 0) return;
  const double count = readings_;
  const double found = (sum_ut_ / count).squaredNorm() / 3.0 - noise_sum_ut2_ / (count * count);
  ++metres_;
  const double gain = std::max(1.0 / kMemory, 1.0 / metres_);
  variance_ut2_ += gain * (found - variance_ut2_);
  readings_a_metre_ += gain * (count / way_m - readings_a_metre_);
  sum_ut_.setZero();
  noise_sum_ut2_ = 0.0;
  readings_ = 0;
}

double FieldError::variance_a_reading_ut2() const {
  return std::max(0.0, variance_ut2_) * readings_a_metre_;
}

}  // namespace lodestone
