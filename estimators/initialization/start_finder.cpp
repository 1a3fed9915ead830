#include "estimators/initialization/start_finder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/geometry/pose_distance.h"
#include "core/imu/scan_motion.h"
#include "core/lidar/scan_sampling.h"
#include "core/parallel.h"
#include "estimators/initialization/start_track.h"

namespace lodestone {

namespace {

constexpr double kFinalistMargin = 14.0;  // log-likelihood below the best
constexpr std::size_t kFinalists = 12;
constexpr double kFirstLook_s = 1.0;      // of tracking, before deciding whether more data is required
constexpr double kSettled_s = 0.5;        // of tracking, after which the pose has converged
constexpr double kLeastLag_s = 0.2;       // between the two poses that a velocity is computed from
constexpr double kStationsApart_m = 1.0;  // scans at this distance from each other count as independent
constexpr double kSame_m = 0.3;
constexpr double kSame_rad = 3.0 * std::numbers::pi / 180.0;
constexpr std::size_t kReported = 5;
constexpr double kFoundSigma_m = 0.5;  // of a found pose: the search distinguishes places, an estimator refines them

/// The bundle with a part of its points: each scan is sampled once for all hypotheses.
ScanBundle sampled(ScanBundle bundle, const SensorSuite& suite, const ScanSamplingOptions& sampling) {
  bundle.scan.points = sample_scan(bundle.scan, suite.lidars(), sampling);
  bundle.sampled.reset();
  return bundle;
}

/// Evidence of one scan for a hypothesis: LiDAR and field at the state of its track, or at the pose near it with which
/// the readings fit best, if both together are then more likely. Where the scan sees only people, they turn the track
/// by degrees, and this error would decide between places whose field is alike.
StartCandidate weigh_scan(const ScanBundle& bundle, const NavState& state, const EstimatorInput& input,
                          const StartEvidence& evidence, double& nowhere) {
  const Quaternion to_imu = state.T_map_imu.rotation.conjugate();
  const StartScan scan = prepare_start(bundle, to_imu * Vector3::UnitZ(), to_imu * state.velocity, input.suite);
  const std::vector<Eigen::Vector3f> points = above_floor(scan);
  const auto array = reading_at_end(bundle, state, input.suite);
  const ArrayReading* readings = array ? &*array : nullptr;
  const auto planes = input.planes->around(state.T_map_imu.position);
  StartCandidate candidate;
  candidate.T_map_imu = state.T_map_imu;
  evidence.weigh(points, readings, *planes, candidate);
  if (const auto T_moved = evidence.moved_by_field(state.T_map_imu, Matrix6::Zero(), readings)) {
    StartCandidate moved;
    moved.T_map_imu = *T_moved;
    evidence.weigh(points, readings, *planes, moved);
    if (moved.log_likelihood > candidate.log_likelihood) candidate = moved;
    candidate.T_map_imu = state.T_map_imu;
  }
  nowhere = evidence.nowhere(points, readings, state.T_map_imu.rotation);
  return candidate;
}

/// Scans that count as independent: the last one, and before it one after each further kStationsApart_m.
std::vector<std::size_t> stations_of(const std::vector<NavState>& states) {
  std::vector<std::size_t> stations{states.size() - 1};
  for (std::size_t k = states.size(); k-- > 0;) {
    const Vector3 way = states[k].T_map_imu.position - states[stations.back()].T_map_imu.position;
    if (way.norm() >= kStationsApart_m) stations.push_back(k);
  }
  return stations;
}

/// Propagates a tracked state back through the IMU to the log's begin. There the first scan with points is registered
/// again, now deskewed, and the resulting shift corrects the velocity, unless the state follows too soon for that.
StartHypothesis back_to_begin(Time begin, const ScanBundle& bundle, Time settled, const NavState& state,
                              std::span<const ImuSample> imu, const EstimatorInput& input) {
  NavState tracked = state;
  // Within half a second, the filter mistakes errors of the unknown velocity for an accelerometer bias.
  tracked.accelerometer_bias.setZero();
  tracked.gravity = Vector3(0.0, 0.0, -input.suite.gravity_m_s2);
  const ScanMotion back(tracked, imu);
  const Pose start = back.pose(begin);
  const Pose end = back.pose(bundle.scan.end);
  // A deskewed scan has no duration; the velocity is then taken over the last millisecond.
  const Time scan_time = std::max<Time>(1'000'000, bundle.scan.end - bundle.scan.start);
  const double lag_s = to_seconds(settled - bundle.scan.end);
  const Vector3 velocity = (end.position - back.pose(bundle.scan.end - scan_time).position) / to_seconds(scan_time);
  if (lag_s < kLeastLag_s) return {.T_map_imu = start, .velocity = velocity, .lidar = {}, .field = {}};
  const auto planes = input.planes->around(end.position);
  Vector3 correction = Vector3::Zero();
  Pose registered = end;
  for (int round = 0; round < 2; ++round) {
    const Quaternion to_imu = registered.rotation.conjugate();
    const StartScan again =
        prepare_start(bundle, to_imu * Vector3::UnitZ(), to_imu * (velocity + correction), input.suite);
    registered = register_scan(again.points, end, *planes, again.lidars, input.options.lidar.association).T_map_imu;
    correction = (end.position - registered.position) / lag_s;
  }
  StartHypothesis result;
  result.T_map_imu = registered * (end.inverse() * start);
  result.T_map_imu.position -= to_seconds(bundle.scan.end - begin) * correction;
  result.velocity = velocity + correction;
  return result;
}

/// A finalist with the evidence of all scans so far.
struct Finalist {
  Finalist(const EstimatorInput& input, const Pose& pose_at_start, StartTracking tracking)
      : track(input, pose_at_start, tracking) {}
  StartTrack track;
  StartCandidate last;
  double log_likelihood = 0.0;
  double nowhere = 0.0;
  bool doubled = false;
};

}  // namespace

EstimatorInput begin_at(const StartHypothesis& found, EstimatorInput input) {
  input.initial_pose = found.T_map_imu;
  input.initial_velocity = found.velocity;
  InitialOptions& initial = input.options.initial;
  initial.position_sigma_m = std::max(initial.position_sigma_m, kFoundSigma_m);
  return input;
}

StartFinder::StartFinder(const EstimatorInput& input) : input_(input), options_(input.options.search) {
  if (input_.planes == nullptr) {
    throw InputError(
        "--initial-pose auto: expected a cloud map, found only a magnetic map, in which places repeat; pass --cloud "
        "MAP.pcd too, or give the initial pose");
  }
  search_ = std::make_unique<StartSearch>(*input_.planes, input_.field.get(), input_.suite,
                                          input_.options.lidar.association, options_);
}

FoundStart StartFinder::find(std::span<const ScanBundle> bundles) const {
  return find(bundles, {}, true);
}

std::optional<StartHypothesis> StartFinder::find_sure(std::span<const ScanBundle> bundles,
                                                      std::span<const Pose> supposed) const {
  const FoundStart found = find(bundles, supposed, false);
  if (!found.sure) return std::nullopt;
  return found.best.front();
}

FoundStart StartFinder::find(std::span<const ScanBundle> bundles, std::span<const Pose> supposed,
                             bool unsure_too) const {
  FoundStart result;
  const auto usable = std::find_if(bundles.begin(), bundles.end(), [](const ScanBundle& bundle) {
    return bundle.scan.points.size() >= kLeastStartPoints;
  });
  if (usable == bundles.end()) {
    throw InputError(
        fmt::format("--initial-pose auto: expected a scan of at least {} points in the log's first {} s, found none; "
                    "give the initial pose",
                    kLeastStartPoints, options_.data_s));
  }
  const auto first = static_cast<std::size_t>(usable - bundles.begin());
  const std::span<const ScanBundle> rest = bundles.subspan(first);
  const ScanSamplingOptions& sampling = input_.options.lidar.sampling;
  std::vector<ScanBundle> scans;  // the first of `rest`, sampled
  scans.reserve(rest.size());
  scans.push_back(sampled(rest.front(), input_.suite, sampling));
  const ScanBundle& bundle = scans.front();

  // The first scan, as if the robot were at rest.
  const std::vector<ImuSample> imu = imu_of(rest.size() > 1 ? rest.subspan(1) : rest);
  NavState still;
  still.T_map_imu.rotation = level_attitude(mean_up(imu));
  still.gravity = Vector3(0.0, 0.0, -input_.suite.gravity_m_s2);
  const Vector3 up = still.T_map_imu.rotation.conjugate() * Vector3::UnitZ();
  const StartScan scan = prepare_start(bundle, up, Vector3::Zero(), input_.suite);
  const auto array = reading_at_end(bundle, still, input_.suite);
  const StartCandidates candidates = search_->find(scan, array ? &*array : nullptr);
  result.candidates = candidates.found.size();
  if (candidates.found.empty()) {
    result.doubt =
        "the first scan fits no place of the cloud map: is it the map of this site, in metres, with z upwards?";
    return result;
  }

  // Candidates that fit about as well as the best are tracked.
  const Pose T_end_start = ScanMotion(still, bundle.imu).relative_pose(bundle.scan.start);
  const StartTracking tracking = tracking_of(rest);
  std::vector<Finalist> finalists;
  for (const StartCandidate& candidate : candidates.found) {
    if (finalists.size() == kFinalists) break;
    if (candidate.log_likelihood < candidates.found.front().log_likelihood - kFinalistMargin) break;
    finalists.emplace_back(input_, candidate.T_map_imu * T_end_start, tracking);
  }
  const std::size_t searched = finalists.size();
  if (first == 0) {
    for (const Pose& pose : supposed) finalists.emplace_back(input_, pose * T_end_start, tracking);
  }
  // The other candidates keep the probability from the first scan.
  double others = 0.0;
  for (std::size_t i = searched; i < candidates.found.size(); ++i) {
    others += std::exp(candidates.found[i].log_likelihood - candidates.found.front().log_likelihood);
  }

  // The others keep their share of the probability, whatever the tracks of the finalists show.
  if (!unsure_too && !(1.0 / (1.0 + others) >= options_.min_probability)) {
    result.doubt = "too many places fit the first scan alike";
    return result;
  }

  std::vector<double> probabilities(finalists.size());
  std::size_t best = 0;
  std::size_t tracked = 0;
  const auto end_of = [&](double seconds) {
    std::size_t count = 1;
    while (count < rest.size() && to_seconds(rest[count].scan.end - bundle.scan.start) <= seconds + 1e-3) ++count;
    return count;
  };
  for (const double look_s : {std::min(kFirstLook_s, options_.data_s), options_.data_s}) {
    const std::size_t upto = end_of(look_s);
    if (upto == tracked) break;
    for (std::size_t k = scans.size(); k < upto; ++k) scans.push_back(sampled(rest[k], input_.suite, sampling));
    const std::span<const ScanBundle> next = std::span(scans).subspan(tracked);
    parallel_for(std::size_t{0}, finalists.size(), [&](std::size_t i) {
      if (!finalists[i].doubled) finalists[i].track.follow(next);
    });
    tracked = upto;
    const std::vector<std::size_t> stations = stations_of(finalists[best].track.states());
    parallel_for(std::size_t{0}, finalists.size(), [&](std::size_t i) {
      Finalist& finalist = finalists[i];
      if (finalist.doubled) return;
      finalist.log_likelihood = finalist.nowhere = 0.0;
      for (const std::size_t station : stations) {
        double nowhere = 0.0;
        const StartCandidate at =
            weigh_scan(scans[station], finalist.track.states()[station], input_, search_->evidence(), nowhere);
        if (station == stations.front()) finalist.last = at;
        finalist.log_likelihood += at.log_likelihood;
        finalist.nowhere += nowhere;
      }
    });
    // Finalists that have converged to the same pose are merged: the best of them is tracked.
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < finalists.size(); ++i) {
      if (!finalists[i].doubled) order.push_back(i);
    }
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return finalists[a].log_likelihood > finalists[b].log_likelihood;
    });
    for (std::size_t a = 0; a < order.size(); ++a) {
      Finalist& finalist = finalists[order[a]];
      for (std::size_t b = 0; b < a && !finalist.doubled; ++b) {
        const Finalist& better = finalists[order[b]];
        finalist.doubled =
            !better.doubled && are_near(finalist.last.T_map_imu, better.last.T_map_imu, kSame_m, kSame_rad);
      }
    }
    best = order.front();
    const double reference = std::max(finalists[best].log_likelihood, finalists[best].nowhere);
    double sum =
        others * std::exp(finalists[best].log_likelihood - reference) + std::exp(finalists[best].nowhere - reference);
    for (std::size_t i = 0; i < finalists.size(); ++i) {
      probabilities[i] = finalists[i].doubled ? 0.0 : std::exp(finalists[i].log_likelihood - reference);
      sum += probabilities[i];
    }
    for (double& probability : probabilities) probability /= sum;
    if (probabilities[best] >= options_.min_probability) break;
  }
  result.data_s = to_seconds(rest[tracked - 1].scan.end - bundles.front().scan.start);

  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < finalists.size(); ++i) {
    if (!finalists[i].doubled) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return probabilities[a] > probabilities[b]; });
  if (order.size() > kReported) order.resize(kReported);
  // A pair's first state is that of the first scan.
  const std::size_t settled = tracking == StartTracking::pairs ? 0 : std::min(end_of(kSettled_s), tracked) - 1;
  const std::vector<ImuSample> to_settled = imu_of(bundles.subspan(0, first + settled + 1));
  for (const std::size_t i : order) {
    const Finalist& finalist = finalists[i];
    StartHypothesis hypothesis = back_to_begin(bundles.front().scan.start, bundle, rest[settled].scan.end,
                                               finalist.track.states()[settled], to_settled, input_);
    hypothesis.probability = probabilities[i];
    hypothesis.lidar = finalist.last.lidar;
    hypothesis.field = finalist.last.field;
    result.best.push_back(hypothesis);
  }
  if (finalists[best].track.lost()) {
    result.doubt = "the filter lost track of the most probable place";
  } else if (!candidates.complete) {
    result.doubt = "the search stopped early, at search.max_nodes";
  } else if (!(probabilities[best] >= options_.min_probability)) {
    result.doubt = fmt::format("the most probable place has {:.1f} %", 100.0 * probabilities[best]);
  } else {
    result.sure = true;
  }
  return result;
}

}  // namespace lodestone
