// Priors of the map's change and of its errors in a calibration problem, and the log's information about the change.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "estimators/calibration/calibration_problem.h"

namespace lodestone {

namespace {

constexpr double kLeastVariation = 1e-3;  // sigma of v, for the conditioning of the solver

}  // namespace

double CalibrationProblem::map_error_ut(const FieldProcess& process) const {
  double squares = 0.0;
  for (const CalibrationMoment& moment : log_.moments)
    squares += std::pow(process.map_scale * moment.map_sigma_ut, 2) / moment.passes;
  return std::sqrt(squares / static_cast<double>(log_.moments.size()));
}

/// The map's errors increase its variation above the field's, by their share of its variance (regression dilution).
double CalibrationProblem::variation_sigma(const FieldProcess& process) const {
  const double error = std::pow(map_error_ut(process), 2);
  return std::clamp(error / std::max(map_variance_ut2_, 1e-12), kLeastVariation, 1.0);
}

/// The gradient does not model changes of the field within the map's correlation length: the next term of the series.
double CalibrationProblem::reading_sigma(std::size_t k, const MomentReading& reading) const {
  if (place_excess_.empty()) return reading.sigma_ut;
  const CalibrationMoment& moment = log_.moments[k];
  const auto j = static_cast<std::size_t>(reading.magnetometer);
  const double lever = (log_.magnetometers[j].T_imu_mag.position - log_.centre_m).norm() / options_.map_correlation_m;
  const double excess_ut = place_excess_[moment.place] * moment.map_sigma_ut / std::sqrt(moment.passes);
  return std::hypot(reading.sigma_ut, 0.5 * lever * lever * excess_ut);
}

MapChange CalibrationProblem::map_change_sigma(const FieldProcess& process) const {
  MapChange sigma = MapChange::Constant(process.map_change_ut);
  sigma[0] /= usual_field_ut_;
  return sigma;
}

Eigen::Matrix4d CalibrationProblem::map_change_information(const FieldProcess& process,
                                                           const std::vector<ReadingWeights>& weights) {
  const Eigen::MatrixXd whole = information_of_own(process, weights);
  const Eigen::Index size = prior_sigma().size();
  Eigen::MatrixXd own = whole.topLeftCorner(size, size);
  own.diagonal() += prior_sigma().cwiseAbs2().cwiseInverse();
  const Eigen::MatrixXd cross = whole.topRightCorner(size, 4);
  return whole.bottomRightCorner<4, 4>() - cross.transpose() * own.ldlt().solve(cross);
}

}  // namespace lodestone
