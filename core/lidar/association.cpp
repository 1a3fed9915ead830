#include "core/lidar/association.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "core/lidar/places_in_map.h"
#include "core/lidar/prefetch_plane.h"
#include "core/middle_value.h"
#include "core/parallel.h"
#include "core/robust_weight.h"

namespace lodestone {

namespace {

constexpr std::size_t kChunk = 1024;

/// Point-to-plane residuals beyond count less (Huber): half of the default gate. No ablation shows that it matters
/// (docs/design/048-options-that-went.md).
constexpr double kHuberSigmas = 2.0;

using Matrix6f = Eigen::Matrix<float, 6, 6>;
using Vector6f = Eigen::Matrix<float, 6, 1>;

/// J P Jᵀ of a residual. An uncertain position along a tunnel does not widen the gates across it.
float variance_by_pose(const Vector6f& jacobian, const Matrix6f& covariance) {
  return std::max(0.0F, jacobian.dot(covariance.selfadjointView<Eigen::Lower>() * jacobian));
}

/// Beam origin and noise of one LiDAR.
struct Beams {
  Eigen::Vector3f origin;  // imu frame
  float range_variance;
  float angle_variance;
};

struct Noise {
  std::vector<Beams> beams;  // by LiDAR
  float roughness_variance;
  float max_distance;
  Matrix6f pose_covariance;  // φ, p
  float repeats;             // of a plane's error
  float variance_scale;
  float gate_squared;
};

void associate_part(std::span<const Eigen::Vector3f> points, std::span<const float> ages_s,
                    std::span<const std::uint8_t> lidars, const Pose& T_map_imu, const PlaneMap& map,
                    const Noise& noise, std::vector<Correspondence>& result) {
  const Eigen::Matrix3f rotation = T_map_imu.rotation.toRotationMatrix().cast<float>();
  const std::vector<Eigen::Vector3f> places = places_in_map(points, T_map_imu);
  std::vector<const Plane*> planes(points.size());
  map.match(places, noise.max_distance, planes);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Plane* plane = planes[i];
    if (plane == nullptr) continue;
    const Eigen::Vector3f& point = points[i];
    const Eigen::Vector3f& place = places[i];
    const float distance = plane->distance(place);
    const Beams& beams = noise.beams[lidars.empty() ? 0 : lidars[i]];
    const Eigen::Vector3f beam = rotation * (point - beams.origin);
    const float range_squared = beam.squaredNorm();
    const float along_normal = plane->normal.dot(beam);
    const float cosine_squared = along_normal * along_normal / range_squared;
    const Eigen::Vector3f normal_in_imu = rotation.transpose() * plane->normal;
    Vector6f jacobian;
    jacobian.head<3>() = point.cross(normal_in_imu);
    jacobian.tail<3>() = plane->normal;
    const float by_sensor = noise.variance_scale *
                            (beams.range_variance * cosine_squared +
                             beams.angle_variance * range_squared * (1.0F - cosine_squared) + noise.roughness_variance);
    const float by_plane = noise.variance_scale * plane->variance_at(place);
    const float variance = by_sensor + noise.repeats * by_plane;
    const float expected = variance + variance_by_pose(jacobian, noise.pose_covariance);
    if (distance * distance > noise.gate_squared * expected) continue;
    const double sigmas = std::abs(distance) / std::sqrt(expected);
    result.push_back({point, plane, variance, static_cast<float>(huber_weight(sigmas, kHuberSigmas)),
                      ages_s.empty() ? 0.0F : ages_s[i], by_sensor + by_plane});
  }
}

}  // namespace

std::vector<Correspondence> associate(std::span<const Eigen::Vector3f> points, const Pose& T_map_imu,
                                      const Matrix6& pose_covariance, const PlaneMap& map, const ScanLidars& lidars,
                                      const AssociationOptions& options, std::span<const float> ages_s,
                                      double variance_scale) {
  const auto square = [](double value) { return static_cast<float>(value * value); };
  if (!lidars.of_points.empty() && lidars.of_points.size() != points.size()) {
    throw std::invalid_argument("associate: lidars.of_points must be empty or have one entry for each point");
  }
  std::vector<Beams> beams;
  for (const LidarModel& lidar : lidars.models) {
    beams.push_back(
        {lidar.T_imu_lidar.position.cast<float>(), square(lidar.range_noise_m), square(lidar.direction_noise_rad)});
  }
  const Noise noise{std::move(beams),
                    square(options.surface_roughness_m),
                    static_cast<float>(options.max_distance_m),
                    pose_covariance.cast<float>(),
                    static_cast<float>(options.map_error_repeats),
                    static_cast<float>(variance_scale),
                    square(options.gate_sigmas)};
  const std::size_t chunks = (points.size() + kChunk - 1) / kChunk;
  std::vector<std::vector<Correspondence>> parts(chunks);
  parallel_for(std::size_t{0}, chunks, [&](std::size_t i) {
    const std::size_t begin = i * kChunk;
    parts[i].reserve(kChunk);
    const std::size_t count = std::min(kChunk, points.size() - begin);
    const auto part_of = [&](auto all) { return all.empty() ? all : all.subspan(begin, count); };
    associate_part(points.subspan(begin, count), part_of(ages_s), part_of(std::span(lidars.of_points)), T_map_imu, map,
                   noise, parts[i]);
  });
  std::vector<Correspondence> result;
  result.reserve(points.size());
  for (const auto& part : parts) result.insert(result.end(), part.begin(), part.end());
  return result;
}

namespace {

/// r² at the pose over its variance, for each correspondence with a known variance.
std::vector<double> squared_sigmas(std::span<const Correspondence> correspondences, const Pose& T_map_imu) {
  std::vector<double> result;
  result.reserve(correspondences.size());
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    prefetch_plane(correspondences, i);
    const Correspondence& match = correspondences[i];
    if (!(match.variance_once > 0.0F)) continue;
    const Vector3 place = T_map_imu * match.point.cast<double>();
    const double residual = match.plane->normal.cast<double>().dot(place - match.plane->center.cast<double>());
    result.push_back(residual * residual / static_cast<double>(match.variance_once));
  }
  return result;
}

}  // namespace

double normalized_residuals(std::span<const Correspondence> correspondences, const Pose& T_map_imu) {
  const std::vector<double> squares = squared_sigmas(correspondences, T_map_imu);
  return squares.empty() ? 0.0
                         : std::accumulate(squares.begin(), squares.end(), 0.0) / static_cast<double>(squares.size());
}

double residual_scale(std::span<const Correspondence> correspondences, const Pose& T_map_imu) {
  constexpr double kMedianOfChiSquared = 0.454936423119572;
  std::vector<double> squares = squared_sigmas(correspondences, T_map_imu);
  return squares.empty() ? 0.0 : middle_value(std::move(squares)) / kMedianOfChiSquared;
}

Matrix6 unit_hessian(std::span<const Correspondence> correspondences, const Pose& T_map_imu) {
  const Matrix3 map_to_imu = T_map_imu.rotation.toRotationMatrix().transpose();
  Matrix6 sum = Matrix6::Zero();
  for (const Correspondence& match : correspondences) {
    const Vector3 normal = match.plane->normal.cast<double>();
    Vector6 jacobian;
    jacobian.head<3>() = match.point.cast<double>().cross(map_to_imu * normal);
    jacobian.tail<3>() = normal;
    sum.selfadjointView<Eigen::Lower>().rankUpdate(jacobian);
  }
  return sum.selfadjointView<Eigen::Lower>();
}

}  // namespace lodestone
