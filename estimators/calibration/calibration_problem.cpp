#include "estimators/calibration/calibration_problem.h"

#include <ceres/ceres.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "factors/field_step_factor.h"
#include "factors/prior_factor.h"

namespace lodestone {

namespace {

constexpr double kHeld = 1e4;         // 1 / sigma of constraints, in units of the prior
constexpr double kCoupling = 3.0;     // 1/m, sigma of the gradient proportional to the field: that of a dipole at 1 m
constexpr double kNoiseMargin = 2.0;  // multiple of the spurious information that is subtracted
constexpr double kLeastSpread_m = 0.01;  // smallest extent of the array at which a gradient is observable

Matrix3 R_mag_imu(const MagnetometerModel& model) {
  return model.T_imu_mag.rotation.conjugate().toRotationMatrix();
}

Matrix3 R_imu_map(const CalibrationMoment& moment) {
  return moment.T_map_centre.rotation.conjugate().toRotationMatrix();
}

PriorBlock zero_block(int size) {
  return {BlockKind::euclidean, std::vector<double>(static_cast<std::size_t>(size), 0.0)};
}

ceres::CostFunction* linear_factor(const std::vector<int>& sizes, const Eigen::MatrixXd& root) {
  std::vector<PriorBlock> blocks;
  for (const int size : sizes) blocks.push_back(zero_block(size));
  return new PriorFactor(std::move(blocks), root, Eigen::VectorXd::Zero(root.rows()));
}

}  // namespace

CalibrationProblem::CalibrationProblem(const CalibrationLog& log, const CalibrationOptions& options)
    : log_(log), options_(options), own_(log.magnetometers.size(), CalibrationParameters::Zero()) {
  start();
}

CalibrationProblem::~CalibrationProblem() = default;

void CalibrationProblem::reset() {
  own_.assign(own_.size(), CalibrationParameters::Zero());
  common_.setZero();
  gyroscope_bias_.setZero();
  coupling_.setZero();
  map_change_.setZero();
  variation_ = 0.0;
  place_excess_.clear();
  states_ = {};
  active_.clear();
  start();
}

/// The mean of the unchanged readings; with a map, zero error.
void CalibrationProblem::start() {
  std::vector<std::size_t> counts(log_.magnetometers.size(), 0);
  double squares = 0.0, readings = 0.0;
  Vector3 mean = Vector3::Zero();
  for (const CalibrationMoment& moment : log_.moments) {
    Vector3 sum = Vector3::Zero();
    for (const MomentReading& reading : moment.readings) {
      const auto j = static_cast<std::size_t>(reading.magnetometer);
      sum += log_.magnetometers[j].T_imu_mag.rotation * reading.measured_ut;
      ++counts[j];
      squares += reading.known_ut.squaredNorm();
      mean += moment.T_map_centre.rotation * reading.known_ut;
      readings += 1.0;
    }
    states_.field_ut.push_back(log_.mapped ? Vector3(Vector3::Zero())
                                           : Vector3(sum / static_cast<double>(moment.readings.size())));
  }
  states_.slope_ut_m.assign(log_.moments.size(), FieldSlope::Zero());
  double spread = 0.0;
  for (std::size_t j = 0; j < counts.size(); ++j) {
    if (counts[j] == 0) continue;
    active_.push_back(static_cast<int>(j));
    spread = std::max(spread, (log_.magnetometers[j].T_imu_mag.position - log_.centre_m).norm());
  }
  if (log_.mapped) {
    usual_field_ut_ = std::max(1.0, std::sqrt(squares / readings));
    mean_field_ut_ = mean / readings;
    map_variance_ut2_ = std::max(0.0, squares / readings - mean_field_ut_.squaredNorm()) / 3.0;
  }
  with_slope_ = active_.size() > 1 && spread > kLeastSpread_m;
  anomalies_ut_.assign(log_.moments.size(), Vector3::Zero());
  last_distortions_.assign(own_.size(), Matrix3::Identity());
}

/// Without a map: the array's field less its mean over the stretch of the log, which is constant in the robot's axes.
void CalibrationProblem::find_anomalies() {
  if (log_.mapped || !with_slope_) return;
  std::vector<Quaternion> attitude(log_.moments.size(), Quaternion::Identity());
  for (std::size_t begin = 0, end = 0; begin < log_.moments.size(); begin = end) {
    Vector3 mean = states_.field_ut[begin];
    for (end = begin + 1; end < log_.moments.size() && log_.moments[end].follows; ++end) {
      const CalibrationMoment& moment = log_.moments[end];
      attitude[end] = (attitude[end - 1] * moment.turn * so3::exp(moment.turn_by_bias * gyroscope_bias_)).normalized();
      mean += attitude[end] * states_.field_ut[end];
    }
    mean /= static_cast<double>(end - begin);
    for (std::size_t k = begin; k < end; ++k) anomalies_ut_[k] = states_.field_ut[k] - attitude[k].conjugate() * mean;
  }
}

void CalibrationProblem::add_readings(ceres::Problem& problem, const FieldProcess& process,
                                      const std::vector<ReadingWeights>& weights,
                                      std::vector<std::unique_ptr<ceres::LossFunction>>& losses) {
  for (const ReadingWeights& weight : weights) losses.push_back(std::make_unique<ceres::HuberLoss>(weight.huber));
  for (std::size_t k = 0; k < log_.moments.size(); ++k) {
    for (const MomentReading& reading : log_.moments[k].readings) {
      const auto j = static_cast<std::size_t>(reading.magnetometer);
      const MagnetometerModel& model = log_.magnetometers[j];
      auto* factor = new CalibratedReadingFactor(
          {reading.measured_ut, reading.known_ut, R_mag_imu(model), model.T_imu_mag.position - log_.centre_m,
           weights[j].sigma_scale * reading_sigma(k, reading), anomalies_ut_[k], R_imu_map(log_.moments[k]),
           R_imu_map(log_.moments[k]) * mean_field_ut_, last_distortion(j)});
      problem.AddResidualBlock(factor, losses[j].get(), own_[j].data(), states_.field_ut[k].data(),
                               states_.slope_ut_m[with_slope_ ? k : 0].data(), coupling_.data(), map_change_.data(),
                               &variation_);
    }
  }
  if (!log_.mapped) problem.SetParameterBlockConstant(&variation_);
  if (!with_map_change() || process.map_change_ut <= 0.0) {
    map_change_.setZero();
    problem.SetParameterBlockConstant(map_change_.data());
  }
  if (log_.mapped || !with_slope_) problem.SetParameterBlockConstant(coupling_.data());
  if (!with_slope_) problem.SetParameterBlockConstant(states_.slope_ut_m.front().data());
}

void CalibrationProblem::add_steps(ceres::Problem& problem, const FieldProcess& process) {
  problem.AddParameterBlock(common_.data(), 9);
  problem.AddParameterBlock(gyroscope_bias_.data(), 3);
  for (std::size_t k = 0; k < log_.moments.size(); ++k) {
    const CalibrationMoment& moment = log_.moments[k];
    if (!moment.follows) {
      const double sigma = field_start_sigma(moment, log_.mapped, process);
      problem.AddResidualBlock(linear_factor({3}, Matrix3::Identity() / sigma), nullptr, states_.field_ut[k].data());
      if (!with_slope_) continue;
      const double slope_sigma = slope_start_sigma(moment, log_.mapped, process, options_);
      problem.AddResidualBlock(linear_factor({5}, Eigen::MatrixXd::Identity(5, 5) / slope_sigma), nullptr,
                               states_.slope_ut_m[k].data());
      continue;
    }
    const StepWeights weights = field_step(log_, k, process, options_);
    problem.AddResidualBlock(new FieldStepFactor({moment.turn, moment.turn_by_bias, weights.after, weights.before}),
                             nullptr, states_.field_ut[k - 1].data(), states_.field_ut[k].data(), common_.data(),
                             gyroscope_bias_.data());
    if (!with_slope_) continue;
    const StepWeights slope = slope_step(log_, k, process, options_);
    Eigen::MatrixXd root(5, 10);
    root.leftCols<5>() = -slope.before * turned_slope(moment.turn.conjugate().toRotationMatrix());
    root.rightCols<5>() = slope.after * Eigen::MatrixXd::Identity(5, 5);
    problem.AddResidualBlock(linear_factor({5, 5}, root), nullptr, states_.slope_ut_m[k - 1].data(),
                             states_.slope_ut_m[k].data());
  }
  if (log_.mapped) {
    problem.AddResidualBlock(linear_factor({1}, Eigen::MatrixXd::Constant(1, 1, 1.0 / variation_sigma(process))),
                             nullptr, &variation_);
    problem.SetParameterBlockConstant(common_.data());
    problem.SetParameterBlockConstant(gyroscope_bias_.data());
    return;
  }
  problem.AddResidualBlock(linear_factor({3}, Matrix3::Identity() / options_.gyroscope_bias_sigma_rad_s), nullptr,
                           gyroscope_bias_.data());
  if (!with_slope_) return;
  problem.AddResidualBlock(linear_factor({15}, Eigen::MatrixXd::Identity(15, 15) / kCoupling), nullptr,
                           coupling_.data());
}

/// Parameters against the field as a matrix on the own parameters and, after them, the common distortion.
Eigen::MatrixXd CalibrationProblem::total_by_own() const {
  const auto count = static_cast<Eigen::Index>(active_.size());
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(12 * count, 12 * count + 9);
  for (Eigen::Index i = 0; i < count; ++i) {
    total.block(12 * i, 12 * i, 12, 12).setIdentity();
    const Matrix3 Q = R_mag_imu(log_.magnetometers[static_cast<std::size_t>(active_[static_cast<std::size_t>(i)])]);
    total.block(12 * i + 3, 12 * count, 9, 9) = turned_distortion(Q);
  }
  return total;
}

/// The inverse, with a mean own distortion of zero.
Eigen::MatrixXd CalibrationProblem::own_by_total() const {
  const auto count = static_cast<Eigen::Index>(active_.size());
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(12 * count + 9, 12 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Matrix3 Q = R_mag_imu(log_.magnetometers[static_cast<std::size_t>(active_[static_cast<std::size_t>(i)])]);
    own.block(12 * count, 12 * i + 3, 9, 9) = turned_distortion(Q.transpose()) / static_cast<double>(count);
  }
  const Eigen::MatrixXd common = own.bottomRows(9);
  own.topRows(12 * count) = Eigen::MatrixXd::Identity(12 * count, 12 * count) - total_by_own().rightCols(9) * common;
  return own;
}

Eigen::VectorXd CalibrationProblem::prior_sigma() const {
  CalibrationParameters one;
  one.head<3>().setConstant(options_.hard_iron_sigma_ut);
  one.segment<6>(3).setConstant(options_.soft_iron_sigma);
  one.tail<3>().setConstant(options_.misalignment_sigma_deg * std::numbers::pi / 180.0);
  return one.replicate(static_cast<Eigen::Index>(active_.size()), 1);
}

void CalibrationProblem::add_priors(ceres::Problem& problem, const FieldProcess& process, const Eigen::MatrixXd& held) {
  if (with_map_change() && process.map_change_ut > 0.0) {
    const Eigen::Matrix4d root = map_change_sigma(process).cwiseInverse().asDiagonal();
    problem.AddResidualBlock(linear_factor({4}, root), nullptr, map_change_.data());
  }
  const Eigen::MatrixXd total = total_by_own();
  const auto own_size = 12 * static_cast<Eigen::Index>(active_.size());
  const Eigen::VectorXd weight = prior_sigma().cwiseInverse();
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(active_.size()); ++i) {
    Eigen::MatrixXd root(12, 21);
    root << Eigen::MatrixXd::Identity(12, 12), total.block(12 * i, own_size, 12, 9);
    double* own = own_[static_cast<std::size_t>(active_[static_cast<std::size_t>(i)])].data();
    problem.AddResidualBlock(linear_factor({12, 9}, weight.segment(12 * i, 12).asDiagonal() * root), nullptr, own,
                             common_.data());
  }
  std::vector<int> sizes(active_.size(), 12);
  std::vector<double*> blocks;
  for (const int j : active_) blocks.push_back(own_[static_cast<std::size_t>(j)].data());
  if (!log_.mapped) {  // own distortions have zero mean
    const Eigen::MatrixXd mean = own_by_total().bottomRows(9);
    problem.AddResidualBlock(linear_factor(sizes, kHeld / options_.soft_iron_sigma * mean), nullptr, blocks);
  }
  if (held.rows() == 0) return;
  sizes.push_back(9);
  blocks.push_back(common_.data());
  problem.AddResidualBlock(linear_factor(sizes, kHeld * held * total), nullptr, blocks);
}

void CalibrationProblem::solve(const FieldProcess& process, const std::vector<ReadingWeights>& weights,
                               const Eigen::MatrixXd& held, int iterations) {
  find_anomalies();
  place_excess_ = process.place_scale;
  for (double& scale : place_excess_) scale = process.map_scale * (scale - 1.0);
  for (std::size_t j = 0; j < own_.size(); ++j) last_distortions_[j] = distortion_matrix(own_[j].tail<9>());
  std::vector<std::unique_ptr<ceres::LossFunction>> losses;
  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  add_readings(problem, process, weights, losses);
  add_steps(problem, process);
  add_priors(problem, process, held);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = iterations;
  options.initial_trust_region_radius = 1e8;  // full steps, since the problem is nearly linear
  options.function_tolerance = 1e-7;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) throw InputError("the calibration has no solution: " + summary.message);
}

/// A step's derivative by the field before it is −β A ΔRᵀ A⁻¹. Noise n of ΔR adds −β [n×] to it, and on average 2 β² σ²
/// I to the information. Along a direction without true rotation, this would be the only information.
void CalibrationProblem::subtract_turn_noise(const FieldProcess& process, int state_size,
                                             Eigen::SparseMatrix<double>& information) const {
  for (std::size_t k = 1; k < log_.moments.size(); ++k) {
    if (!log_.moments[k].follows) continue;
    const double before = field_step(log_, k, process, options_).before;
    const double spurious = 2.0 * std::pow(before * log_.moments[k].turn_sigma, 2);
    const auto row = static_cast<Eigen::Index>(k - 1) * state_size;
    for (Eigen::Index i = row; i < row + 3; ++i) information.coeffRef(i, i) -= kNoiseMargin * spurious;
  }
}

Eigen::MatrixXd CalibrationProblem::information_of_own(const FieldProcess& process,
                                                       const std::vector<ReadingWeights>& weights) {
  std::vector<std::unique_ptr<ceres::LossFunction>> losses;
  ceres::Problem::Options problem_options;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  add_readings(problem, process, weights, losses);
  add_steps(problem, process);

  ceres::Problem::EvaluateOptions evaluate;
  Eigen::Index states = 0;
  for (std::size_t k = 0; k < log_.moments.size(); ++k) {
    evaluate.parameter_blocks.push_back(states_.field_ut[k].data());
    if (with_slope_) evaluate.parameter_blocks.push_back(states_.slope_ut_m[k].data());
    states += with_slope_ ? 8 : 3;
  }
  if (log_.mapped) {
    evaluate.parameter_blocks.push_back(&variation_);
    states += 1;
  } else {
    evaluate.parameter_blocks.push_back(gyroscope_bias_.data());
    states += 3;
    if (with_slope_) {
      evaluate.parameter_blocks.push_back(coupling_.data());
      states += 15;
    }
  }
  for (const int j : active_) evaluate.parameter_blocks.push_back(own_[static_cast<std::size_t>(j)].data());
  const bool changed = with_map_change() && process.map_change_ut > 0.0;
  if (!log_.mapped) evaluate.parameter_blocks.push_back(common_.data());
  if (changed) evaluate.parameter_blocks.push_back(map_change_.data());
  ceres::CRSMatrix crs;
  problem.Evaluate(evaluate, nullptr, nullptr, nullptr, &crs);
  const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>> rows(
      crs.num_rows, crs.num_cols, static_cast<Eigen::Index>(crs.values.size()), crs.rows.data(), crs.cols.data(),
      crs.values.data());
  const Eigen::SparseMatrix<double> jacobian = rows;
  const Eigen::SparseMatrix<double> by_state = jacobian.leftCols(states);
  const Eigen::SparseMatrix<double> by_parameter = jacobian.rightCols(jacobian.cols() - states);
  Eigen::SparseMatrix<double> state_information = by_state.transpose() * by_state;
  subtract_turn_noise(process, with_slope_ ? 8 : 3, state_information);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(state_information);
  if (solver.info() != Eigen::Success)
    throw InputError("the calibration is not determined: the log has too few readings");
  const Eigen::MatrixXd cross = Eigen::SparseMatrix<double>(by_state.transpose() * by_parameter);
  return Eigen::MatrixXd(Eigen::SparseMatrix<double>(by_parameter.transpose() * by_parameter)) -
         cross.transpose() * solver.solve(cross);
}

Eigen::MatrixXd CalibrationProblem::information(const FieldProcess& process,
                                                const std::vector<ReadingWeights>& weights) {
  const Eigen::MatrixXd own = information_of_own(process, weights);
  if (!log_.mapped) {
    const Eigen::MatrixXd own_of_total = own_by_total();
    return own_of_total.transpose() * own * own_of_total;
  }
  const Eigen::Index size = prior_sigma().size();
  if (own.rows() == size) return own;
  Eigen::Matrix4d change = own.bottomRightCorner<4, 4>();
  change.diagonal() += map_change_sigma(process).cwiseAbs2().cwiseInverse();
  const Eigen::MatrixXd cross = own.bottomLeftCorner(4, size);
  return own.topLeftCorner(size, size) - cross.transpose() * change.ldlt().solve(cross);
}

std::vector<CalibrationParameters> CalibrationProblem::parameters() const {
  std::vector<CalibrationParameters> total = own_;
  for (const int j : active_) {
    total[static_cast<std::size_t>(j)].tail<9>() +=
        turned_distortion(R_mag_imu(log_.magnetometers[static_cast<std::size_t>(j)])) * common_;
  }
  return total;
}

MagnetometerCalibration CalibrationProblem::calibration(std::size_t j) const {
  const Matrix3 Q = R_mag_imu(log_.magnetometers[j]);
  return {own_[j].head<3>(), distortion_matrix(own_[j].tail<9>()) * Q * distortion_matrix(common_) * Q.transpose()};
}

/// The field at a reading's position from the states, or the map's error; before removing the common distortion or
/// (`common_inverse`) after.
Vector3 CalibrationProblem::field_of(std::size_t k, const MomentReading& reading, const Matrix3& common_inverse) const {
  const MagnetometerModel& model = log_.magnetometers[static_cast<std::size_t>(reading.magnetometer)];
  const Vector3 slope = slope_jacobian(model.T_imu_mag.position - log_.centre_m) *
                        (states_.slope_ut_m[with_slope_ ? k : 0] + coupling_ * anomalies_ut_[k]);
  return R_mag_imu(model) * common_inverse * (states_.field_ut[k] + slope);
}

std::optional<Matrix3> CalibrationProblem::last_distortion(std::size_t magnetometer) const {
  return log_.mapped ? std::optional(last_distortions_[magnetometer]) : std::nullopt;
}

Vector3 CalibrationProblem::field_change(std::size_t k, const MomentReading& reading) const {
  return R_mag_imu(log_.magnetometers[static_cast<std::size_t>(reading.magnetometer)]) *
         (map_change_[0] * reading.known_ut + R_imu_map(log_.moments[k]) * map_change_.tail<3>() +
          variation_ * (reading.known_ut - R_imu_map(log_.moments[k]) * mean_field_ut_));
}

Vector3 CalibrationProblem::reference(std::size_t k, const MomentReading& reading) const {
  if (log_.mapped) {
    return R_mag_imu(log_.magnetometers[static_cast<std::size_t>(reading.magnetometer)]) * reading.known_ut +
           field_change(k, reading);
  }
  return field_of(k, reading, distortion_matrix(common_).inverse());
}

Vector3 CalibrationProblem::residual(std::size_t k, const MomentReading& reading) const {
  const auto j = static_cast<std::size_t>(reading.magnetometer);
  const Matrix3 D = distortion_matrix(own_[j].tail<9>());
  const Vector3 known = R_mag_imu(log_.magnetometers[j]) * reading.known_ut;
  const Vector3 rest = field_of(k, reading, Matrix3::Identity()) + field_change(k, reading);
  const Vector3 predicted = D * known + last_distortion(j).value_or(D) * rest + own_[j].head<3>();
  return (reading.measured_ut - predicted) / reading_sigma(k, reading);
}

}  // namespace lodestone
