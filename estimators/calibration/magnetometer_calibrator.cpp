#include "estimators/calibration/magnetometer_calibrator.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/error.h"
#include "core/middle_value.h"
#include "estimators/calibration/held_parameters.h"

namespace lodestone {

namespace {

constexpr std::size_t kFewestMoments = 20;
constexpr int kRoughly = 6, kWell = 50;  // iterations of a solver
constexpr double kSettled = 0.03;        // relative change of the weights at convergence
constexpr double kMedianSquare = 2.366;  // median of χ² with three degrees of freedom
constexpr double kChangeMargin = 2.0;    // prior sigma of a change of the map over its estimated size
constexpr double kAnyChange_ut = 20.0;   // prior of a change of the map before its size is estimated
constexpr double kWorthNaming = 3.0;     // ratio of a change of the mean field to the map's error
constexpr double kLeastChange_ut = 0.05;
constexpr double kFarOff = 4.0;  // sigmas: larger residuals are ignored for scatter and correlation

/// Scatter of one magnetometer's residuals relative to their white noise, and their correlation time.
class Scatter {
 public:
  void add(const Vector3& residual) { residuals_.push_back(residual); }

  /// The scale is that of white noise whose means over any number of neighbours scatter at least as much as the
  /// residuals' means.
  ReadingWeights weights(double huber_sigma) const {
    if (residuals_.size() < kFewestMoments) return {1.0, huber_sigma};
    std::vector<double> squares;
    for (const Vector3& residual : residuals_) squares.push_back(residual.squaredNorm());
    const double sigma = std::max(1e-6, std::sqrt(middle_value(std::move(squares)) / kMedianSquare));
    double largest = sigma * sigma;
    for (std::size_t block = 2; block * kFewestMoments <= residuals_.size(); block *= 2) {
      largest = std::max(largest, static_cast<double>(block) * variance_of_means(block, kFarOff * sigma));
    }
    const double scale = std::max(1.0, std::sqrt(largest));
    return {scale, huber_sigma * std::max(1.0, sigma) / scale};
  }

 private:
  /// Mean square per component of the means of `block` neighbours, each limited to a length of `most`.
  double variance_of_means(std::size_t block, double most) const {
    double squares = 0.0;
    std::size_t blocks = 0;
    for (std::size_t begin = 0; begin + block <= residuals_.size(); begin += block, ++blocks) {
      Vector3 sum = Vector3::Zero();
      for (std::size_t i = begin; i < begin + block; ++i) {
        sum += residuals_[i] * std::min(1.0, most / std::max(residuals_[i].norm(), 1e-12));
      }
      squares += sum.squaredNorm() / (3.0 * static_cast<double>(block * block));
    }
    return squares / static_cast<double>(blocks);
  }

  std::vector<Vector3> residuals_;
};

std::vector<ReadingWeights> observed_weights(const CalibrationLog& log, const CalibrationProblem& problem,
                                             const CalibrationOptions& options) {
  std::vector<Scatter> scatter(log.magnetometers.size());
  for (std::size_t k = 0; k < log.moments.size(); ++k) {
    for (const MomentReading& reading : log.moments[k].readings) {
      scatter[static_cast<std::size_t>(reading.magnetometer)].add(problem.residual(k, reading));
    }
  }
  std::vector<ReadingWeights> weights;
  for (const Scatter& one : scatter) weights.push_back(one.weights(options.huber_sigma));
  return weights;
}

double relative_change(double before, double after) {
  return std::abs(after - before) / std::max(before, 1e-12);
}

double change(const FieldProcess& a, const FieldProcess& b, const std::vector<ReadingWeights>& v,
              const std::vector<ReadingWeights>& w) {
  double largest = std::max(
      {relative_change(a.step_ut_sqrt_s, b.step_ut_sqrt_s), relative_change(a.slope_ut_m, b.slope_ut_m),
       relative_change(a.slope_step_ut_m_sqrt_s, b.slope_step_ut_m_sqrt_s), relative_change(a.map_scale, b.map_scale)});
  for (std::size_t j = 0; j < v.size(); ++j)
    largest = std::max(largest, relative_change(v[j].sigma_scale, w[j].sigma_scale));
  return largest;
}

/// Rows whose products are zero if no magnetometer distorts.
Eigen::MatrixXd distortion_rows(const Eigen::VectorXd& prior_sigma) {
  const Eigen::Index count = prior_sigma.size() / 12;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(9 * count, 12 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    rows.block(9 * i, 12 * i + 3, 9, 9) = prior_sigma.segment(12 * i + 3, 9).cwiseInverse().asDiagonal();
  }
  return rows;
}

/// Residuals of each magnetometer against the reference, before and after calibration.
void add_residuals(const CalibrationLog& log, const CalibrationProblem& problem,
                   MagnetometerCalibrationResult& result) {
  std::vector<Matrix3> corrections;
  for (const CalibratedMagnetometer& one : result.magnetometers) corrections.push_back(one.calibration.correction());
  for (std::size_t k = 0; k < log.moments.size(); ++k) {
    for (const MomentReading& reading : log.moments[k].readings) {
      const auto j = static_cast<std::size_t>(reading.magnetometer);
      CalibratedMagnetometer& one = result.magnetometers[j];
      const Vector3 reference = problem.reference(k, reading);
      ++one.readings;
      one.usual_field_ut += reference;
      one.before_ut += (reading.measured_ut - reference).squaredNorm();
      one.after_ut += (corrections[j] * (reading.measured_ut - one.calibration.hard_iron_ut) - reference).squaredNorm();
    }
  }
  for (CalibratedMagnetometer& one : result.magnetometers) {
    if (one.readings == 0) continue;
    const auto count = static_cast<double>(one.readings);
    one.usual_field_ut /= count;
    one.before_ut = std::sqrt(one.before_ut / (3.0 * count));
    one.after_ut = std::sqrt(one.after_ut / (3.0 * count));
    one.usual_error_ut =
        one.calibration.distortion * one.usual_field_ut + one.calibration.hard_iron_ut - one.usual_field_ut;
  }
}

void add_sigmas(const CalibrationProblem& problem, MagnetometerCalibrationResult& result) {
  const Eigen::VectorXd share = result.gain.hidden_share();
  for (std::size_t i = 0; i < problem.active().size(); ++i) {
    CalibratedMagnetometer& one = result.magnetometers[static_cast<std::size_t>(problem.active()[i])];
    const auto row = 12 * static_cast<Eigen::Index>(i);
    const Eigen::Matrix<double, 12, 12> covariance = result.covariance.block<12, 12>(row, row);
    one.sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    one.hidden_share = share.segment<12>(row);
    Eigen::Matrix<double, 3, 12> error;
    error << Matrix3::Identity(), distortion_jacobian(one.usual_field_ut);
    one.usual_error_covariance_ut2 = error * covariance * error.transpose();
    one.usual_error_sigma_ut = one.usual_error_covariance_ut2.diagonal().cwiseMax(0.0).cwiseSqrt();
  }
}

/// Converts a change of the map to µT: the scale is multiplied by the usual field.
Eigen::Vector4d to_microtesla(const CalibrationProblem& problem, const FieldProcess& process) {
  return problem.map_change_sigma(process).cwiseInverse() * process.map_change_ut;
}

/// Evidence of the log about a change of the map, in µT, at a solution with process.map_change_ut.
struct ChangeEvidence {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();  ///< without a prior of the change
  ChangeSize size;
};

ChangeEvidence change_evidence(CalibrationProblem& problem, const FieldProcess& process,
                               const std::vector<ReadingWeights>& weights) {
  const Eigen::Vector4d unit = to_microtesla(problem, process);
  const Eigen::Matrix4d scale = unit.cwiseInverse().asDiagonal();
  ChangeEvidence evidence;
  evidence.information = scale * problem.map_change_information(process, weights) * scale;
  const Eigen::Vector4d solved = unit.cwiseProduct(problem.map_change());
  const double prior = 1.0 / std::pow(process.map_change_ut, 2);
  evidence.size = change_size(evidence.information, evidence.information * solved + prior * solved);
  return evidence;
}

/// Solves and recomputes the weights until the weights converge.
void settle(const CalibrationLog& log, const CalibrationOptions& options, const Eigen::MatrixXd& held,
            CalibrationProblem& problem, FieldProcess& process, std::vector<ReadingWeights>& weights, int& rounds) {
  rounds = 0;
  for (bool settled = false; !settled && rounds < options.max_rounds; ++rounds) {
    problem.solve(process, weights, held, kRoughly);
    FieldProcess next =
        log.mapped ? observed_map_error(log, problem.states(), process, options)
                   : observed_process(log, problem.states(), problem.gyroscope_bias(), problem.common_distortion());
    const std::vector<ReadingWeights> next_weights = observed_weights(log, problem, options);
    settled = change(process, next, weights, next_weights) < kSettled;
    if (process.map_change_ut > 0.0) {
      const ChangeSize size = change_evidence(problem, process, weights).size;
      next.map_change_ut = std::max(kLeastChange_ut, kChangeMargin * size.size_ut);
      settled = settled && relative_change(process.map_change_ut, next.map_change_ut) < kSettled;
    }
    process = next;
    weights = next_weights;
  }
  problem.solve(process, weights, held, kWell);
}

/// The information of a log that determines only the error in the usual field of each magnetometer, b + (D − I) h: the
/// information about its offset is attributed to this sum.
Eigen::MatrixXd of_usual_error(const CalibrationLog& log, const CalibrationProblem& problem,
                               const Eigen::MatrixXd& information) {
  std::vector<Vector3> usual(log.magnetometers.size(), Vector3::Zero());
  std::vector<double> counts(usual.size(), 0.0);
  for (std::size_t k = 0; k < log.moments.size(); ++k) {
    for (const MomentReading& reading : log.moments[k].readings) {
      usual[static_cast<std::size_t>(reading.magnetometer)] += problem.reference(k, reading);
      counts[static_cast<std::size_t>(reading.magnetometer)] += 1.0;
    }
  }
  const auto count = static_cast<Eigen::Index>(problem.active().size());
  Eigen::MatrixXd of_offsets(3 * count, 3 * count);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(3 * count, 12 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto j = static_cast<std::size_t>(problem.active()[static_cast<std::size_t>(i)]);
    sum.block<3, 3>(3 * i, 12 * i).setIdentity();
    sum.block<3, 9>(3 * i, 12 * i + 3) = distortion_jacobian(usual[j] / counts[j]);
    for (Eigen::Index k = 0; k < count; ++k)
      of_offsets.block<3, 3>(3 * i, 3 * k) = information.block<3, 3>(12 * i, 12 * k);
  }
  return sum.transpose() * of_offsets * sum;
}

/// Change of the mean field along the map's axes that the log determines, per component. A scale and an offset that
/// cancel there are errors of the map that are proportional to its variation, not a change of the field.
double mean_change_ut(const CalibrationProblem& problem, const std::vector<int>& undetermined) {
  const MapChange& change = problem.map_change();
  const Vector3 mean = change[0] * problem.mean_field_ut() + change.tail<3>();
  double squares = 0.0, axes = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::find(undetermined.begin(), undetermined.end(), axis) != undetermined.end()) continue;
    squares += mean[axis] * mean[axis];
    axes += 1.0;
  }
  return axes > 0.0 ? std::sqrt(squares / axes) : 0.0;
}

/// Decides whether the whole map has changed; if not, removes the change from the problem.
FieldChange settle_map_change(CalibrationProblem& problem, FieldProcess& process,
                              const std::vector<ReadingWeights>& weights, const CalibrationOptions& options) {
  FieldChange change;
  change.compared = problem.with_map_change();
  if (!change.compared) return change;
  const ChangeEvidence evidence = change_evidence(problem, process, weights);
  const double alike_ut = options.hard_iron_sigma_ut / std::sqrt(static_cast<double>(problem.active().size()));
  for (int axis = 0; axis < 3; ++axis) {
    // Information about the axis with all other components known: an upper bound.
    const double sigma_ut = 1.0 / std::sqrt(std::max(evidence.information(1 + axis, 1 + axis), 1e-12));
    if (sigma_ut > 0.5 * alike_ut) change.like_sensors.push_back(axis);
  }
  change.p_value = evidence.size.p_value;
  change.everywhere = change.p_value < field_change_probability &&
                      mean_change_ut(problem, change.like_sensors) > kWorthNaming * problem.map_error_ut(process);
  if (!change.everywhere) {
    process.map_change_ut = 0.0;
    return change;
  }
  const Eigen::Matrix4d posterior =
      (evidence.information + Eigen::Matrix4d::Identity() / std::pow(process.map_change_ut, 2)).inverse();
  change.sigma = posterior.diagonal().cwiseSqrt().cwiseQuotient(to_microtesla(problem, process));
  return change;
}

void add_field_change(const CalibrationLog& log, const CalibrationProblem& problem,
                      MagnetometerCalibrationResult& result) {
  FieldChange& change = result.field_change;
  if (!change.compared) return;
  change.change = problem.map_change();
  std::vector<MagnetometerCalibration> calibrations;
  std::vector<Matrix3> covariances;
  for (const CalibratedMagnetometer& one : result.magnetometers) {
    calibrations.push_back(one.calibration);
    covariances.push_back(one.usual_error_covariance_ut2);
  }
  change.places = compare_places(log, result.process, calibrations, covariances);
  double squares = 0.0;
  for (const ComparedPlace& place : change.places) squares += place.difference_ut.squaredNorm();
  change.difference_ut = std::sqrt(squares / static_cast<double>(change.places.size()));
}

}  // namespace

MagnetometerCalibrationResult calibrate_magnetometers(const CalibrationLog& log, const CalibrationOptions& options) {
  if (log.moments.size() < kFewestMoments) {
    throw InputError("a calibration requires at least " + std::to_string(kFewestMoments) +
                     " moments, about one second of log; found " + std::to_string(log.moments.size()));
  }
  MagnetometerCalibrationResult result;
  result.magnetometers.resize(log.magnetometers.size());
  CalibrationProblem problem(log, options);
  std::vector<ReadingWeights> weights(log.magnetometers.size(), {1.0, options.huber_sigma});
  FieldProcess process;
  if (!log.mapped) {
    const FieldProcess seen = observed_process(log, problem.states(), Vector3::Zero(), Matrix3::Identity());
    process.step_ut_sqrt_s = seen.step_ut_sqrt_s;  // the states of the gradient are still zero
  }
  if (problem.with_map_change()) process.map_change_ut = kAnyChange_ut;
  const Eigen::MatrixXd nothing_held;
  const Eigen::MatrixXd distortions_held = distortion_rows(problem.prior_sigma());
  settle(log, options, nothing_held, problem, process, weights, result.rounds);
  Eigen::MatrixXd information;
  if (!log.mapped && process.step_ut_sqrt_s > options.max_walk_ut_sqrt_s) {
    result.offsets_only = true;
    problem.reset();
    settle(log, options, distortions_held, problem, process, weights, result.rounds);
    information = of_usual_error(log, problem, problem.information(process, weights));
  } else {
    result.field_change = settle_map_change(problem, process, weights, options);
    information = problem.information(process, weights);
  }
  result.gain = analyse_gain(information, problem.prior_sigma(), options.min_gain);
  problem.solve(process, weights, result.gain.hidden_rows(), kWell);
  result.covariance = result.gain.covariance();
  result.process = process;
  result.gyroscope_bias_rad_s = problem.gyroscope_bias();
  result.moments = log.moments.size();
  result.duration_s = to_seconds(log.moments.back().time - log.moments.front().time);
  for (const CalibrationMoment& moment : log.moments) {
    if (moment.follows) result.turned_deg += so3::log(moment.turn).norm() * 180.0 / std::numbers::pi;
  }
  for (std::size_t j = 0; j < log.magnetometers.size(); ++j) {
    result.magnetometers[j].calibration = problem.calibration(j);
    result.magnetometers[j].sigma_scale = weights[j].sigma_scale;
  }
  for (std::size_t j = 0; j < log.magnetometers.size(); ++j) {
    if (std::find(problem.active().begin(), problem.active().end(), static_cast<int>(j)) == problem.active().end()) {
      result.magnetometers[j].calibration = {};
    }
  }
  add_residuals(log, problem, result);
  add_sigmas(problem, result);
  add_field_change(log, problem, result);
  result.held =
      describe_held(result.gain, log.magnetometers, problem.active(), options, result.field_change.everywhere);
  return result;
}

}  // namespace lodestone
