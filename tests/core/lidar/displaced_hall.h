#pragma once

#include <Eigen/Cholesky>
#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "core/geometry/so3.h"
#include "core/lidar/cube_sums.h"

namespace lodestone {

inline constexpr double kNoise_m = 0.01;

class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}
  double normal(double sigma) { return sigma * normal_(generator_); }
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(generator_); }
  Vector3 vector(double sigma) {
    const double x = normal(sigma);
    const double y = normal(sigma);
    return {x, y, normal(sigma)};
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

/// The map's displacement at a place: one vector for each cube, and sums of random waves, whose correlation is
/// exp(-r²/2ℓ²) (the spectrum of this kernel is normal).
class Displacement {
 public:
  Displacement(double cube_sigma_m, Random& random) : cube_sigma_m_(cube_sigma_m), random_(random) {}

  void add_smooth(double sigma_m, double length_m) {
    constexpr int kWaves = 100;
    for (int i = 0; i < kWaves; ++i) {
      const double amplitude_m = sigma_m / std::sqrt(static_cast<double>(kWaves));
      waves_.push_back({random_.vector(1.0 / length_m), random_.vector(amplitude_m), random_.vector(amplitude_m)});
    }
  }

  Vector3 at(const Vector3& place) {
    Vector3 sum = smooth_at(place);
    if (cube_sigma_m_ > 0.0) {
      const auto [entry, is_new] = cubes_.try_emplace(map_error_cube(place));
      if (is_new) entry->second = random_.vector(cube_sigma_m_);
      sum += entry->second;
    }
    return sum;
  }

  Vector3 smooth_at(const Vector3& place) const {
    Vector3 sum = Vector3::Zero();
    for (const Wave& wave : waves_) {
      const double phase = wave.number.dot(place);
      sum += std::cos(phase) * wave.cosine + std::sin(phase) * wave.sine;
    }
    return sum;
  }

  /// Half the curl, by central differences.
  Vector3 turn_at(const Vector3& place) const {
    constexpr double kStep_m = 0.01;
    Vector3 turn = Vector3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3 unit = Vector3::Unit(axis);
      const Vector3 slope = (smooth_at(place + kStep_m * unit) - smooth_at(place - kStep_m * unit)) / (2.0 * kStep_m);
      turn += 0.5 * unit.cross(slope);
    }
    return turn;
  }

 private:
  struct Wave {
    Vector3 number;
    Vector3 cosine;
    Vector3 sine;
  };
  double cube_sigma_m_;
  Random& random_;
  std::map<MapErrorCube, Vector3> cubes_;
  std::vector<Wave> waves_;
};

struct Scan {
  std::vector<Plane> planes;
  std::vector<Correspondence> matches;
};

/// A scan of a hall, in a displaced map.
inline Scan hall_scan(const Vector3& size_m, int points, const Pose& T_map_imu, Displacement& displacement,
                      Random& random) {
  Scan scan;
  scan.planes.resize(static_cast<std::size_t>(points));
  for (int i = 0; i < points; ++i) {
    Vector3 place;
    for (int k = 0; k < 3; ++k) place[k] = random.uniform(0.1, size_m[k] - 0.1);
    const int axis = i % 3;
    place[axis] = i % 2 == 0 ? 0.02 : size_m[axis] - 0.02;
    Plane& plane = scan.planes[static_cast<std::size_t>(i)];
    const Vector3 normal = Vector3::Unit(axis);
    plane.normal = normal.cast<float>();
    plane.major = normal.unitOrthogonal().cast<float>();
    plane.center = place.cast<float>();
    // An object at `place` minus the displacement is shown at `place` in the map.
    const Vector3 seen = place - displacement.at(place) + random.normal(kNoise_m) * normal;
    scan.matches.push_back({(T_map_imu.inverse() * seen).cast<float>(), &plane, static_cast<float>(kNoise_m * kNoise_m),
                            1.0F, 0.0F, static_cast<float>(kNoise_m * kNoise_m)});
  }
  return scan;
}

/// Error of the best fitting pose against `T_map_imu`: φ in map axes, p.
inline Vector6 fit(const std::vector<Correspondence>& matches, const Pose& T_map_imu, Pose& fitted) {
  Matrix6 hessian = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  for (const Correspondence& match : matches) {
    const Vector3 normal = match.plane->normal.cast<double>();
    const Vector3 arm = T_map_imu.rotation * match.point.cast<double>();
    Vector6 jacobian;
    jacobian << arm.cross(normal), normal;
    const double residual = normal.dot(arm + T_map_imu.position - match.plane->center.cast<double>());
    hessian += jacobian * jacobian.transpose();
    gradient += residual * jacobian;
  }
  const Vector6 step = -hessian.llt().solve(gradient);
  fitted = {so3::exp(step.head<3>()) * T_map_imu.rotation, T_map_imu.position + step.tail<3>()};
  return step;
}

inline const Vector3 kHall_m(24.0, 18.0, 6.0);

}  // namespace lodestone
