// Solution of the window and its covariances.
#include <ceres/iteration_callback.h>
#include <ceres/solver.h>
#include <ceres/types.h>
#include <ceres/version.h>

#include <algorithm>
#include <cmath>

#include "core/thread_limit.h"
#include "core/work_times.h"
#include "factors/manifolds.h"
#include "factors/serial_openmp.h"
#include "factors/sliding_window_parts.h"
#include "factors/sparse_information.h"

namespace lodestone {

namespace {

constexpr ceres::LinearSolverType kLinearSolver = ceres::SPARSE_NORMAL_CHOLESKY;
constexpr ceres::SparseLinearAlgebraLibraryType kSparseLibrary = ceres::SUITE_SPARSE;

/// Of ½ Σ r²: a step with a smaller decrease moves no variable by more than a tenth of its sigma.
constexpr double kLeastDecrease = 5e-3;

/// Radius and number of iterations after a step without damping failed: Ceres' default radius.
constexpr double kDampedRadius = 1e4;
constexpr int kMostDamped = 20;

/// Radius of nearly no damping (docs/design/028-solver-damping.md), if keyframes are at least this far apart in time.
constexpr double kGaussNewtonRadius = 1e10;
constexpr double kShortStep_s = 0.01;

/// Above, the damping is lost in the rounding of the factorization.
constexpr double kLargestRadius = 1e15;

/// Ceres adds the diagonal of the normal equations over the radius. That of a position contains the IMU's information
/// about a step, which grows with the step's length to the power of −3; what scans tell about both ends together does
/// not. The radius grows likewise: with a fixed one, keyframes 60 µs apart would stay where they are.
double gauss_newton_radius(double shortest_step_s) {
  return std::min(kLargestRadius, kGaussNewtonRadius * std::max(1.0, std::pow(kShortStep_s / shortest_step_s, 3)));
}

/// Up to this number, forward solves are faster than the recursion over all variables.
constexpr std::size_t kFewKeyframes = 4;

/// Ends the iterations with the first step that hardly decreases the cost, or after which the next one would. A
/// Gauss-Newton step decreases the cost by a share ρ of what the linear model predicts. If the error of the model grows
/// with the k-th power of the step, the next step decreases the cost by k²/4 (1 − ρ)² of the same; k = 3 here.
class SettledCallback final : public ceres::IterationCallback {
 public:
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& step) override {
    if (step.iteration == 0 || !step.step_is_valid) return ceres::SOLVER_CONTINUE;
    const double decrease = std::abs(step.cost_change);
    const double next = 2.25 * std::pow(1.0 - step.relative_decrease, 2) * decrease;
    const bool settled = decrease < kLeastDecrease || (step.step_is_successful && next < kLeastDecrease);
    return settled ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }
};

}  // namespace

int SlidingWindow::solve() {
  const WorkTimer timer(Work::solve);
  changed();
  const ImuAxes axes = imu_axes();
  for (std::size_t k = 1; k < keyframes_.size(); ++k) {
    const double* bias = keyframes_[k - 1]->motion.values.data() + 3;
    RenewableFactor<PreintegrationFactor>& factor = keyframes_[k]->imu;
    if (!factor.content().preintegration().within_linear_range(Vector3(bias), Vector3(bias + 3), axes)) {
      factor.change().set(
          Preintegration(keyframes_[k]->samples, Vector3(bias), Vector3(bias + 3), keyframes_[k]->noise, axes),
          keyframes_[k]->noise);
    }
  }
  for (std::size_t k = 0; k < keyframes_.size(); ++k) renew_rates(k);
  for (const auto& epoch : epochs_) {
    for (auto& walk : epoch->walks) {
      if (!walk) continue;
      const auto& blocks = walk.blocks;
      walk.change().renew(blocks.size() == 1 ? nullptr : blocks[0]->values.data(), blocks.back()->values.data());
    }
  }
  SettledCallback settled;
  ceres::Solver::Options options;
  options.linear_solver_type = kLinearSolver;
  options.sparse_linear_algebra_library_type = kSparseLibrary;
  options.max_num_iterations = options_.max_iterations;
  // With several threads, Ceres sums residuals in the order in which threads end, and results are not bit-identical.
  options.num_threads = 1;
  // The callback ends the iterations; Ceres' tolerances are relative to the cost, which has no meaning here.
  options.function_tolerance = 0.0;
  options.parameter_tolerance = 1e-9;
  options.callbacks.push_back(&settled);
  // Gauss-Newton from the first step. Ceres' default damping leaves poorly observed joint directions, such as the
  // window's position along a tunnel, a fifth of a sigma off (docs/design/028-solver-damping.md).
  double shortest_step_s = kShortStep_s;
  for (std::size_t k = 1; k < keyframes_.size(); ++k)
    shortest_step_s = std::min(shortest_step_s, to_seconds(keyframes_[k]->time - keyframes_[k - 1]->time));
  options.initial_trust_region_radius = gauss_newton_radius(shortest_step_s);
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  const SerialOpenMp serial;
  std::vector<double*> blocks;
  problem_->GetParameterBlocks(&blocks);
  std::vector<std::vector<double>> before;
  before.reserve(blocks.size());
  for (const double* block : blocks) before.emplace_back(block, block + problem_->ParameterBlockSize(block));
  int iterations = 0;
  const auto run = [&] {
    ceres::Solve(options, problem_.get(), &summary);
    iterations += std::max(0, static_cast<int>(summary.iterations.size()) - 1);
  };
  try {
    run();
    // A valley curves along directions that are known badly, such as the LiDAR's mounting of a robot at rest. There, a
    // long step leaves the valley, and only damping makes it shorter.
    if (summary.termination_type == ceres::NO_CONVERGENCE && !summary.iterations.back().step_is_successful) {
      options.initial_trust_region_radius = kDampedRadius;
      options.max_num_iterations = kMostDamped;
      run();
    }
  } catch (...) {
    // A factor that cannot read its map. With an evaluation callback, Ceres tries its steps on the variables
    // themselves.
    for (std::size_t i = 0; i < blocks.size(); ++i) std::ranges::copy(before[i], blocks[i]);
    throw;
  }
  return iterations;
}

std::string SlidingWindow::solver_description() {
  const std::string blas = blas_description();
  return std::string("ceres ") + CERES_VERSION_STRING + ", " + ceres::LinearSolverTypeToString(kLinearSolver) + " (" +
         ceres::SparseLinearAlgebraLibraryTypeToString(kSparseLibrary) + (blas.empty() ? "" : "; " + blas) + ")";
}

std::vector<const WindowBlock*> SlidingWindow::variables_in_order() const {
  // An epoch's biases or slip, and a stretch's map error, follow the last keyframe that uses them: elimination in this
  // order has almost no fill-in.
  std::vector<const WindowBlock*> result;
  std::size_t epoch = 0;
  std::size_t stretch = 0;
  std::size_t slip = 0;
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    result.push_back(&keyframes_[k]->pose);
    result.push_back(&keyframes_[k]->motion);
    while (keyframes_[k]->map_error != nullptr && stretch + 1 < map_errors_.size() &&
           map_errors_[stretch].get() != keyframes_[k]->map_error) {
      result.insert(result.end() - 2, &map_errors_[stretch++]->error);
    }
    while (keyframes_[k]->slip != nullptr && slip + 1 < slips_.size() && slips_[slip].get() != keyframes_[k]->slip) {
      result.insert(result.end() - 2, &slips_[slip++]->slip);
    }
    if (!options_.magnetometer_bias_states || keyframes_[k]->epoch == nullptr) continue;
    while (epoch + 1 < epochs_.size() && epochs_[epoch].get() != keyframes_[k]->epoch) {
      for (const WindowBlock& bias : epochs_[epoch]->biases) result.insert(result.end() - 2, &bias);
      ++epoch;
    }
  }
  for (; options_.magnetometer_bias_states && epoch < epochs_.size(); ++epoch) {
    for (const WindowBlock& bias : epochs_[epoch]->biases) result.push_back(&bias);
  }
  for (; stretch < map_errors_.size(); ++stretch) result.push_back(&map_errors_[stretch]->error);
  for (; slip < slips_.size(); ++slip) result.push_back(&slips_[slip]->slip);
  if (imu_axes_prior_) result.push_back(&imu_axes_);
  if (lidar_calibration_prior_) result.push_back(&lidar_calibration_);
  for (std::size_t i = 0; i < matrices_priors_.size(); ++i) {
    if (matrices_priors_[i]) result.push_back(&matrices_[i]);
  }
  if (wheel_calibration_prior_) result.push_back(&wheel_calibration_);
  if (clock_prior_) result.push_back(&clock_);
  result.push_back(&gravity_);
  return result;
}

std::vector<const WindowFactor*> SlidingWindow::factors() const {
  std::vector<const WindowFactor*> result{&prior_};
  for (const WindowFactor* factor :
       {&imu_axes_prior_, &lidar_calibration_prior_, &wheel_calibration_prior_, &clock_prior_}) {
    if (*factor) result.push_back(factor);
  }
  for (const WindowFactor& prior : matrices_priors_) {
    if (prior) result.push_back(&prior);
  }
  for (const auto& keyframe : keyframes_) {
    if (keyframe->imu) result.push_back(&keyframe->imu);
    for (const WindowFactor* factor : keyframe->measurements()) {
      if (*factor) result.push_back(factor);
    }
  }
  for (const auto& epoch : epochs_) {
    for (const WindowFactor& walk : epoch->walks) {
      if (walk) result.push_back(&walk);
    }
  }
  for (const auto& stretch : map_errors_) {
    if (stretch->step) result.push_back(&stretch->step);
  }
  for (const auto& slip : slips_) {
    if (slip->step) result.push_back(&slip->step);
  }
  return result;
}

const SparseInformation& SlidingWindow::information() const {
  if (known_ == nullptr) known_ = std::make_unique<SparseInformation>(variables_in_order(), factors());
  return *known_;
}

void SlidingWindow::changed() {
  known_.reset();
}

std::vector<Matrix6> SlidingWindow::pose_covariances(std::span<const std::size_t> keyframes) const {
  const SparseInformation& known = information();
  const bool few = keyframes.size() <= kFewKeyframes;
  std::vector<const WindowBlock*> wanted;
  for (std::size_t i = 0; few && i < keyframes.size(); ++i) wanted.push_back(&keyframes_[keyframes[i]]->pose);
  if (clock_prior_) wanted.push_back(&clock_);
  const Eigen::MatrixXd joint = wanted.empty() ? Eigen::MatrixXd() : covariance(known, wanted);
  if (clock_prior_) clock_sigma_s_ = std::sqrt(joint.bottomRightCorner<1, 1>().value());
  std::vector<Matrix6> result;
  if (few) {
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
      const auto first = static_cast<Eigen::Index>(6 * i);
      result.push_back(joint.block<6, 6>(first, first));
    }
    return result;
  }
  const std::vector<const WindowBlock*> variables = variables_in_order();
  const std::vector<Eigen::MatrixXd> all = known.covariances();
  std::vector<Matrix6> poses;
  for (std::size_t i = 0; i < variables.size(); ++i) {
    if (variables[i]->kind == BlockKind::pose) poses.push_back(all[i]);
  }
  add_long_errors(known, poses);
  for (const std::size_t k : keyframes) result.push_back(poses[k]);
  return result;
}

/// ∂(seen pose)/∂(blocks), 6 rows. The keyframe's pose is the first of `blocks`; calibration and map error are appended
/// if the scan's factor has them.
Eigen::MatrixXd SlidingWindow::seen_jacobian(std::size_t k, std::vector<const WindowBlock*>& blocks) const {
  const KeyframeFactors& keyframe = *keyframes_[k];
  Eigen::Index size = 0;
  for (const WindowBlock* block : blocks) size += block->tangent_size();
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(6, size);
  result.leftCols<6>().setIdentity();
  if (!keyframe.lidar) return result;
  const SeenPose by =
      keyframe.lidar.content().seen(to_pose(keyframe.pose.values.data()), lidar_values(), map_error_values(keyframe));
  result.leftCols<6>() = by.by_pose;
  const auto add = [&](const WindowBlock& block, const Eigen::MatrixXd& part) {
    blocks.push_back(&block);
    result.conservativeResize(Eigen::NoChange, size + part.cols());
    result.rightCols(part.cols()) = part;
    size += part.cols();
  };
  if (lidar_calibration_prior_) {
    Eigen::Matrix<double, 6, 7> by_calibration;
    by_calibration << by.by_mounting, -keyframe.lidar.content().rate_at(state(k));
    add(lidar_calibration_, by_calibration);
  }
  if (keyframe.map_error != nullptr) add(keyframe.map_error->error, by.by_map_error);
  return result;
}

SlidingWindow::NewestCovariance SlidingWindow::newest_covariance() const {
  const KeyframeFactors& newest = *keyframes_.back();
  std::vector<const WindowBlock*> blocks{&newest.pose, &newest.motion, &gravity_};
  const Eigen::MatrixXd by_blocks = seen_jacobian(keyframes_.size() - 1, blocks);
  const Eigen::Index wheels = by_blocks.cols();
  if (wheel_calibration_prior_) blocks.insert(blocks.end(), {&wheel_calibration_, &slips_.back()->slip});
  const Eigen::MatrixXd joint = information().covariance(blocks);
  Eigen::MatrixXd to_seen = Eigen::MatrixXd::Zero(tangent::size, joint.cols());
  to_seen.leftCols<tangent::size>().setIdentity();
  to_seen.topLeftCorner(6, wheels) = by_blocks;
  WheelCalibrationSigmas next = calibration_.wheels;
  if (wheel_calibration_prior_) {
    const Eigen::Index slip = wheels + kWheelParameters;
    next.scale_sigma = std::sqrt(std::max(0.0, joint(wheels, wheels) + joint(slip, slip) + 2.0 * joint(wheels, slip)));
    next.slip_sigma = slip_step_sigma();
  }
  return {joint.topLeftCorner<tangent::size, tangent::size>(), to_seen * joint * to_seen.transpose(), next};
}

Matrix6 SlidingWindow::seen_covariance(std::size_t k) const {
  std::vector<const WindowBlock*> blocks{&keyframes_[k]->pose};
  const Eigen::MatrixXd by_blocks = seen_jacobian(k, blocks);
  return by_blocks * information().covariance(blocks) * by_blocks.transpose();
}

ChainLink SlidingWindow::link(std::size_t k) const {
  return keyframes_[k + 1]->imu.content().link(state(k), state(k + 1));
}

Matrix17 SlidingWindow::prior_information() const {
  const PriorFactor& prior = prior_.content();
  // The prior lists its blocks in the order of the factors that it came from.
  const WindowBlock* order[] = {&keyframes_.front()->pose, &keyframes_.front()->motion, &gravity_};
  Eigen::MatrixXd root = Eigen::MatrixXd::Zero(prior.root().rows(), tangent::size);
  Eigen::Index to = 0;
  for (const WindowBlock* block : order) {
    Eigen::Index from = 0;
    for (const WindowBlock* candidate : prior_.blocks) {
      if (candidate == block)
        root.middleCols(to, block->tangent_size()) = prior.root().middleCols(from, block->tangent_size());
      from += candidate->tangent_size();
    }
    to += block->tangent_size();
  }
  return root.transpose() * root;
}

}  // namespace lodestone
