#include "estimators/calibration/field_change.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/evaluation/stale_map.h"

namespace lodestone {

namespace {

constexpr double kSmallest_ut = 0.01, kLargest_ut = 300.0;  // range of sizes in the search
constexpr int kTried = 800;                                 // number of sizes in the search, 1.3 % apart

}  // namespace

ChangeSize change_size(const Eigen::Matrix4d& information, const Eigen::Vector4d& gradient) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(0.5 * (information + information.transpose()));
  const Eigen::Vector4d known = solver.eigenvalues().cwiseMax(0.0);
  const Eigen::Vector4d seen = (solver.eigenvectors().transpose() * gradient).cwiseAbs2();
  ChangeSize best;
  double best_gain = 0.0;
  for (int i = 0; i <= kTried; ++i) {
    const double size = kSmallest_ut * std::pow(kLargest_ut / kSmallest_ut, static_cast<double>(i) / kTried);
    const double variance = size * size;
    // 2 log N(x; 0, V + t I) / N(x; 0, V) along the directions in which V⁻¹ is diagonal.
    const Eigen::Array4d larger = 1.0 + known.array() * variance;
    const double gain = (seen.array() * variance / larger - larger.log()).sum();
    if (gain <= best_gain) continue;
    best_gain = gain;
    best.size_ut = size;
  }
  // A size cannot be negative: without a change, half of the gains are zero, and half are χ² of one degree of freedom.
  if (best_gain > 0.0) best.p_value = 0.5 * std::erfc(std::sqrt(0.5 * best_gain));
  return best;
}

std::size_t FieldChange::changed_places() const {
  return static_cast<std::size_t>(
      std::count_if(places.begin(), places.end(), [](const ComparedPlace& place) { return place.changed; }));
}

std::vector<ComparedPlace> compare_places(const CalibrationLog& log, const FieldProcess& process,
                                          const std::vector<MagnetometerCalibration>& calibrations,
                                          const std::vector<Matrix3>& usual_error_covariances) {
  struct Sums {
    ComparedPlace place;
    Matrix3 covariance = Matrix3::Zero();
    double map_variance = 0.0, noise_variance = 0.0, readings = 0.0;
  };
  std::vector<Matrix3> corrections;
  for (const MagnetometerCalibration& one : calibrations) corrections.push_back(one.correction());
  std::vector<Sums> cells(log.places);
  for (const CalibrationMoment& moment : log.moments) {
    Sums& cell = cells[moment.place];
    ++cell.place.moments;
    cell.place.centre_m += moment.T_map_centre.position;
    const double map_variance = std::pow(process.map_scale * moment.map_sigma_ut, 2) / moment.passes;
    for (const MomentReading& reading : moment.readings) {
      const auto j = static_cast<std::size_t>(reading.magnetometer);
      const Matrix3 R_map_imu = moment.T_map_centre.rotation.toRotationMatrix();
      const Matrix3 R_map_mag = R_map_imu * log.magnetometers[j].T_imu_mag.rotation.toRotationMatrix();
      cell.place.difference_ut += R_map_mag * corrections[j] * (reading.measured_ut - calibrations[j].hard_iron_ut) -
                                  R_map_imu * reading.known_ut;
      // The readings' common error in a cell does not average out: the mean variance is an upper bound
      // (docs/design/023).
      cell.covariance += R_map_mag * usual_error_covariances[j] * R_map_mag.transpose();
      cell.map_variance += map_variance;
      cell.noise_variance += reading.sigma_ut * reading.sigma_ut;
      cell.readings += 1.0;
    }
  }
  std::vector<ComparedPlace> places;
  for (Sums& cell : cells) {
    ComparedPlace& place = cell.place;
    place.centre_m /= static_cast<double>(place.moments);
    place.difference_ut /= cell.readings;
    const double own = cell.map_variance / cell.readings + cell.noise_variance / (cell.readings * cell.readings);
    const Matrix3 covariance = cell.covariance / cell.readings + own * Matrix3::Identity();
    place.sigma_ut = std::sqrt(covariance.trace() / 3.0);
    place.p_value = chi_square_tail(place.difference_ut.dot(covariance.inverse() * place.difference_ut));
    place.changed = place.p_value < field_change_probability;
    places.push_back(place);
  }
  return places;
}

}  // namespace lodestone
