#include "estimators/smoother/smoother.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/imu/propagation.h"
#include "core/imu/scan_motion.h"
#include "core/observability/window_information.h"
#include "estimators/initialization.h"
#include "estimators/smoother/field_pose.h"
#include "estimators/smoother/field_weighting.h"
#include "frontends/lidar/deskew.h"

namespace lodestone {

/// What a keyframe keeps beside its variables, for as long as it is in the window.
struct Smoother::Frame {
  Time scan_start = 0;
  std::vector<ImuSample> imu;             // over this scan's bundle
  std::vector<LidarPoint> points;         // sampled, lidar frame, own times
  std::vector<MagneticArraySample> magnetic;
  Matrix6 predicted_covariance = Matrix6::Identity();  // before this scan's measurements
  Pose predicted;
  std::shared_ptr<const PlaneMap> planes;  // that correspondences point into
  std::vector<Correspondence> correspondences;
  CondensedCost cost;
  Matrix6 lidar_information = Matrix6::Zero();  // without what noisy normals pretend
  Degeneracy degeneracy;
  Pose associated;                        // where correspondences were looked for
  Pose analysed;                          // where the degeneracy was analysed
  Estimate estimate;                      // diagnostics, filled as the scan is worked on
  bool field_disagrees = false;           // of a run without LiDAR: the field's verdict at this scan
};

namespace {

/// The field of one scan does not see a direction of which it knows less than this share of what the prediction knows.
/// Well below what a window of scans adds up to, so that no information worth having is lost.
constexpr double kUnseenGain = 1e-3;

/// What an IMU's noise within a scan does to all its points together, seen from the scan's end: the mean over the scan
/// of white noise integrated from each point's time to the end has a third of the variance of the whole. The velocity's
/// error acts over half the scan.
Matrix6 deskew_covariance(const SensorSuite& suite, const SmootherOptions& options, double duration_s) {
  Vector6 variance;
  variance.head<3>().setConstant(std::pow(suite.imu.gyroscope_noise_density, 2) * duration_s / 3.0);
  variance.tail<3>().setConstant(std::pow(0.5 * duration_s * options.deskew_velocity_sigma_m_s, 2));
  return variance.asDiagonal();
}

}  // namespace

Smoother::Smoother(EstimatorInput input)
    : input_(std::move(input)), crowding_(array_crowding(input_.suite, input_.options.magnetic.map_correlation_m)) {
  // Without a cloud map nothing tells the height; but a field map of one layer holds at that layer alone.
  if (input_.planes == nullptr && input_.field->grid().heights_m.size() == 1) {
    level_ = std::make_unique<Plane>();
    level_->normal = Eigen::Vector3f::UnitZ();
    level_->major = Eigen::Vector3f::UnitX();
    level_->center = Eigen::Vector3f(0.0F, 0.0F, static_cast<float>(input_.field->grid().heights_m.front()));
  }
}

Smoother::~Smoother() = default;

void Smoother::process(const ScanBundle& bundle, EstimateSink& sink) {
  const auto begin = std::chrono::steady_clock::now();
  const RunOptions& options = input_.options;
  auto frame = std::make_unique<Frame>();
  frame->scan_start = bundle.scan.start;
  frame->imu = bundle.imu;
  frame->magnetic = bundle.magnetic;
  if (input_.planes != nullptr) frame->points = sample_scan(bundle.scan, input_.suite.lidar, options.lidar.sampling);

  if (window_ == nullptr) {
    InitialState start = initial_state(input_.initial_pose, input_.suite.gravity_m_s2, options.initial);
    const NavState state = propagate(start.state, bundle.imu, input_.suite.imu, &start.covariance);
    window_ = std::make_unique<SlidingWindow>(bundle.scan.end, state, start.covariance,
                                              static_cast<int>(input_.suite.magnetometers.size()), input_.suite.imu,
                                              options.smoother.solver);
    frame->predicted_covariance = start.covariance.topLeftCorner<6, 6>();
  } else {
    const std::size_t newest = window_->size() - 1;
    const NavState state = propagate(window_->state(newest), bundle.imu, input_.suite.imu, nullptr);
    window_->add_keyframe(bundle.scan.end, state, bundle.imu);
    // One scan of IMU adds little beside what velocity is uncertain to.
    frame->predicted_covariance = frames_.back()->estimate.covariance;
    const double step_s = to_seconds(bundle.scan.end - frames_.back()->estimate.time);
    frame->predicted_covariance.diagonal().head<3>().array() +=
        std::pow(input_.suite.imu.gyroscope_noise_density, 2) * step_s;
    frame->predicted_covariance.diagonal().tail<3>().array() += std::pow(0.05 * step_s, 2);
  }
  frame->estimate.time = bundle.scan.end;
  frames_.push_back(std::move(frame));
  const std::size_t newest = window_->size() - 1;
  frames_.back()->predicted = window_->state(newest).T_map_imu;

  register_scan(newest);
  weigh(newest);
  int iterations = window_->solve();
  for (int i = 0; i < options.smoother.reassociations; ++i) {
    renew_moved(i > 0);
    iterations += window_->solve();
  }

  const bool leaves = window_->size() > 1 &&
                      to_seconds(window_->time(newest) - window_->time(0)) >= options.smoother.window_s - 1e-6;
  std::vector<std::size_t> wanted{newest};
  if (leaves) wanted.push_back(0);
  const std::vector<Matrix6> covariances = window_->pose_covariances(wanted);

  Estimate& estimate = frames_.back()->estimate;
  estimate.state = window_->state(newest);
  estimate.covariance = covariances[0];
  estimate.diagnostics.iterations = iterations;
  estimate.health = judge(estimate);
  if (input_.planes == nullptr) {
    agreement_.add(estimate.diagnostics, to_seconds(frames_.back()->imu.back().time - frames_.back()->imu.front().time));
    frames_.back()->field_disagrees = agreement_.lost();
    if (agreement_.lost()) estimate.health = Health::lost;
  }
  if (leaves) hand_out_oldest(covariances[1], sink);
  Estimate& causal = frames_.back()->estimate;
  causal.diagnostics.step_ms =
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  sink.causal(causal);
}

void Smoother::register_scan(std::size_t k) {
  Frame& frame = *frames_[k];
  const RunOptions& options = input_.options;
  const NavState state = window_->state(k);
  frame.associated = state.T_map_imu;
  if (input_.planes == nullptr) {
    hold_height(k);
    return;
  }
  const ScanMotion motion(state, frame.imu);
  const std::vector<Eigen::Vector3f> points =
      deskew(frame.points, frame.scan_start, motion, input_.suite.lidar.T_imu_lidar);
  const std::shared_ptr<const PlaneMap> planes = input_.planes->around(state.T_map_imu.position);
  frame.correspondences =
      associate(points, state.T_map_imu, frame.predicted_covariance, *planes, input_.suite.lidar, options.lidar.association);
  frame.planes = planes;
  frame.cost = condense(frame.correspondences, state.T_map_imu);
  frame.lidar_information = frame.cost.hessian(state.T_map_imu) -
                            options.degeneracy.normal_noise_margin * frame.cost.spurious_information;
  Diagnostics& diagnostics = frame.estimate.diagnostics;
  diagnostics.points = static_cast<int>(points.size());
  diagnostics.correspondences = frame.cost.count;
  diagnostics.inlier_share = points.empty() ? 0.0 : static_cast<double>(frame.cost.count) / static_cast<double>(points.size());
}

void Smoother::hold_height(std::size_t k) {
  Frame& frame = *frames_[k];
  frame.correspondences.clear();
  if (level_ != nullptr) {
    const double sigma_m = input_.options.magnetic.height_sigma_m;
    for (const MagnetometerModel& magnetometer : input_.suite.magnetometers) {
      frame.correspondences.push_back({magnetometer.T_imu_mag.position.cast<float>(), level_.get(),
                                       static_cast<float>(sigma_m * sigma_m)});
    }
  }
  frame.cost = condense(frame.correspondences, frame.associated);
  window_->set_lidar(k, frame.cost, frame.correspondences, {}, Matrix6::Zero());
}

Degeneracy Smoother::analyse(std::size_t k) const {
  const DegeneracyOptions& options = input_.options.degeneracy;
  const Frame& frame = *frames_[k];
  if (options.rule == DegeneracyRule::none) return no_degeneracy();
  if (options.rule == DegeneracyRule::paper) {
    return analyse_by_eigenvalue(unit_hessian(frame.correspondences, frame.associated), options);
  }
  std::vector<Matrix6> information;
  std::vector<ChainLink> links;
  for (std::size_t i = 0; i < frames_.size(); ++i) information.push_back(frames_[i]->lidar_information);
  for (std::size_t i = 0; i + 1 < frames_.size(); ++i) links.push_back(window_->link(i));
  const Matrix6 known = k + 1 == frames_.size() ? newest_pose_information(information, links)
                                                : marginal_pose_information(information, links)[k];
  const NavState state = window_->state(k);
  return without_tilt(analyse_by_sigma(known, std::max(frame.cost.range_rms_m, 1.0), options),
                      state.T_map_imu.rotation.conjugate() * -state.gravity.normalized());
}

void Smoother::weigh(std::size_t k) {
  Frame& frame = *frames_[k];
  const RunOptions& options = input_.options;
  Diagnostics& diagnostics = frame.estimate.diagnostics;
  double factor = 1.0;
  PoseMask field_mask;
  if (input_.planes != nullptr) {
    // Hidden directions follow those of the keyframe before; a keyframe analysed again follows itself.
    const Degeneracy analysed = analyse(k);
    if (k + 1 < frames_.size()) {
      frame.degeneracy = follow(analysed, frame.associated, frame.degeneracy, frame.analysed, options.degeneracy.follow_gain);
    } else if (k > 0) {
      frame.degeneracy = follow(analysed, frame.associated, frames_[k - 1]->degeneracy, frames_[k - 1]->analysed,
                                options.degeneracy.follow_gain);
    } else {
      frame.degeneracy = analysed;
    }
    frame.analysed = frame.associated;
    window_->set_lidar(k, frame.cost, frame.correspondences,
                       PoseMask(frame.degeneracy.lidar_projector(), frame.associated),
                       deskew_covariance(input_.suite, options.smoother, to_seconds(frame.estimate.time - frame.scan_start)));
    diagnostics.direction_sigma_m = frame.degeneracy.sigma_m;
    diagnostics.direction_weight = frame.degeneracy.kept;
    diagnostics.degenerate_directions = frame.degeneracy.degenerate_directions;
    diagnostics.lidar_rmse_m =
        frame.cost.count == 0 ? 0.0 : std::sqrt(std::max(0.0, frame.cost.cost(frame.associated)) / frame.cost.weight_sum);
    if (options.degeneracy.rule != DegeneracyRule::none) {
      if (frame.degeneracy.degenerate_directions > 0) {
        field_mask = PoseMask(frame.degeneracy.magnetic_projector(), frame.associated);
      } else if (options.magnetic.shrink != MagneticShrink::none) {
        factor = options.magnetic.beta * options.magnetic.beta;
      }
    }
  }
  diagnostics.magnetic_shrink = std::sqrt(factor);
  if (input_.field == nullptr || frame.magnetic.empty()) return;

  const NavState state = window_->state(k);
  const std::vector<ArrayReading> arrays = average_array(frame.magnetic, ScanMotion(state, frame.imu), input_.suite,
                                                         options.magnetic.samples_per_reading);
  if (arrays.empty()) return;
  const double spacing_m = state.velocity.norm() * to_seconds(frame.imu.back().time - frame.imu.front().time) /
                           static_cast<double>(arrays.size());
  const FieldWeighting weighting{input_.suite, *input_.field, options.magnetic, crowding_,
                                 [&](int magnetometer) { return window_->magnetometer_bias(k, magnetometer); }};
  FieldStatistics statistics;
  // Huber's weight judges the readings against the prediction, before they had a say.
  const auto weighed = [&](std::span<const ArrayReading> some) {
    return weigh_field(some, frame.predicted, frame.predicted_covariance, spacing_m, factor, weighting, statistics);
  };
  if (options.magnetic.measurement == MagneticMeasurement::pose) {
    std::vector<std::vector<FieldReading>> samples;
    for (const ArrayReading& array : arrays) samples.push_back(weighed({&array, 1}));
    window_->set_field_pose(k, field_pose(samples, frame.predicted, frame.predicted_covariance, *input_.field,
                                          options.magnetic.interpolation, kUnseenGain), field_mask);
  } else {
    window_->set_field(k, input_.field, options.magnetic.interpolation, weighed(arrays), field_mask);
  }
  diagnostics.magnetic_samples = statistics.arrays;
  diagnostics.magnetic_rejected = statistics.rejected;
  diagnostics.magnetic_off_map = statistics.off_map;
  diagnostics.magnetic_weight = statistics.arrays == 0 ? 0.0 : statistics.weight_sum / statistics.arrays;
  diagnostics.magnetic_residual_ut =
      statistics.components == 0 ? 0.0 : std::sqrt(statistics.residual_squared_sum / statistics.components);
}

bool Smoother::moved(std::size_t k) const {
  const Vector6 step = window_->state(k).T_map_imu.boxminus(frames_[k]->associated);
  return step.tail<3>().norm() > input_.options.smoother.reassociate_moved_m ||
         step.head<3>().norm() > input_.options.smoother.reassociate_turned_deg * M_PI / 180.0;
}

void Smoother::renew_moved(bool newest_only) {
  const std::size_t newest = window_->size() - 1;
  for (std::size_t k = newest_only ? newest : 0; k <= newest; ++k) {
    // The newest always: its first correspondences came from a prediction.
    if (k != newest && !moved(k)) continue;
    register_scan(k);
    weigh(k);
  }
}

void Smoother::hand_out_oldest(const Matrix6& covariance, EstimateSink& sink) {
  Estimate estimate = frames_.front()->estimate;
  estimate.state = window_->state(0);
  estimate.covariance = covariance;
  estimate.health = frames_.front()->field_disagrees ? Health::lost : judge(estimate);
  sink.best(estimate);
  window_->marginalize_oldest();
  frames_.pop_front();
}

void Smoother::finish(EstimateSink& sink) {
  if (window_ == nullptr) return;
  std::vector<std::size_t> all(window_->size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = k;
  const std::vector<Matrix6> covariances = window_->pose_covariances(all);
  for (std::size_t k = 0; k < all.size(); ++k) {
    Estimate estimate = frames_[k]->estimate;
    estimate.state = window_->state(k);
    estimate.covariance = covariances[k];
    estimate.health = frames_[k]->field_disagrees ? Health::lost : judge(estimate);
    sink.best(estimate);
  }
  frames_.clear();
  window_.reset();
}

}  // namespace lodestone
