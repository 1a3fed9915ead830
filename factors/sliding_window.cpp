#include "factors/sliding_window.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "factors/manifolds.h"
#include "factors/prior_factor.h"
#include "factors/sliding_window_parts.h"
#include "factors/sparse_information.h"

namespace lodestone {

namespace {

// Biases of magnetometers after calibration; the platform file's offset_sigma_ut adds to the first
// (docs/design/016-magnetometer-biases.md).
constexpr double kBiasSigma_ut = 0.5;
constexpr double kBiasWalk_ut_sqrt_s = 0.02;

void store(const NavState& state, WindowBlock& pose, WindowBlock& motion) {
  from_pose(state.T_map_imu, pose.values.data());
  Eigen::Map<Vector9>(motion.values.data()) << state.velocity, state.gyroscope_bias, state.accelerometer_bias;
}

}  // namespace

SlidingWindow::SlidingWindow(Time time, const NavState& state, const Matrix17& covariance, int magnetometers,
                             const ImuNoise& noise, const SlidingWindowOptions& options,
                             const CalibrationSigmas& calibration)
    : options_(options),
      noise_(noise),
      magnetometers_(magnetometers),
      pose_manifold_(std::make_unique<PoseManifold>()),
      gravity_manifold_(std::make_unique<GravityManifold>()),
      calibration_(calibration) {
  ceres::Problem::Options problem_options;
  problem_options.enable_fast_removal = true;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.disable_all_safety_checks = true;
  evaluation_ = std::make_unique<ParallelEvaluation>([this] { return factors(); });
  problem_options.evaluation_callback = evaluation_.get();
  problem_ = std::make_unique<ceres::Problem>(problem_options);

  gravity_ = {BlockKind::gravity, {state.gravity.x(), state.gravity.y(), state.gravity.z()}};
  add_block(gravity_);
  auto keyframe = std::make_unique<KeyframeFactors>();
  keyframe->time = time;
  store(state, keyframe->pose, keyframe->motion);
  add_block(keyframe->pose);
  add_block(keyframe->motion);

  MarginalPrior prior;
  prior.blocks = {&keyframe->pose, &keyframe->motion, &gravity_};
  const Eigen::LLT<Matrix17> factor(covariance);
  prior.root = factor.matrixL().solve(Matrix17::Identity());
  prior.offset = Eigen::VectorXd::Zero(tangent::size);
  keyframes_.push_back(std::move(keyframe));
  set_prior(std::move(prior), {});
}

SlidingWindow::~SlidingWindow() = default;

void SlidingWindow::add_block(WindowBlock& block) {
  ceres::Manifold* manifold = block.kind == BlockKind::pose      ? pose_manifold_.get()
                              : block.kind == BlockKind::gravity ? gravity_manifold_.get()
                                                                 : nullptr;
  problem_->AddParameterBlock(block.values.data(), static_cast<int>(block.values.size()), manifold);
}

void SlidingWindow::remove_block(WindowBlock& block) {
  problem_->RemoveParameterBlock(block.values.data());
}

WindowFactor SlidingWindow::add_residual(std::unique_ptr<ceres::CostFunction> function,
                                         std::vector<WindowBlock*> blocks) {
  std::vector<double*> parameters;
  parameters.reserve(blocks.size());
  for (WindowBlock* block : blocks) parameters.push_back(block->values.data());
  auto cached = std::make_unique<CachedFactor>(std::move(function));
  CachedFactor* pointer = cached.get();
  const ceres::ResidualBlockId id = problem_->AddResidualBlock(cached.release(), nullptr, parameters);
  return {id, pointer, std::move(blocks), pointer};
}

void SlidingWindow::set_prior(MarginalPrior prior, const Slide& slide) {
  std::vector<PriorBlock> blocks;
  for (const WindowBlock* block : prior.blocks) blocks.push_back({block->kind, block->values});
  prior_ = add_factor(
      std::make_unique<PriorFactor>(std::move(blocks), std::move(prior.root), std::move(prior.offset), slide),
      prior.blocks);
}

void SlidingWindow::add_keyframe(Time time, const NavState& state, std::span<const ImuSample> samples) {
  changed();
  KeyframeFactors& before = *keyframes_.back();
  auto keyframe = std::make_unique<KeyframeFactors>();
  keyframe->time = time;
  keyframe->samples.assign(samples.begin(), samples.end());
  keyframe->noise = noise_;
  store(state, keyframe->pose, keyframe->motion);
  add_block(keyframe->pose);
  add_block(keyframe->motion);
  const Preintegration preintegration(samples, Vector3(before.motion.values.data() + 3),
                                      Vector3(before.motion.values.data() + 6), noise_, imu_axes());
  std::vector<WindowBlock*> blocks{&before.pose, &before.motion, &keyframe->pose, &keyframe->motion, &gravity_};
  const bool with_axes = add_imu_axes();
  if (with_axes) blocks.push_back(&imu_axes_);
  Vector6 shown = Vector6::Zero();
  if (with_axes && before.imu) shown = axes_shown_after(before.imu.content().preintegration());
  keyframe->imu = add_factor(std::make_unique<PreintegrationFactor>(preintegration, noise_, with_axes, shown), blocks);
  keyframes_.push_back(std::move(keyframe));
}

void SlidingWindow::set_lidar(std::size_t k, const CondensedScan& scan,
                              const std::vector<Correspondence>& correspondences, const PoseMask& mask) {
  changed();
  KeyframeFactors& keyframe = *keyframes_[k];
  if (keyframe.lidar_in_prior) return;
  if (scan.cost.count == 0) {
    remove_lidar(keyframe);
    remove_factor(keyframe.points);
  } else if (!options_.condensed) {
    remove_factor(keyframe.points);
    keyframe.points = add_factor(std::make_unique<PointPlaneFactor>(correspondences, mask), {&keyframe.pose});
  } else if (keyframe.lidar && keyframe.lidar.content().by_lidar() == scan.by_lidar) {
    keyframe.lidar.change().set(scan, mask);
  } else {
    remove_lidar(keyframe);
    std::vector<WindowBlock*> blocks{&keyframe.pose, &keyframe.motion};
    if (k > 0) blocks.insert(blocks.end(), {&keyframes_[k - 1]->pose, &keyframes_[k - 1]->motion});
    const LidarCalibrationSigmas& sigmas = calibration_.lidar;
    const double turn_sigma_rad = sigmas.rotation_sigma_deg * M_PI / 180.0;
    const bool calibrated =
        scan.by_lidar && std::max({sigmas.translation_sigma_m, turn_sigma_rad, sigmas.clock_sigma_s}) > 0.0;
    if (calibrated) {
      const auto sigma = [](double value) { return std::max(value, kHeldSigma); };
      std::vector<double> all(3, sigma(turn_sigma_rad));
      all.insert(all.end(), 3, sigma(sigmas.translation_sigma_m));
      all.push_back(sigma(sigmas.clock_sigma_s));
      add_calibration(lidar_calibration_, lidar_calibration_prior_, all);
      blocks.push_back(&lidar_calibration_);
    }
    const bool map_error = scan.by_lidar && options_.map_error_states;
    if (map_error) {
      keyframe.map_error = map_error_epoch_at(Vector3(keyframe.pose.values.data() + 4), scan);
      ++keyframe.map_error->keyframes;
      blocks.push_back(&keyframe.map_error->error);
    }
    keyframe.lidar = add_factor(
        std::make_unique<CondensedLidarFactor>(scan, mask, CondensedLidarFactor::Blocks{k > 0, calibrated, map_error}),
        blocks);
    renew_rates(k);
  }
}

void SlidingWindow::set_lidar_mask(std::size_t k, const PoseMask& mask) {
  changed();
  if (keyframes_[k]->lidar) keyframes_[k]->lidar.change().set_mask(mask);
  if (keyframes_[k]->points) keyframes_[k]->points.change().set_mask(mask);
}

void SlidingWindow::follow_slide(const Slide& slide) {
  changed();
  prior_.change().follow(slide);
}

SlidingWindow::BiasEpoch* SlidingWindow::epoch_at(Time time) {
  if (!epochs_.empty() && (!options_.magnetometer_bias_states ||
                           to_seconds(time - epochs_.back()->start) < options_.magnetometer_bias_epoch_s)) {
    return epochs_.back().get();
  }
  auto epoch = std::make_unique<BiasEpoch>();
  epoch->start = time;
  epoch->biases.assign(static_cast<std::size_t>(magnetometers_), {BlockKind::euclidean, std::vector<double>(3, 0.0)});
  for (std::size_t i = 0; i < epoch->biases.size(); ++i) {
    WindowBlock& bias = epoch->biases[i];
    if (!epochs_.empty()) bias.values = epochs_.back()->biases[i].values;
    add_block(bias);
    if (!options_.magnetometer_bias_states) {
      problem_->SetParameterBlockConstant(bias.values.data());
    } else if (epochs_.empty()) {
      // The sigma of the first epoch is that of the sensors' calibration.
      const double sigma = std::hypot(kBiasSigma_ut, calibration_.magnetometers.offset_sigma_ut);
      epoch->walks.push_back(add_factor(std::make_unique<RandomWalkFactor>(3, sigma, true), {&bias}));
    } else {
      const double sigma = kBiasWalk_ut_sqrt_s * std::sqrt(to_seconds(time - epochs_.back()->start));
      epoch->walks.push_back(
          add_factor(std::make_unique<RandomWalkFactor>(3, sigma), {&epochs_.back()->biases[i], &bias}));
    }
  }
  epochs_.push_back(std::move(epoch));
  return epochs_.back().get();
}

void SlidingWindow::set_field(std::size_t k, std::shared_ptr<const MagneticMap> map, FieldInterpolation interpolation,
                              const std::vector<FieldReading>& readings, const PoseMask& mask) {
  changed();
  KeyframeFactors& keyframe = *keyframes_[k];
  std::vector<std::vector<FieldReading>> parts(static_cast<std::size_t>(magnetometers_));
  for (const FieldReading& reading : readings) {
    parts[static_cast<std::size_t>(reading.magnetometer)].push_back(reading);
    parts[static_cast<std::size_t>(reading.magnetometer)].back().magnetometer = 0;
  }
  keyframe.fields.resize(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    RenewableFactor<FieldFactor>& factor = keyframe.fields[i];
    if (factor && factor.content().readings().size() == parts[i].size()) {
      factor.change().renew(std::move(parts[i]), mask);
      continue;
    }
    remove_factor(factor);
    if (!parts[i].empty()) factor = field_factor(keyframe, i, map, interpolation, std::move(parts[i]), mask);
  }
}

RenewableFactor<FieldFactor> SlidingWindow::field_factor(KeyframeFactors& keyframe, std::size_t magnetometer,
                                                         std::shared_ptr<const MagneticMap> map,
                                                         FieldInterpolation interpolation,
                                                         std::vector<FieldReading> readings, const PoseMask& mask) {
  if (keyframe.epoch == nullptr) {
    keyframe.epoch = epoch_at(keyframe.time);
    ++keyframe.epoch->keyframes;
  }
  std::vector<WindowBlock*> blocks{&keyframe.pose, &keyframe.epoch->biases[magnetometer]};
  const MagnetometerCalibrationSigmas& sigmas = calibration_.magnetometers;
  const double turn_sigma_rad = sigmas.rotation_sigma_deg * M_PI / 180.0;
  FieldFactor::Blocks estimated;
  estimated.clock = sigmas.clock_sigma_s > 0.0;
  estimated.matrices = std::max(turn_sigma_rad, sigmas.matrix_sigma) > 0.0;
  if (estimated.clock) {
    add_calibration(clock_, clock_prior_, {sigmas.clock_sigma_s});
    blocks.push_back(&clock_);
  }
  if (estimated.matrices) {
    std::vector<double> all(3, std::max(turn_sigma_rad, kHeldSigma));
    all.insert(all.end(), CalibrationEstimate::kMatrixParameters - 3, std::max(sigmas.matrix_sigma, kHeldSigma));
    matrices_.resize(static_cast<std::size_t>(magnetometers_));
    matrices_priors_.resize(static_cast<std::size_t>(magnetometers_));
    add_calibration(matrices_[magnetometer], matrices_priors_[magnetometer], all);
    blocks.push_back(&matrices_[magnetometer]);
  }
  return add_factor(
      std::make_unique<FieldFactor>(std::move(map), interpolation, 1, std::move(readings), mask, estimated), blocks);
}

void SlidingWindow::set_field_pose(std::size_t k, const MeasuredPose& measured, const PoseMask& mask) {
  changed();
  KeyframeFactors& keyframe = *keyframes_[k];
  if (keyframe.field_pose) {
    keyframe.field_pose.change().set(measured, mask);
  } else {
    keyframe.field_pose = add_factor(std::make_unique<PoseFactor>(measured, mask), {&keyframe.pose});
  }
}

void SlidingWindow::marginalize_oldest() {
  changed();
  KeyframeFactors& oldest = *keyframes_.front();
  KeyframeFactors& next = *keyframes_[1];
  std::vector<WindowFactor> involved{prior_};
  for (const WindowFactor* factor : oldest.measurements()) {
    if (*factor) involved.push_back(*factor);
  }
  involved.push_back(next.imu);
  // The next scan's factor depends on the oldest pose by deskewing; its information becomes part of the prior.
  next.lidar_in_prior = next.lidar && std::ranges::find(next.lidar.blocks, &oldest.motion) != next.lidar.blocks.end();
  if (next.lidar_in_prior) involved.push_back(next.lidar);
  std::vector<WindowBlock*> eliminated{&oldest.pose, &oldest.motion};
  // Without a scan the slide is kept: the prior must not constrain a direction that was unobservable before.
  const Slide slide = next.lidar    ? next.lidar.content().mask().slide()
                      : next.points ? next.points.content().mask().slide()
                                    : prior_.content().slide();
  // An epoch is removed with its last keyframe, once a later epoch exists.
  BiasEpoch* leaving = nullptr;
  if (options_.magnetometer_bias_states && epochs_.size() > 1) {
    BiasEpoch& first = *epochs_.front();
    const int left = first.keyframes - (oldest.epoch == &first ? 1 : 0);
    if (left == 0) {
      leaving = &first;
      for (WindowBlock& bias : first.biases) eliminated.push_back(&bias);
      for (const WindowFactor& walk : first.walks) {
        if (walk) involved.push_back(walk);
      }
      involved.insert(involved.end(), epochs_[1]->walks.begin(), epochs_[1]->walks.end());
    }
  }
  // The same for the map error of a stretch. If the next scan's factor becomes part of the prior, its map error remains
  // a variable of the prior.
  MapErrorEpoch* stretch = nullptr;
  if (map_errors_.size() > 1) {
    MapErrorEpoch& first = *map_errors_.front();
    if (first.keyframes - (oldest.map_error == &first ? 1 : 0) == 0) {
      stretch = &first;
      eliminated.push_back(&first.error);
      if (first.step) involved.push_back(first.step);
      involved.push_back(map_errors_[1]->step);
    }
  }
  SlipEpoch* slip = leaving_slip(oldest, involved, eliminated);
  MarginalPrior prior = marginalize_disturbed(involved, eliminated, stretch != nullptr);
  // Constant biases are no variables: the prior must not contain them.
  if (!options_.magnetometer_bias_states && !epochs_.empty()) {
    const std::vector<WindowBlock>& biases = epochs_.front()->biases;
    const auto constant = [&](const WindowBlock* block) {
      return block >= biases.data() && block < biases.data() + biases.size();
    };
    keep_columns(
        prior.blocks, [&](const WindowBlock* block) { return !constant(block); }, prior.root);
    std::erase_if(prior.blocks, constant);
  }
  // Factors are removed one by one in a fixed order: Ceres' own order would depend on addresses.
  remove_factor(prior_);
  remove_factor(oldest.lidar);
  remove_factor(oldest.points);
  for (auto& field : oldest.fields) remove_factor(field);
  remove_factor(oldest.field_pose);
  remove_factor(oldest.wheels);
  remove_factor(next.imu);
  if (next.lidar_in_prior) remove_factor(next.lidar);
  if (leaving != nullptr) {
    for (auto& walk : leaving->walks) remove_factor(walk);
    for (auto& walk : epochs_[1]->walks) remove_factor(walk);
    for (WindowBlock& bias : leaving->biases) remove_block(bias);
  }
  if (stretch != nullptr) {
    remove_factor(stretch->step);
    remove_factor(map_errors_[1]->step);
    remove_block(stretch->error);
  }
  if (oldest.slip != nullptr) --oldest.slip->keyframes;
  remove_slip(slip);
  if (oldest.epoch != nullptr) --oldest.epoch->keyframes;
  if (oldest.map_error != nullptr) --oldest.map_error->keyframes;
  remove_block(oldest.pose);
  remove_block(oldest.motion);
  keyframes_.pop_front();
  if (leaving != nullptr) epochs_.pop_front();
  if (stretch != nullptr) map_errors_.pop_front();
  set_prior(std::move(prior), slide);
}

void SlidingWindow::set_state(std::size_t k, const NavState& state) {
  changed();
  store(state, keyframes_[k]->pose, keyframes_[k]->motion);
  Eigen::Map<Vector3>(gravity_.values.data()) = state.gravity;
}

void SlidingWindow::set_magnetometer_biases(std::size_t k, std::span<const Vector3> biases_ut) {
  changed();
  BiasEpoch* epoch = keyframes_[k]->epoch;
  if (epoch == nullptr || !options_.magnetometer_bias_states) return;
  for (std::size_t i = 0; i < biases_ut.size(); ++i) {
    Eigen::Map<Vector3>(epoch->biases[i].values.data()) = biases_ut[i];
  }
}

Time SlidingWindow::time(std::size_t k) const {
  return keyframes_[k]->time;
}

NavState SlidingWindow::state(std::size_t k) const {
  const KeyframeFactors& keyframe = *keyframes_[k];
  NavState state;
  state.T_map_imu = to_pose(keyframe.pose.values.data());
  state.velocity = Vector3(keyframe.motion.values.data());
  state.gyroscope_bias = Vector3(keyframe.motion.values.data() + 3);
  state.accelerometer_bias = Vector3(keyframe.motion.values.data() + 6);
  state.gravity = Vector3(gravity_.values.data());
  return state;
}

Vector3 SlidingWindow::magnetometer_bias(std::size_t k, int magnetometer) const {
  const BiasEpoch* epoch = keyframes_[k]->epoch;
  if (epoch == nullptr) epoch = epochs_.empty() ? nullptr : epochs_.back().get();
  return epoch == nullptr ? Vector3::Zero().eval()
                          : Vector3(epoch->biases[static_cast<std::size_t>(magnetometer)].values.data());
}

void SlidingWindow::move(const Pose& T_new_old) {
  changed();
  for (const auto& keyframe : keyframes_) {
    from_pose(T_new_old * to_pose(keyframe->pose.values.data()), keyframe->pose.values.data());
    Eigen::Map<Vector3> velocity(keyframe->motion.values.data());
    velocity = (T_new_old.rotation * velocity).eval();
  }
}

void SlidingWindow::move_with_prior(const Pose& T_new_old) {
  move(T_new_old);
  prior_.change().move(T_new_old);
}

}  // namespace lodestone
