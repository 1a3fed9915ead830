#include "estimators/initialization/start_scan.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "core/lidar/deskew.h"

namespace lodestone {

namespace {

constexpr double kGroundRange_m = 15.0;
constexpr double kGroundThickness_m = 0.05;
constexpr double kLevelCosine = 0.9976;  // 4°
constexpr int kLeastGroundPoints = 30;
constexpr int kTriples = 600;
constexpr double kRampCosine = 0.9986;  // 3°
constexpr double kSearchVoxel_m = 0.5;

/// A fixed pseudo-random sequence: the finalizer of SplitMix64 over a counter.
std::uint64_t scrambled(std::uint64_t counter) {
  std::uint64_t value = counter * 0x9e3779b97f4a7c15ULL;
  value = (value ^ (value >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  value = (value ^ (value >> 27U)) * 0x94d049bb133111ebULL;
  return value ^ (value >> 31U);
}

}  // namespace

std::vector<ImuSample> imu_of(std::span<const ScanBundle> bundles) {
  std::vector<ImuSample> samples;
  for (const ScanBundle& bundle : bundles) {
    for (const ImuSample& sample : bundle.imu) {
      if (samples.empty() || sample.time > samples.back().time) samples.push_back(sample);  // bundles share end samples
    }
  }
  return samples;
}

Vector3 mean_up(std::span<const ImuSample> samples) {
  Vector3 sum = Vector3::Zero();
  Quaternion turn = Quaternion::Identity();  // rotates vectors from the present imu frame to that at the first sample
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (i > 0) {
      const ImuInterval interval = make_interval(samples[i - 1], samples[i], Vector3::Zero(), Vector3::Zero());
      turn = (turn * so3::exp(interval.duration_s * interval.angular_velocity)).normalized();
    }
    sum += turn * samples[i].linear_acceleration;
  }
  return sum.norm() > 0.0 ? sum.normalized() : Vector3::UnitZ();
}

Quaternion level_attitude(const Vector3& up) {
  // If roll and pitch combine, the shortest rotation has a small yaw; yaw 0 is therefore defined by the forward axis.
  const Quaternion turn = Quaternion::FromTwoVectors(up, Vector3::UnitZ());
  const Vector3 forward = turn * Vector3::UnitX();
  return (Eigen::AngleAxisd(-std::atan2(forward.y(), forward.x()), Vector3::UnitZ()) * turn).normalized();
}

std::optional<GroundPlane> find_ground(std::span<const Eigen::Vector3f> points, const Vector3& up) {
  std::vector<Vector3> below;
  for (const Eigen::Vector3f& point : points) {
    const Vector3 p = point.cast<double>();
    if (p.norm() < kGroundRange_m && p.dot(up) < 0.0) below.push_back(p);
  }
  if (static_cast<int>(below.size()) < kLeastGroundPoints) return std::nullopt;
  GroundPlane best;
  const auto count = [&](const Vector3& normal, double height_m) {
    return static_cast<int>(std::count_if(below.begin(), below.end(), [&](const Vector3& p) {
      return std::abs(normal.dot(p) + height_m) < kGroundThickness_m;
    }));
  };
  for (std::uint64_t i = 0; i < kTriples; ++i) {
    const Vector3& a = below[scrambled(3 * i + 1) % below.size()];
    const Vector3& b = below[scrambled(3 * i + 2) % below.size()];
    const Vector3& c = below[scrambled(3 * i + 3) % below.size()];
    Vector3 normal = (b - a).cross(c - a);
    if (normal.norm() < 0.1) continue;
    normal.normalize();
    if (normal.dot(up) < 0.0) normal = -normal;
    if (normal.dot(up) < kLevelCosine) continue;
    const int found = count(normal, -normal.dot(a));
    if (found > best.points) best = {normal, -normal.dot(a), found};
  }
  if (best.points < kLeastGroundPoints) return std::nullopt;
  for (int round = 0; round < 2; ++round) {  // least squares over the points on the plane
    Vector3 sum = Vector3::Zero();
    Matrix3 outer = Matrix3::Zero();
    int used = 0;
    for (const Vector3& p : below) {
      if (std::abs(best.normal.dot(p) + best.height_m) > kGroundThickness_m) continue;
      sum += p;
      outer += p * p.transpose();
      ++used;
    }
    const Vector3 center = sum / used;
    const Eigen::SelfAdjointEigenSolver<Matrix3> solver(outer / used - center * center.transpose());
    Vector3 normal = solver.eigenvectors().col(0);
    if (normal.dot(up) < 0.0) normal = -normal;
    best = {normal, -normal.dot(center), used};
  }
  return best;
}

StartScan prepare_start(const ScanBundle& bundle, const Vector3& up_at_end, const Vector3& velocity_imu,
                        const SensorSuite& suite) {
  StartScan result;
  result.up = up_at_end;
  NavState end;
  end.T_map_imu.rotation = level_attitude(up_at_end);
  end.velocity = end.T_map_imu.rotation * velocity_imu;
  end.gravity = Vector3(0.0, 0.0, -suite.gravity_m_s2);
  const std::vector<LidarPoint>& points = bundle.scan.points;
  result.points = deskew(points, bundle.scan.start, ScanMotion(end, bundle.imu), suite.lidar.T_imu_lidar);
  result.lidars = ScanLidars(suite.lidars(), points);
  result.ground = find_ground(result.points, up_at_end);
  return result;
}

Quaternion start_attitude(const StartScan& scan) {
  const bool level = scan.ground && scan.ground->normal.dot(scan.up) > kRampCosine;
  return level_attitude(level ? scan.ground->normal : scan.up);
}

double height_above_floor(const StartScan& scan) {
  if (scan.ground) return scan.ground->height_m;
  std::vector<double> depths;
  for (const Eigen::Vector3f& point : scan.points) depths.push_back(-point.cast<double>().dot(scan.up));
  if (depths.empty()) return 0.0;
  const auto lowest = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() * 49 / 50);
  std::nth_element(depths.begin(), lowest, depths.end());
  return std::max(0.0, *lowest);
}

std::vector<SearchPoint> search_points(const StartScan& scan, double range_m, int most) {
  const Vector3 normal = scan.ground ? scan.ground->normal : scan.up;
  const double height_m = height_above_floor(scan);
  const Quaternion level = level_attitude(normal);
  std::set<std::tuple<int, int, int>> seen;
  std::vector<SearchPoint> all;
  for (const Eigen::Vector3f& point : scan.points) {
    const Vector3 p = level * point.cast<double>();
    const double range = p.head<2>().norm();
    const double above_m = p.z() + height_m;
    // The effect of a tilt error increases with the range.
    const double tolerance_m = 0.1 + (scan.ground ? 0.004 : 0.02) * range;
    if (range > range_m || above_m < SiteLevel::clearance_m + tolerance_m) continue;
    const std::uint32_t bands = SiteLevel::band_mask(above_m - tolerance_m, above_m + tolerance_m);
    if (bands == 0) continue;
    const Eigen::Vector3i voxel = (p / kSearchVoxel_m).array().floor().cast<int>();
    if (!seen.insert({voxel.x(), voxel.y(), voxel.z()}).second) continue;
    all.push_back({p.head<2>().cast<float>(), bands});
  }
  const auto limit = static_cast<std::size_t>(most);
  if (all.size() > limit) {
    for (std::size_t i = 0; i < limit; ++i) all[i] = all[i * all.size() / limit];
    all.resize(limit);
  }
  return all;
}

}  // namespace lodestone
