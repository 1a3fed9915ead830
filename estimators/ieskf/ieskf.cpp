#include "estimators/ieskf/ieskf.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/imu/gap_noise.h"
#include "core/imu/propagation.h"
#include "core/imu/scan_motion.h"
#include "core/lidar/deskew.h"
#include "core/observability/single_scan.h"
#include "core/robust_weight.h"
#include "core/stopwatch.h"
#include "core/wheels/wheel_residual.h"
#include "estimators/ieskf/magnetic_poses.h"
#include "estimators/ieskf/swept_evidence.h"
#include "estimators/initial_state.h"

namespace lodestone {

namespace {

// Where the iterations of an update end (docs/design/048-options-that-went.md).
constexpr int kMagneticIterations = 3;
constexpr int kWheelIterations = 2;  // nearly linear
constexpr double kUpdateConverged_m = 1e-3;
constexpr double kUpdateConverged_deg = 1e-2;

}  // namespace

struct IteratedFilter::Scan {
  std::vector<Eigen::Vector3f> points;          // imu frame at the scan's end
  ScanLidars lidars{LidarModel{}};              // of these points
  std::shared_ptr<const PlaneMap> planes;       // that correspondences refer to
  std::vector<float> ages_s;                    // of the points at the scan's end; only with deskewing errors
  std::vector<Correspondence> correspondences;  // at the prediction
  CondensedCost cost;
  Pose predicted;
  NavState deskewed;  // the state that the points were deskewed with
  Deskewing deskewing;
};

IteratedFilter::IteratedFilter(EstimatorInput input)
    : input_(std::move(input)),
      association_(input_.options.lidar.association),
      wheel_watch_(input_.suite.calibration.wheels, input_.warnings) {
  association_.map_error_repeats = input_.options.ieskf.map_error_repeats;
}

void IteratedFilter::process(const ScanBundle& bundle, EstimateSink& sink) {
  const Stopwatch step;
  const RunOptions& options = input_.options;
  if (!started_) {
    const InitialState start =
        initial_state(input_.initial_pose, input_.initial_velocity, input_.suite.gravity_m_s2, options.initial);
    state_ = start.state;
    covariance_ = start.covariance;
    started_ = true;
  }
  const ImuNoise noise = with_gap(input_.suite.imu, bundle.imu_gap_s);
  state_ = propagate(state_, bundle.imu, noise, &covariance_);

  Estimate estimate;
  estimate.time = bundle.scan.end;
  if (input_.suite.wheels) update_by_wheels(bundle, estimate.diagnostics);
  Scan scan;
  scan.predicted = state_.T_map_imu;
  Degeneracy degeneracy = no_degeneracy();
  if (input_.planes != nullptr) {
    const ScanMotion motion(state_, bundle.imu);
    const auto sampled = registration_points(bundle, input_.suite.lidars(), options.lidar.sampling);
    scan.points = deskew(sampled, bundle.scan.start, motion, input_.suite.lidar.T_imu_lidar);
    scan.lidars = ScanLidars(input_.suite.lidars(), sampled);
    scan.planes = input_.planes->around(scan.predicted.position);
    if (options.ieskf.deskewing_errors) {
      scan.ages_s = ages_at(bundle.scan.end, sampled, bundle.scan.start);
      scan.deskewed = state_;
      scan.deskewing = Deskewing(state_, motion, noise);
    }
    scan.correspondences = associate(scan.points, scan.predicted, covariance_.topLeftCorner<6, 6>(), *scan.planes,
                                     scan.lidars, association_, scan.ages_s);
    scan.cost = condense(scan.correspondences, scan.predicted);
    degeneracy = analyse(scan);
    estimate.diagnostics.unobserved_directions = unobserved_directions(analyse_scan(scan.cost, scan.predicted, {}));
  }
  Diagnostics& diagnostics = estimate.diagnostics;
  diagnostics.direction_sigma_m = degeneracy.sigma_m;
  diagnostics.direction_weight = degeneracy.kept;
  diagnostics.degenerate_directions = degeneracy.degenerate_directions;
  if (input_.field != nullptr && !bundle.magnetic.empty()) update_by_field(bundle, degeneracy, diagnostics);
  if (input_.planes != nullptr) update_by_lidar(scan, degeneracy, diagnostics);

  estimate.state = state_;
  estimate.covariance = covariance_.topLeftCorner<6, 6>();
  wheel_watch_.add(estimate);
  diagnostics.step_ms = step.elapsed_ms();
  sink.causal(estimate);
  sink.best(estimate);
}

void IteratedFilter::finish(EstimateSink&) {}

bool IteratedFilter::move(const Pose& T_new_old) {
  state_.T_map_imu = T_new_old * state_.T_map_imu;
  state_.velocity = (T_new_old.rotation * state_.velocity).eval();
  return true;
}

Degeneracy IteratedFilter::analyse(const Scan& scan) const {
  const DegeneracyOptions& options = input_.options.ieskf.degeneracy;
  switch (options.rule) {
    case DegeneracyRule::none:
      return no_degeneracy();
    case DegeneracyRule::paper:
      return analyse_by_eigenvalue(unit_hessian(scan.correspondences, scan.predicted), options);
    case DegeneracyRule::probabilistic:
      return analyse_by_probability(scan.cost.hessian(scan.predicted) - scan.cost.spurious_information,
                                    scan.cost.spurious_information, scan.correspondences, scan.predicted,
                                    std::max(scan.cost.range_rms_m, 1.0), options);
    case DegeneracyRule::marginal:
      break;
  }
  // A filter has no window: the information of the single scan is used, here and above.
  return analyse_scan(scan.cost, scan.predicted, options);
}

void IteratedFilter::update_by_wheels(const ScanBundle& bundle, Diagnostics& diagnostics) {
  const WheelCalibrationSigmas& sigmas = input_.suite.calibration.wheels;
  auto reading = average_wheels(bundle.wheels, state_, bundle.imu, *input_.suite.wheels);
  if (!reading) return;
  diagnostics.wheel_weight = weigh_wheels(state_, covariance_, {}, sigmas, kWheelProbability, *reading);
  const auto residual_at = [&](const NavState& state) {
    return wheel_residual(*reading, state.T_map_imu.rotation, state.velocity, state.gyroscope_bias, {});
  };
  const double step_s = to_seconds(bundle.imu.back().time - bundle.imu.front().time);
  const Matrix3 information = wheel_noise(residual_at(state_), sigmas, step_s).inverse();
  const auto evidence = [&](const NavState& state) {
    const WheelResidual residual = residual_at(state);
    const auto by_state = residual.by_state();
    StateEvidence result;
    result.information = by_state.transpose() * information * by_state;
    result.gradient = by_state.transpose() * (information * residual.value);
    return result;
  };
  const UpdatedState updated = iterated_update(
      state_, covariance_, evidence, {kWheelIterations, kUpdateConverged_m, kUpdateConverged_deg * M_PI / 180.0});
  state_ = updated.state;
  covariance_ = updated.covariance;
}

void IteratedFilter::update_by_field(const ScanBundle& bundle, const Degeneracy& degeneracy, Diagnostics& diagnostics) {
  const RunOptions& options = input_.options;
  const Matrix6 pose_covariance = covariance_.topLeftCorner<6, 6>();
  const MagneticPoses localized =
      localize_samples(bundle.magnetic, ScanMotion(state_, bundle.imu), pose_covariance, input_.suite, *input_.field,
                       options.ieskf.interpolation, options.magnetic.map_sigma);
  diagnostics.magnetic_off_map = localized.off_map;
  diagnostics.magnetic_residual_ut = localized.residual_rms_ut;
  diagnostics.magnetic_samples = static_cast<int>(localized.poses.size());
  if (localized.poses.empty()) return;

  // Huber weight c / s of each pose, with s = √(rᵀ (P + R)⁻¹ r), r against the prediction.
  const Pose predicted = state_.T_map_imu;
  const double threshold = mahalanobis_quantile(6, options.magnetic.huber_probability);
  std::vector<double> weights;
  for (const MagneticPose& pose : localized.poses) {
    double weight = 1.0;
    if (options.magnetic.huber) {
      // (P + R)⁻¹ = I_n (Id + P I_n)⁻¹ also holds for a singular information I_n = R⁻¹.
      const Vector6 residual = pose.T_map_imu.boxminus(predicted);
      const Matrix6 inverse_innovation =
          pose.information * (Matrix6::Identity() + pose_covariance * pose.information).inverse();
      weight = huber_weight(std::sqrt(std::max(0.0, residual.dot(inverse_innovation * residual))), threshold);
    }
    weights.push_back(weight);
    diagnostics.magnetic_weight += weight / static_cast<double>(localized.poses.size());
    if (weight < 0.5) ++diagnostics.magnetic_rejected;
  }

  // H_u = H V (I − D) Vᵀ if a direction is degenerate; else β.
  const bool degenerate = degeneracy.degenerate_directions > 0;
  const bool guarded = options.ieskf.degeneracy.rule != DegeneracyRule::none && input_.planes != nullptr;
  const Matrix6 mask = degenerate && guarded ? degeneracy.magnetic_projector() : Matrix6::Identity();
  double residual_scale = 1.0;
  double information_scale = 1.0;
  if (guarded && !degenerate) {
    const double beta = options.ieskf.beta;
    if (options.ieskf.shrink == MagneticShrink::residual) residual_scale = beta;
    if (options.ieskf.shrink == MagneticShrink::information) information_scale = beta * beta;
    if (options.ieskf.shrink != MagneticShrink::none) diagnostics.magnetic_shrink = beta;
  }
  const auto evidence = [&](const NavState& state) {
    PoseEvidence sum;
    for (std::size_t n = 0; n < localized.poses.size(); ++n) {
      const MagneticPose& pose = localized.poses[n];
      // r = x_n ⊟ x; ∂r/∂δ ≈ −I (paper, H for small residuals).
      const Vector6 residual = residual_scale * pose.T_map_imu.boxminus(state.T_map_imu);
      const Matrix6 information = information_scale * weights[n] * pose.information;
      sum.information += mask.transpose() * information * mask;
      sum.gradient -= mask.transpose() * (information * residual);
    }
    return sum;
  };
  const UpdatedState updated = iterated_update(
      state_, covariance_, evidence, {kMagneticIterations, kUpdateConverged_m, kUpdateConverged_deg * M_PI / 180.0});
  state_ = updated.state;
  covariance_ = updated.covariance;
}

void IteratedFilter::update_by_lidar(const Scan& scan, const Degeneracy& degeneracy, Diagnostics& diagnostics) {
  const RunOptions& options = input_.options;
  const Matrix6 mask = degeneracy.lidar_projector();  // H_g = H V D Vᵀ
  CondensedCost cost = scan.cost;
  Pose condensed_at = scan.predicted;
  std::shared_ptr<const PlaneMap> planes;  // that renewed correspondences refer to
  std::vector<Correspondence> renewed;
  const std::vector<Correspondence>* correspondences = &scan.correspondences;
  bool first = scan.predicted.boxminus(state_.T_map_imu).isZero(0.0);
  const auto evidence = [&](const NavState& state) -> StateEvidence {
    if (!first) {
      planes = input_.planes->around(state.T_map_imu.position);
      renewed = associate(scan.points, state.T_map_imu, covariance_.topLeftCorner<6, 6>(), *planes, scan.lidars,
                          association_, scan.ages_s);
      correspondences = &renewed;
      cost = condense(renewed, state.T_map_imu);
      condensed_at = state.T_map_imu;
    }
    first = false;
    if (options.ieskf.deskewing_errors) {
      return swept_evidence(cost, *correspondences, condensed_at, scan.deskewed, scan.deskewing, state, mask);
    }
    return masked_evidence(cost, state.T_map_imu, mask);
  };
  const UpdatedState updated =
      iterated_update(state_, covariance_, evidence,
                      {options.ieskf.lidar_iterations, kUpdateConverged_m, kUpdateConverged_deg * M_PI / 180.0});
  state_ = updated.state;
  covariance_ = updated.covariance;
  diagnostics.iterations = updated.iterations;
  diagnostics.points = static_cast<int>(scan.points.size());
  diagnostics.correspondences = cost.count;
  diagnostics.inlier_share =
      scan.points.empty() ? 0.0 : static_cast<double>(cost.count) / static_cast<double>(scan.points.size());
  diagnostics.lidar_rmse_m =
      cost.count == 0 ? 0.0 : std::sqrt(std::max(0.0, cost.cost(state_.T_map_imu)) / cost.weight_sum);
  diagnostics.lidar_nis = normalized_residuals(*correspondences, state_.T_map_imu);
}

}  // namespace lodestone
