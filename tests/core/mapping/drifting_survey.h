#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "core/mapping/field_survey.h"

namespace lodestone::testing {

/// Dipoles under a floor of 5 x 2 m, in the earth's field.
class SteelFloor {
 public:
  explicit SteelFloor(std::uint64_t seed) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    const auto uniform = [&] { return static_cast<double>(generator() >> 11U) * 0x1.0p-53; };
    for (int i = 0; i < 30; ++i) {
      const double x = -0.5 + 6.0 * uniform(), y = -0.5 + 3.0 * uniform(), z = -0.25 - 0.4 * uniform();
      const double a = normal(generator), b = normal(generator), c = normal(generator);
      add({x, y, z}, 0.5 * Vector3(a, b, c));
    }
  }

  void add(const Vector3& position, const Vector3& moment) {
    positions_.push_back(position);
    moments_.push_back(moment);
  }

  Vector3 field_ut(const Vector3& p) const {
    Vector3 field(18.0, 2.0, -42.0);
    for (std::size_t i = 0; i < positions_.size(); ++i) {
      const Vector3 offset = p - positions_[i];
      const double distance = offset.norm();
      const Vector3 direction = offset / distance;
      field += (3.0 * direction * direction.dot(moments_[i]) - moments_[i]) / std::pow(distance, 3);
    }
    return field;
  }

 private:
  std::vector<Vector3> positions_, moments_;
};

/// Errors of a drive. Positions err by a Gauss-Markov process along the way, correlated over 2 m.
struct DriveErrors {
  double position_m = 0.01;
  double offset_ut = 0.5;  ///< of each magnetometer, in its own axes, on this drive
  double noise_ut = 1.0;
  double clock_s = 0.0;  ///< stamp minus time of the poses
  double pause_s = 0.0;  ///< between lanes; 0: the robot jumps
};

/// A drive of three magnetometers over the floor: lanes 0.35 m apart along x, then 0.7 m apart along y, readings every
/// 2 cm, at 1 m/s. Heights 0.1 m. `shift_m`: of all lanes, so that another drive has other tracks. `true_offsets`:
/// receives the offsets of the magnetometers.
inline std::vector<FieldObservation> drive_over(const SteelFloor& floor, std::uint64_t seed, const DriveErrors& errors,
                                                double shift_m = 0.0, std::vector<Vector3>* true_offsets = nullptr) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  const auto draw = [&](double sigma) {
    const double a = normal(generator), b = normal(generator), c = normal(generator);
    return Vector3(sigma * Vector3(a, b, c));
  };
  std::vector<Vector3> offsets(3);
  for (Vector3& offset : offsets) offset = draw(errors.offset_ut);
  if (true_offsets != nullptr) *true_offsets = offsets;
  constexpr double step_m = 0.02, alike_m = 2.0;
  const double keep = std::exp(-step_m / alike_m);
  Vector3 error = draw(errors.position_m);
  std::vector<FieldObservation> readings;
  double seconds = 0.0;
  const auto lane = [&](const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
    const Eigen::Vector2d along = (to - from).normalized();
    const Eigen::Vector2d left(-along.y(), along.x());
    const double phase = 3.0 * normal(generator);
    for (double way = 0.0; way < (to - from).norm(); way += step_m, seconds += step_m) {
      error = keep * error + std::sqrt(1.0 - keep * keep) * draw(errors.position_m);
      for (int j = 0; j < 3; ++j) {
        const auto place_at = [&](double done) {
          const Eigen::Vector2d at =
              from + done * along + (0.12 * (j - 1) + 0.04 * std::sin(1.3 * done + phase)) * left;
          return Vector3(at.x(), at.y(), 0.1);
        };
        const Vector3 place = place_at(way);
        Matrix3 R_map_imu = Matrix3::Identity();
        R_map_imu.topLeftCorner<2, 2>() << along.x(), left.x(), along.y(), left.y();
        const Vector3 field = floor.field_ut(place_at(way - errors.clock_s)) +
                              R_map_imu * offsets[static_cast<std::size_t>(j)] + draw(errors.noise_ut);
        readings.push_back({place + Vector3(error.x(), error.y(), 0.0), field, errors.noise_ut, from_seconds(seconds),
                            j, Quaternion(R_map_imu)});
      }
    }
    seconds += errors.pause_s;
  };
  for (int k = 0; k < 6; ++k) {
    const double y = 0.12 + 0.35 * k + shift_m;
    k % 2 == 0 ? lane({0.0, y}, {5.0, y}) : lane({5.0, y}, {0.0, y});
  }
  for (int k = 0; k < 7; ++k) {
    const double x = 0.3 + 0.7 * k + shift_m;
    k % 2 == 0 ? lane({x, 2.0}, {x, 0.0}) : lane({x, 0.0}, {x, 2.0});
  }
  return readings;
}

}  // namespace lodestone::testing
