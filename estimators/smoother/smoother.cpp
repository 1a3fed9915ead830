#include "estimators/smoother/smoother.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "core/imu/gap_noise.h"
#include "core/imu/propagation.h"
#include "core/lidar/map_error.h"
#include "core/lidar/scan_sampling.h"
#include "core/observability/window_information.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "core/work_times.h"
#include "estimators/initial_state.h"
#include "estimators/smoother/bound.h"
#include "estimators/smoother/gap_search.h"

namespace lodestone {

namespace {

constexpr int kNarrowings = 3;  // rounds that narrow the association gate
constexpr double kWideGate_m = 0.01;
constexpr double kWideGate_rad = 0.003;

// A keyframe that moved or turned further gets new correspondences: the newest one in its own step, others in the next.
// An edge of a voxel is 25 times as long (docs/design/048-options-that-went.md).
constexpr double kReassociateMoved_m = 0.01;
constexpr double kReassociateTurned_deg = 0.1;

double turn_variance(const Matrix6& gate) {
  return gate.diagonal().head<3>().sum();
}

double shift_variance(const Matrix6& gate) {
  return gate.diagonal().tail<3>().sum();
}

bool turns_far(const Matrix6& gate) {
  return turn_variance(gate) > kWideGate_rad * kWideGate_rad;
}

/// `bends_m2`: variance of an axis of the map's displacement. In a map that is bent by centimetres, a gate of
/// centimetres is not rough.
bool shifts_far(const Matrix6& gate, double bends_m2) {
  return shift_variance(gate) > kWideGate_m * kWideGate_m + bends_m2;
}

double known_bends_m2(const Keyframe& keyframe) {
  return keyframe.map_is_compared ? keyframe.long_map_error_variances_m2.sum() : 0.0;  // of an axis
}

/// A direction that is still unknown keeps its wide gate: the axis of a tunnel.
bool narrows(const Matrix6& gate, const Matrix6& narrower, double bends_m2) {
  return (shifts_far(gate, bends_m2) && shift_variance(narrower) < 0.5 * shift_variance(gate)) ||
         (turns_far(gate) && turn_variance(narrower) < 0.5 * turn_variance(gate));
}

}  // namespace

Smoother::Smoother(EstimatorInput input)
    : input_(std::move(input)),
      measurements_(input_),
      relocation_(input_),
      map_error_(input_.suite.calibration.lidar.map_displacement_sigma_m),
      wheel_watch_(input_.suite.calibration.wheels, input_.warnings) {}

Smoother::~Smoother() = default;

void Smoother::process(const ScanBundle& bundle, EstimateSink& sink) {
  const Stopwatch step;
  const RunOptions& options = input_.options;
  const bool solved = input_.linearize_at == nullptr;  // else only covariances are computed
  auto keyframe = std::make_unique<Keyframe>();
  take_measurements(*keyframe, bundle);
  imu_white_noise_.add(bundle.imu);
  keyframe->imu_noise = with_gap(imu_white_noise_.bound(input_.suite.imu), bundle.imu_gap_s);
  Matrix17 predicted_covariance;
  WheelCalibrationSigmas wheel_sigmas = input_.suite.calibration.wheels;

  if (window_ == nullptr) {
    InitialState start =
        initial_state(input_.initial_pose, input_.initial_velocity, input_.suite.gravity_m_s2, options.initial);
    NavState state = propagate(start.state, bundle.imu, keyframe->imu_noise, &start.covariance);
    keyframe->estimate.time = bundle.scan.end;
    const auto found =
        solved ? relocation_.better_start(*keyframe, state, start.covariance.topLeftCorner<6, 6>()) : std::nullopt;
    if (found) {
      warn_of_move("smoother.start_moved", "scan and field do not fit at the initial pose", state.T_map_imu, *found,
                   bundle.scan.end);
      state.T_map_imu = *found;
    }
    window_ = std::make_unique<SlidingWindow>(bundle.scan.end, state, start.covariance,
                                              static_cast<int>(input_.suite.magnetometers.size()), input_.suite.imu,
                                              options.smoother.solver, input_.suite.calibration);
    predicted_covariance = start.covariance;
    keyframe->predicted_covariance = start.covariance.topLeftCorner<6, 6>();
    keyframe->gate_covariance = keyframe->predicted_covariance;
    start.state = state;
    if (options.smoother.refine == Refinement::batch) {
      batch_ = std::make_unique<BatchRefinement>(input_, measurements_, start);
    }
  } else {
    const std::size_t newest = window_->size() - 1;
    SlidingWindow::NewestCovariance covariance = *newest_covariance_;
    const NavState before = window_->state(newest);
    const NavState state = propagate(before, bundle.imu, keyframe->imu_noise, &covariance.state);
    propagate(before, bundle.imu, keyframe->imu_noise, &covariance.seen);
    window_->set_imu_noise(keyframe->imu_noise);
    window_->add_keyframe(bundle.scan.end, state, bundle.imu);
    predicted_covariance = covariance.state;
    wheel_sigmas = covariance.wheels;
    keyframe->predicted_covariance = covariance.state.topLeftCorner<6, 6>();
    keyframe->gate_covariance = covariance.seen.topLeftCorner<6, 6>();
  }
  keyframe->field_variance_ut2 = field_error_.variance_a_reading_ut2();
  keyframe->map_error_variance_m2 = map_error_.cube_variance_m2();
  keyframe->long_map_error_variances_m2 = map_error_.variances_m2();
  keyframe->map_is_compared = map_error_.has_compared();
  keyframe->variance_scale = variance_scale_;
  keyframe->estimate.time = bundle.scan.end;
  keyframes_.push_back(std::move(keyframe));
  const std::size_t newest = window_->size() - 1;
  if (!solved) window_->set_state(newest, state_at(*input_.linearize_at, bundle.scan.end, window_->state(newest)));
  keyframes_.back()->predicted = window_->state(newest).T_map_imu;

  measurements_.weigh_wheels(*keyframes_.back(), window_->state(newest), predicted_covariance,
                             window_->wheel_correction(newest), wheel_sigmas);
  if (solved) relocate();
  keyframes_[newest]->motion_waits = solved && gate_is_wide(newest);
  const int reassociations = solved ? options.smoother.reassociations : 0;
  for (std::size_t k = 0; k < newest && reassociations > 0; ++k) {
    if (has_moved(k)) renew(k);
  }
  renew(newest);
  share_slide();
  int iterations = solved ? window_->solve() : 0;
  const bool narrowing = begins_to_narrow(newest);
  const int rounds = std::max(reassociations + (narrowing ? kNarrowings : 0), keyframes_[newest]->motion_waits ? 1 : 0);
  for (int i = 0; i < rounds; ++i) {
    const bool waited = i + 1 == rounds && std::exchange(keyframes_[newest]->motion_waits, false);
    if (narrowing && i > 0) keyframes_[newest]->gate_covariance = narrower_gate(newest);
    if (!(narrowing || waited || newest == 0 || has_moved(newest))) continue;
    renew(newest);
    share_slide();
    if (solved) iterations += window_->solve();
  }

  const SlidingWindow::ClockOffset clock = window_->clock_offset();
  const bool first = newest == 0 && solved;
  if (first) {
    // The first scan's noise estimate also applies to the first scan.
    follow_residuals(*keyframes_.back(), clock);
    keyframes_.back()->variance_scale = variance_scale_;
    keyframes_.back()->map_error_variance_m2 = map_error_.cube_variance_m2();
    renew(newest);
    iterations += window_->solve();
  }
  const std::size_t leaving = leaving_keyframes();
  std::vector<std::size_t> wanted{newest};
  for (std::size_t k = 0; k < leaving; ++k) wanted.push_back(k);
  std::vector<Matrix6> covariances;
  std::optional<WorkTimer> timed(Work::covariance);
  parallel_for(0, 2, [&](int part) {
    if (part == 0 && !first) follow_residuals(*keyframes_.back(), clock);
    if (part == 0) return;
    covariances = window_->pose_covariances(wanted);
    newest_covariance_ = window_->newest_covariance();  // from the same factorization
  });
  timed.reset();

  Estimate& estimate = keyframes_.back()->estimate;
  estimate.state = window_->state(newest);
  estimate.covariance = covariances[0];
  estimate.diagnostics.iterations = iterations;
  estimate.diagnostics.clock_offset_s = window_->clock_offset().offset_s;
  estimate.diagnostics.clock_sigma_s = window_->clock_offset().sigma_s;
  estimate.diagnostics.wheel_slip = window_->wheel_slip(newest);
  wheel_watch_.add(estimate);
  Estimate causal = estimate;
  const Pose& mounting = input_.suite.lidar.T_imu_lidar;  // the pose is for points that are transformed with it
  causal.scan_pose =
      window_->seen_pose(newest) * keyframes_.back()->lidar_correction.corrected(mounting) * mounting.inverse();
  for (std::size_t k = 0; k < leaving; ++k) {
    report(0, covariances[1 + k], sink);
    const WorkTimer marginalizing(Work::marginalize);
    window_->marginalize_oldest();
    keyframes_.pop_front();
  }
  causal.diagnostics.step_ms = step.elapsed_ms();
  sink.causal(causal);
}

/// Of a steady scan rate, one keyframe leaves for each new one. If scans become longer, this number of keyframes would
/// cover many times the window's length: two leave until the window is shorter than twice its length.
std::size_t Smoother::leaving_keyframes() const {
  const std::size_t newest = window_->size() - 1;
  const double length_s = to_seconds(window_->time(newest) - window_->time(0));
  const double most_s = input_.options.smoother.window_s;
  if (newest == 0 || length_s < most_s - 1e-6) return 0;
  return newest > 1 && length_s >= 2.0 * most_s - 1e-6 ? 2 : 1;
}

void Smoother::take_measurements(Keyframe& keyframe, const ScanBundle& bundle) const {
  keyframe.scan_start = bundle.scan.start;
  keyframe.imu = bundle.imu;
  keyframe.magnetic = bundle.magnetic;
  keyframe.wheel_samples = bundle.wheels;
  if (input_.planes != nullptr) {
    const WorkTimer timer(Work::sample);
    keyframe.points = registration_points(bundle, input_.suite.lidars(), input_.options.lidar.sampling);
  }
}

void Smoother::warn_of_move(const char* kind, const std::string& detail, const Pose& from, const Pose& to, Time time) {
  if (input_.warnings == nullptr) return;
  const Vector6 step = to.boxminus(from);
  input_.warnings->add(
      kind,
      fmt::format("{}; the pose was moved by {:.2f} m and {:.1f} deg to the best fit, at {:.3f} s", detail,
                  step.tail<3>().norm(), step.head<3>().norm() * 180.0 / M_PI, to_seconds(time)),
      time);
}

/// After seconds with an unobservable direction, searches along it for the best fit of scan and field, and moves all
/// keyframes there. After seconds without scans, no direction is known. Then the newest pose alone moves: how far the
/// others move is left to the solution, as their covariances say. A scan whose place is not found is not used.
void Smoother::relocate() {
  Keyframe& keyframe = *keyframes_.back();
  const std::size_t newest = window_->size() - 1;
  if (newest == 0) return;
  const auto bias_ut = [&](int magnetometer) { return window_->magnetometer_bias(newest, magnetometer); };
  if (is_adrift(keyframe)) {
    const auto found = relocation_.place_after_gap(keyframe, window_->state(newest), bias_ut);
    if (found) {
      warn_of_move("smoother.found_again", "the scan after a gap does not fit where the IMU predicts it",
                   keyframe.predicted, *found, keyframe.estimate.time);
      NavState state = window_->state(newest);
      state.T_map_imu = *found;
      window_->set_state(newest, state);
      keyframe.gate_covariance = covariance_after_gap();
    } else if (position_variance_m2(keyframe.predicted_covariance) > kMostAdrift_m * kMostAdrift_m) {
      leave_out_scan(keyframe, input_.warnings);
    }
    return;
  }
  const auto found = relocation_.better_place(keyframe, window_->state(newest), bias_ut);
  if (!found) return;
  warn_of_move("smoother.found_again", "scan and field do not fit at the pose predicted by the IMU", keyframe.predicted,
               *found, keyframe.estimate.time);
  window_->move(*found * keyframe.predicted.inverse());
  keyframe.predicted = window_->state(newest).T_map_imu;
}

/// All keyframes of the window move, and get new correspondences with the next scan.
bool Smoother::move(const Pose& T_new_old) {
  if (window_ == nullptr) return false;
  window_->move_with_prior(T_new_old);
  return true;
}

/// Sensor, surface and map noise differ from the data sheets: variance scales follow the residuals of the log, upwards
/// at once and downwards over about ten scans (docs/design/040-variance-from-residuals.md).
void Smoother::follow_residuals(const Keyframe& keyframe, const SlidingWindow::ClockOffset& clock) {
  const std::size_t newest = window_->size() - 1;
  if (input_.field != nullptr) {
    measurements_.judge_field_error(
        keyframe, window_->state(newest).T_map_imu,
        [&](int magnetometer) { return window_->magnetometer_bias(newest, magnetometer); },
        [&](int magnetometer) { return window_->magnetometer_matrix(magnetometer); }, clock, field_error_);
  }
  constexpr int kFewest = 100;  // least correspondences for a median
  constexpr double kGain = 0.1;
  if (static_cast<int>(keyframe.correspondences.size()) < kFewest) return;
  const Pose seen = window_->seen_pose(newest);
  if (map_error_.takes(seen.position)) {
    map_error_.add(analyse_map_error(keyframe.correspondences, seen), seen.position);
  }
  const double found = keyframe.variance_scale * residual_scale(keyframe.correspondences, seen);
  const double gain = keyframes_.size() == 1 ? 1.0 : kGain;
  variance_scale_ = std::max(1.0, variance_scale_ + gain * (found - variance_scale_));
}

Matrix6 Smoother::marginal_information(std::size_t k, double noise_subtracted) const {
  std::vector<Matrix6> information;
  std::vector<ChainLink> links;
  const double added_back = kNormalNoiseMargin - noise_subtracted;
  for (const auto& keyframe : keyframes_) {
    information.push_back(keyframe->lidar_information + added_back * keyframe->lidar.cost.spurious_information);
  }
  for (std::size_t i = 0; i + 1 < keyframes_.size(); ++i) links.push_back(window_->link(i));
  return marginal_pose_information(information, links, k);
}

void Smoother::renew(std::size_t k) {
  Keyframe& keyframe = *keyframes_[k];
  const NavState state = window_->state(k);
  const std::optional<NavState> state_before = k > 0 ? std::optional(window_->state(k - 1)) : std::nullopt;
  keyframe.lidar_correction = window_->lidar_correction();
  keyframe.map_error = window_->map_error(k);
  {
    const WorkTimer timer(Work::associate);
    measurements_.register_scan(keyframe, state, state_before ? &*state_before : nullptr);
  }
  const WorkTimer timer(Work::weigh);
  // Degenerate directions follow those of the previous keyframe; a keyframe analysed again follows itself.
  const Keyframe* before = k + 1 < keyframes_.size() ? &keyframe : k > 0 ? keyframes_[k - 1].get() : nullptr;
  const Degeneracy analysed =
      measurements_.analyse(keyframe, state, [&](double taken) { return marginal_information(k, taken); });
  measurements_.decide(keyframe, analysed, before == nullptr ? nullptr : &before->degeneracy,
                       before == nullptr ? Pose{} : before->analysed);
  measurements_.set_lidar(keyframe, k, *window_);
  const KeyframeField field = measurements_.weigh(
      keyframe, state, [&](int magnetometer) { return window_->magnetometer_bias(k, magnetometer); },
      [&](int magnetometer) { return window_->magnetometer_matrix(magnetometer); }, window_->clock_offset());
  measurements_.set_field(field, k, *window_);
  measurements_.set_wheels(keyframe, state, k, *window_);
}

/// The association gate, scaled to a tenth, but at least the present covariance of the pose.
Matrix6 Smoother::narrower_gate(std::size_t k) const {
  const WorkTimer timer(Work::covariance);
  return 0.01 * keyframes_[k]->gate_covariance + window_->seen_covariance(k);
}

/// Residuals of wrong correspondences look like motion within the scan, so this motion is estimated only once the gate
/// no longer narrows. Without this, a robot at rest began with 0.7 m/s and was lost within a second.
bool Smoother::gate_is_wide(std::size_t k) const {
  const Matrix6& gate = keyframes_[k]->gate_covariance;
  return shifts_far(gate, known_bends_m2(*keyframes_[k])) || turns_far(gate);
}

/// Within a wide gate, points on neighbouring surfaces count as much as those on the right one. After a rough
/// prediction (initialization, outage) the gate is therefore narrowed in each round of the step. Narrows it once and
/// returns true if the gate is wide and the covariance is smaller by now. Without this, the first scan of a car park
/// was 5 mm too low at a sigma of 0.2 mm.
bool Smoother::begins_to_narrow(std::size_t k) {
  Matrix6& gate = keyframes_[k]->gate_covariance;
  if (!gate_is_wide(k)) return false;
  const Matrix6 narrower = narrower_gate(k);
  if (!narrows(gate, narrower, known_bends_m2(*keyframes_[k]))) return false;
  gate = narrower;
  return true;
}

bool Smoother::has_moved(std::size_t k) const {
  return keyframes_[k]->moved(window_->seen_pose(k), kReassociateMoved_m, kReassociateTurned_deg);
}

/// All keyframes and the prior use the newest keyframe's degenerate direction. If the directions differed, their
/// difference would be spurious information about the slide (docs/design/010-unobservable-rigid-motion.md).
void Smoother::share_slide() {
  const Keyframe& newest = *keyframes_.back();
  const Slide slide = newest.degeneracy.slide(newest.analysed);
  if (!slide.any()) return;
  for (std::size_t k = 0; k + 1 < keyframes_.size(); ++k) {
    Keyframe& keyframe = *keyframes_[k];
    if (keyframe.degeneracy.degenerate_directions != 1) continue;
    keyframe.degeneracy = follow(keyframe.degeneracy, keyframe.analysed, newest.degeneracy, newest.analysed, 0.0);
    window_->set_lidar_mask(k, measurements_.lidar_mask(keyframe));
  }
  window_->follow_slide(slide);
}

void Smoother::report(std::size_t k, const Matrix6& covariance, EstimateSink& sink) {
  Estimate& estimate = keyframes_[k]->estimate;
  estimate.state = window_->state(k);
  estimate.covariance = covariance;
  if (batch_ == nullptr) {
    sink.best(estimate);
    return;
  }
  sink.smoothed(estimate);
  std::vector<Vector3> biases;
  for (std::size_t i = 0; i < input_.suite.magnetometers.size(); ++i) {
    biases.push_back(window_->magnetometer_bias(k, static_cast<int>(i)));
  }
  batch_->add(std::move(keyframes_[k]), std::move(biases));
}

void Smoother::finish(EstimateSink& sink) {
  if (window_ == nullptr) return;
  std::vector<std::size_t> all(window_->size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = k;
  const std::vector<Matrix6> covariances = window_->pose_covariances(all);
  for (std::size_t k = 0; k < all.size(); ++k) report(k, covariances[k], sink);
  calibration_ = window_->calibration_estimate();
  keyframes_.clear();
  window_.reset();
  if (batch_ == nullptr) return;
  batch_->set_calibration(calibration_);
  for (const Estimate& estimate : batch_->refine(input_.refining)) sink.best(estimate);
  calibration_ = batch_->calibration();
  batch_.reset();
}

}  // namespace lodestone
