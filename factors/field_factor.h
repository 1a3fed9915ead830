#pragma once

#include <ceres/cost_function.h>

#include <memory>
#include <optional>
#include <vector>

#include "core/magnetometer/magnetic_map.h"
#include "factors/pose_mask.h"

namespace lodestone {

/// One magnetometer reading (or the mean of a few consecutive ones) as input of a keyframe's factor.
struct FieldReading {
  Pose T_end_mag;  ///< transforms points in the magnetometer's frame at the reading's time to the imu frame at t_k
  Vector3 measured_ut = Vector3::Zero();
  int magnetometer = 0;
  double sigma_ut = 1.0;                   ///< per component: sensor and map together
  double weight = 1.0;                     ///< Huber weight times β²; scales the squared residual
  Vector3 velocity_m_s = Vector3::Zero();  ///< of the magnetometer at its time, relative to the imu frame at t_k
  Vector3 turn_rad_s = Vector3::Zero();    ///< its angular rate, in its own axes
  Vector3 place = Vector3::Zero();         ///< position in the map at which the reading was weighted
  std::optional<FieldValue> field{};       ///< of the map at `place`; extrapolated linearly beyond the map's edge
  double sensor_variance_ut2 = 0.0;        ///< part of sigma_ut² that is the sensor's noise alone

  /// The field beyond the map's edge; empty if the reading was weighted off the map.
  std::optional<FieldValue> field_beyond(const Vector3& position) const;

  /// T_end_mag for a stamp with a delay of `clock_offset_s`: the reading was taken earlier by this time.
  Pose T_end_mag_at(double clock_offset_s) const {
    Pose result = T_end_mag;
    result.position -= clock_offset_s * velocity_m_s;
    result.rotation = (result.rotation * so3::exp(-clock_offset_s * turn_rad_s)).normalized();
    return result;
  }
};

/// Readings of the array between two keyframes, each related to pose k by the IMU's relative motion
/// (docs/design/architecture.md, section 6): r = √w/σ (B − b_j − (R R_rel)ᵀ M(p + R ℓ)). Parameters: pose k (7), biases
/// of all magnetometers (3 each, µT); if estimated, the common delay of the magnetometers' stamps (1, s), which moves
/// readings along their own motion, and the matrices of all magnetometers (9 each, CalibrationEstimate), so that (1 +
/// E) times the field is expected. Beyond the map's edge the field is extrapolated from the point where the reading was
/// weighted; otherwise leaving the map would lower the cost. A reading without such a field contributes nothing there.
class FieldFactor final : public ceres::CostFunction {
 public:
  struct Blocks {
    bool clock = false;
    bool matrices = false;
  };

  FieldFactor(std::shared_ptr<const MagneticMap> map, FieldInterpolation interpolation, int magnetometers,
              std::vector<FieldReading> readings, const PoseMask& mask, const Blocks& blocks);
  FieldFactor(std::shared_ptr<const MagneticMap> map, FieldInterpolation interpolation, int magnetometers,
              std::vector<FieldReading> readings, const PoseMask& mask)
      : FieldFactor(std::move(map), interpolation, magnetometers, std::move(readings), mask, Blocks{}) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override;

  const std::vector<FieldReading>& readings() const { return readings_; }
  const PoseMask& mask() const { return mask_; }

  /// Sets new weights (one per reading) and a new mask; the readings stay.
  void renew(std::vector<FieldReading> readings, const PoseMask& mask);

 private:
  std::shared_ptr<const MagneticMap> map_;
  FieldInterpolation interpolation_;
  int magnetometers_;
  Blocks blocks_;
  std::vector<FieldReading> readings_;
  PoseMask mask_;
};

}  // namespace lodestone
