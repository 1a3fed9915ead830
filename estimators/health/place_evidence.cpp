#include "estimators/health/place_evidence.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <unordered_set>

#include "core/lidar/deskew.h"
#include "core/lidar/plane_map.h"
#include "core/lidar/voxel_planes.h"
#include "core/magnetometer/array_reading.h"

namespace lodestone {

namespace {

constexpr std::size_t kSampledPoints = 4000;  // of a scan
constexpr double kEven_m = 1.0;               // one point in each cube of this edge: neighbours say the same
constexpr std::size_t kJudgedPoints = 400;    // of these
constexpr std::size_t kFewest = 20;           // points above the floor that a share is taken of
constexpr double kAboveFloor_m = 0.3;         // all floors look alike
constexpr double kFloorRange_m = 20.0;        // where the floor is looked for
constexpr double kLowestShare = 0.02;         // of the points: the floor
constexpr float kOnPlane_m = 0.15F;           // of a point that agrees with a plane

/// Poses where the robot is not: x and y in metres, yaw in radians, from the estimate.
constexpr std::array<std::array<double, 3>, 6> kDecoys{
    {{2.1, 0.7, 0.6}, {-1.3, 2.4, -0.9}, {0.9, -3.2, 1.7}, {-3.4, -1.1, 2.6}, {4.3, 2.2, -2.2}, {-2.6, 3.7, -1.5}}};

Pose decoy(const Pose& T_map_imu, const std::array<double, 3>& offset) {
  const Quaternion turn(Eigen::AngleAxisd(offset[2], Vector3::UnitZ()));
  return {(turn * T_map_imu.rotation).normalized(), T_map_imu.position + Vector3(offset[0], offset[1], 0.0)};
}

/// The first point in each cube, at most kJudgedPoints, spread evenly over the scan. Without this, a pallet beside the
/// robot counts more than the hall.
std::vector<Eigen::Vector3f> spread_evenly(const std::vector<Eigen::Vector3f>& points) {
  std::unordered_set<std::uint64_t> taken;
  std::vector<Eigen::Vector3f> firsts;
  for (const Eigen::Vector3f& point : points) {
    if (taken.insert(voxel_key(voxel_of(point, static_cast<float>(1.0 / kEven_m)))).second) firsts.push_back(point);
  }
  const std::size_t every = firsts.size() / kJudgedPoints + 1;
  std::vector<Eigen::Vector3f> judged;
  for (std::size_t i = 0; i < firsts.size(); i += every) judged.push_back(firsts[i]);
  return judged;
}

double share_on_map(std::span<const Eigen::Vector3f> points, const Pose& T_map_imu, const PlaneMap& map) {
  const Eigen::Matrix3f rotation = T_map_imu.rotation.toRotationMatrix().cast<float>();
  int hits = 0;
  for (const Eigen::Vector3f& point : points) {
    const Eigen::Vector3f place = ((rotation * point).cast<double>() + T_map_imu.position).cast<float>();
    if (map.agrees(place, kOnPlane_m)) ++hits;
  }
  return static_cast<double>(hits) / static_cast<double>(points.size());
}

}  // namespace

double fit_of(const PlaceEvidence& evidence) {
  return (evidence.scan_share - evidence.decoy_share) / std::max(1.0 - evidence.decoy_share, 0.05);
}

bool outweighs(const PlaceEvidence& found, const PlaceEvidence& estimate) {
  return fit_of(found) > fit_of(estimate) && (found.field_odds > 0.0 || !(estimate.field_odds > 0.0));
}

PlaceEvidence PlaceJudge::judge(const ScanBundle& bundle, const Estimate& estimate) {
  PlaceEvidence evidence;
  const NavState& state = estimate.state;
  if (bundle.imu.empty() || !state.T_map_imu.position.allFinite() || !state.T_map_imu.rotation.coeffs().allFinite())
    return evidence;
  if (input_.planes != nullptr && !bundle.scan.points.empty()) judge_scan(bundle, estimate, evidence);
  if (input_.field != nullptr) judge_field(bundle, state, evidence);
  return evidence;
}

void PlaceJudge::judge_scan(const ScanBundle& bundle, const Estimate& estimate, PlaceEvidence& evidence) const {
  NavState state = estimate.state;
  if (estimate.scan_pose) state.T_map_imu = *estimate.scan_pose;
  std::vector<LidarPoint> sample;
  const std::size_t every = std::max<std::size_t>(1, bundle.scan.points.size() / kSampledPoints);
  for (std::size_t i = 0; i < bundle.scan.points.size(); i += every) {
    const LidarPoint& point = bundle.scan.points[i];
    if (point.position.allFinite() && point.position.norm() > 0.1F) sample.push_back(point);
  }
  std::vector<Eigen::Vector3f> points =
      deskew(sample, bundle.scan.start, ScanMotion(state, bundle.imu), input_.suite.lidar.T_imu_lidar);
  const Eigen::Vector3f up = (state.T_map_imu.rotation.conjugate() * Vector3::UnitZ()).cast<float>();
  std::vector<float> heights_m;
  for (const Eigen::Vector3f& point : points) {
    if (point.norm() < kFloorRange_m) heights_m.push_back(up.dot(point));
  }
  if (heights_m.size() < kFewest) return;
  const auto lowest = heights_m.begin() + static_cast<std::ptrdiff_t>(kLowestShare * heights_m.size());
  std::nth_element(heights_m.begin(), lowest, heights_m.end());
  const float floor_m = *lowest + static_cast<float>(kAboveFloor_m);
  std::erase_if(points, [&](const Eigen::Vector3f& point) { return up.dot(point) < floor_m; });
  points = spread_evenly(points);
  if (points.size() < kFewest) return;
  evidence.scan_points = static_cast<int>(points.size());
  if (state.T_map_imu.position.cwiseAbs().maxCoeff() > voxels_reach_m(input_.planes->voxel_m())) return;
  const auto map = input_.planes->around(state.T_map_imu.position);
  evidence.scan_share = share_on_map(points, state.T_map_imu, *map);
  for (const std::array<double, 3>& offset : kDecoys) {
    evidence.decoy_share += share_on_map(points, decoy(state.T_map_imu, offset), *map) / kDecoys.size();
  }
}

void PlaceJudge::judge_field(const ScanBundle& bundle, const NavState& state, PlaceEvidence& evidence) {
  const auto array = reading_at_end(bundle, state, input_.suite);
  if (!array) return;
  if (!background_) background_ = field_background(*input_.field);
  const FieldEvidence here = field_evidence(*array, state.T_map_imu, input_.suite, *input_.field, *background_);
  const Pose far{state.T_map_imu.rotation, Vector3::Constant(1e7)};
  const FieldEvidence anywhere = field_evidence(*array, far, input_.suite, *input_.field, *background_);
  for (const MeanReading& reading : array->readings) {
    evidence.field_ut += state.T_map_imu.rotation * (reading.T_end_mag.rotation * reading.measured_ut) /
                         static_cast<double>(array->readings.size());
  }
  evidence.field_spread_ut = background_->sigma_ut;
  evidence.field_readings = here.on_map;
  evidence.field_odds = here.log_likelihood - anywhere.log_likelihood;
}

}  // namespace lodestone
