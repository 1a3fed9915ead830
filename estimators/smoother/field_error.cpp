#include "estimators/smoother/field_error.h"

#include <algorithm>
#include <vector>

#include "core/middle_value.h"

namespace lodestone {

namespace {

constexpr double kStretch_m = 1.0;

/// Median over mean of a χ² variable with three degrees of freedom.
constexpr double kMedianShare = 0.789;

}  // namespace

void FieldError::add(const Pose& T_map_imu, std::span<const FieldReading> readings,
                     std::span<const Vector3> residual_ut) {
  if (readings_ == 0) begin_ = T_map_imu.position;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (readings[i].weight <= 0.0) continue;
    sum_ut_ += T_map_imu.rotation * (readings[i].T_end_mag.rotation * residual_ut[i]);
    noise_sum_ut2_ += readings[i].sensor_variance_ut2;
    ++readings_;
  }
  const double way_m = (T_map_imu.position - begin_).norm();
  if (way_m < kStretch_m || readings_ == 0) return;
  const double count = readings_;
  const double found = (sum_ut_ / count).squaredNorm() / 3.0 - noise_sum_ut2_ / (count * count);
  variances_ut2_.push_back(found);
  if (variances_ut2_.size() > static_cast<std::size_t>(kMetres)) variances_ut2_.pop_front();
  readings_a_metre_ = count / way_m;
  sum_ut_.setZero();
  noise_sum_ut2_ = 0.0;
  readings_ = 0;
}

double FieldError::variance_a_reading_ut2() const {
  if (variances_ut2_.empty()) return 0.0;
  const double middle = middle_value(std::vector<double>(variances_ut2_.begin(), variances_ut2_.end()));
  return std::max(0.0, middle / kMedianShare) * readings_a_metre_;
}

}  // namespace lodestone
