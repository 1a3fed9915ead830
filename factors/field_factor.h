#pragma once

#include <ceres/cost_function.h>

#include <memory>
#include <optional>
#include <vector>

#include "core/magnetometer/magnetic_map.h"
#include "factors/pose_mask.h"

namespace lodestone {

/// One magnetometer's reading (or the mean of a few neighbouring ones) as a keyframe's factor uses it.
struct FieldReading {
  Pose T_end_mag;  ///< takes points in the magnetometer's frame at the reading's time to the imu frame at t_k
  Vector3 measured_ut = Vector3::Zero();
  int magnetometer = 0;
  double sigma_ut = 1.0;                   ///< of residual components: sensor and map together
  double weight = 1.0;                     ///< Huber's weight times β²; multiplies the squared residual
  Vector3 velocity_m_s = Vector3::Zero();  ///< of the magnetometer at its time as the imu frame at t_k sees it
  Vector3 turn_rad_s = Vector3::Zero();    ///< its rate of rotation, in its own axes
  Vector3 place = Vector3::Zero();         ///< in the map, where the reading was weighed
  std::optional<FieldValue> field{};       ///< of the map at `place`: goes on from there, linear, where the map ends

  /// Beyond the map's edge; nothing if the reading was weighed off the map.
  std::optional<FieldValue> field_beyond(const Vector3& position) const;

  /// T_end_mag of a reading whose stamp is `clock_offset_s` late: it was taken so much before.
  Pose T_end_mag_at(double clock_offset_s) const {
    Pose result = T_end_mag;
    result.position -= clock_offset_s * velocity_m_s;
    result.rotation = (result.rotation * so3::exp(-clock_offset_s * turn_rad_s)).normalized();
    return result;
  }
};

/// Readings of the array between two keyframes, each at pose k through the IMU's relative motion
/// (docs/design/architecture.md, section 6): r = √w/σ (B − b_j − (R R_rel)ᵀ M(p + R ℓ)). Parameters: pose k (7), biases
/// of all magnetometers (3 each, µT). Where they are estimated, how late the stamps of all magnetometers are (1, s):
/// readings move along their own motion; and the matrices of all (9 each, CalibrationEstimate): (1 + E) times the
/// expected field is read. Where the map ends, the field goes on from where the reading was weighed: else the cost
/// would fall by leaving the map. A reading without such a field contributes nothing there.
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

  /// New weights (one a reading) and mask; the readings stay.
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
