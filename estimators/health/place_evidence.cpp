#include "estimators/health/place_evidence.h"

#include <algorithm>
#include <array>

#include "core/lidar/voxel_planes.h"
#include "core/magnetometer/array_reading.h"

namespace lodestone {

namespace {

/// Points above the floor, one in each cube of 1 m: of fewer, most can be people and vehicles around the robot.
constexpr std::size_t kFewestJudged = 60;

/// Poses where the robot is not: x and y in metres, yaw in radians, from the estimate.
constexpr std::array<std::array<double, 3>, 6> kDecoys{
    {{2.1, 0.7, 0.6}, {-1.3, 2.4, -0.9}, {0.9, -3.2, 1.7}, {-3.4, -1.1, 2.6}, {4.3, 2.2, -2.2}, {-2.6, 3.7, -1.5}}};

Pose decoy(const Pose& T_map_imu, const std::array<double, 3>& offset) {
  const Quaternion turn(Eigen::AngleAxisd(offset[2], Vector3::UnitZ()));
  return {(turn * T_map_imu.rotation).normalized(), T_map_imu.position + Vector3(offset[0], offset[1], 0.0)};
}

bool can_judge(const ScanBundle& bundle, const NavState& state) {
  return !bundle.imu.empty() && state.T_map_imu.position.allFinite() && state.T_map_imu.rotation.coeffs().allFinite();
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
  scan_.reset();
  const NavState& state = estimate.state;
  if (!can_judge(bundle, state)) return evidence;
  if (input_.planes != nullptr && !bundle.scan.points.empty()) {
    scan_ = judged_scan(bundle, estimate, input_.suite);
    judge_scan(evidence);
  }
  if (input_.field != nullptr) judge_field(bundle, state, evidence);
  return evidence;
}

void PlaceJudge::judge_scan(PlaceEvidence& evidence) const {
  const JudgedScan& scan = *scan_;
  if (scan.even.size() < kFewestJudged) return;
  evidence.scan_points = static_cast<int>(scan.even.size());
  if (!is_on_grid(scan.T_map_imu)) return;
  const auto map = input_.planes->around(scan.T_map_imu.position);
  evidence.scan_share = share_on_map(scan.even, scan.T_map_imu, *map);
  for (const std::array<double, 3>& offset : kDecoys) {
    evidence.decoy_share += share_on_map(scan.even, decoy(scan.T_map_imu, offset), *map) / kDecoys.size();
  }
}

bool PlaceJudge::is_on_grid(const Pose& T_map_imu) const {
  return !(T_map_imu.position.cwiseAbs().maxCoeff() > voxels_reach_m(input_.planes->voxel_m()));
}

std::optional<NearbyPlace> PlaceJudge::nearby(const ScanBundle& bundle, const Estimate& estimate) {
  if (!scan_) return std::nullopt;
  const NavState& state = estimate.state;
  const JudgedScan& scan = *scan_;
  if (!is_on_grid(scan.T_map_imu)) return std::nullopt;
  std::function<double(const Pose&)> readings;
  const auto array = input_.field != nullptr ? reading_at_end(bundle, state, input_.suite) : std::nullopt;
  if (array) {
    readings = [&](const Pose& T_map_imu) {
      return field_evidence(*array, T_map_imu, input_.suite, *input_.field, background()).log_likelihood;
    };
    background();  // before it is asked for in parallel
  }
  return find_nearby(scan, state, *input_.planes->around(scan.T_map_imu.position), input_.suite,
                     input_.options.lidar.association, readings);
}

const FieldBackground& PlaceJudge::background() {
  if (!background_) background_ = field_background(*input_.field);
  return *background_;
}

void PlaceJudge::judge_field(const ScanBundle& bundle, const NavState& state, PlaceEvidence& evidence) {
  const auto array = reading_at_end(bundle, state, input_.suite);
  if (!array) return;
  const FieldEvidence here = field_evidence(*array, state.T_map_imu, input_.suite, *input_.field, background());
  const Pose far{state.T_map_imu.rotation, Vector3::Constant(1e7)};
  const FieldEvidence anywhere = field_evidence(*array, far, input_.suite, *input_.field, background());
  for (const MeanReading& reading : array->readings) {
    evidence.field_ut += state.T_map_imu.rotation * (reading.T_end_mag.rotation * reading.measured_ut) /
                         static_cast<double>(array->readings.size());
  }
  evidence.field_spread_ut = background().sigma_ut;
  evidence.field_readings = here.on_map;
  evidence.field_odds = here.log_likelihood - anywhere.log_likelihood;
}

}  // namespace lodestone
