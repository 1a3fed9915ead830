#include "tools/run/calibration_consistency.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "core/nearest_name.h"
#include "frontends/configuration/configuration_node.h"
#include "tools/run/calibration_file.h"

namespace lodestone {

namespace {

Pose read_true_pose(const ConfigurationNode& node) {
  const std::vector<double> t = node.at("translation_m").as_doubles(3);
  const std::vector<double> q = node.at("quaternion_xyzw").as_doubles(4);
  return {Quaternion(q[3], q[0], q[1], q[2]).normalized(), Vector3(t[0], t[1], t[2])};
}

Matrix3 read_matrix(const ConfigurationNode& node) {
  const std::vector<double> values = node.as_doubles(9);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data());
}

const ConfigurationNode& magnetometer_of(const ConfigurationNode& list, const std::string& name) {
  std::vector<std::string> names;
  for (const ConfigurationNode& element : list.elements()) {
    names.push_back(element.at("name").as_string());
    if (names.back() == name) return element;
  }
  list.fail(
      fmt::format("has no magnetometer '{}' of the platform file (found: {}); both files must be from the same "
                  "simulation",
                  name, join_names(names)));
}

}  // namespace

CalibrationEstimate read_true_calibration(const std::string& path, const SensorSuite& suite) {
  const ConfigurationNode root = ConfigurationNode::load(path);
  CalibrationEstimate truth;
  const ConfigurationNode& imu = root.at("imu");
  const char* keys[] = {"gyroscope_matrix", "accelerometer_matrix"};
  for (int i = 0; i < 2; ++i) {
    const Matrix3 E = (read_matrix(imu.at(keys[i])) - Matrix3::Identity()).transpose();  // row by row
    truth.imu.axes.segment<9>(9 * i) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(E.data());
  }
  const ConfigurationNode& lidar = root.at("lidar");
  const Pose T_imu_lidar = read_true_pose(lidar.at("T_imu_lidar"));
  const Pose& believed = suite.lidar.T_imu_lidar;
  truth.lidar.correction.turn_rad = so3::log(T_imu_lidar.rotation * believed.rotation.conjugate());
  truth.lidar.correction.shift_m = T_imu_lidar.position - believed.position;
  truth.lidar.correction.clock_s = lidar.at("clock_offset_s").as_double();
  truth.magnetometer_clock_s = root.at("magnetometer_clock_offset_s").as_double();
  for (const auto& magnetometer : suite.magnetometers) {
    const ConfigurationNode& node = magnetometer_of(root.at("magnetometers"), magnetometer.name);
    const Vector3 turn =
        so3::log(magnetometer.T_imu_mag.rotation.conjugate() * read_true_pose(node.at("T_imu_mag")).rotation);
    // Readings are matrix · Exp(−turn) · nominal field. The estimator divides 1 + E into −hat(θ) and a symmetric part.
    const Matrix3 E = read_matrix(node.at("matrix")) * so3::exp(-turn).toRotationMatrix() - Matrix3::Identity();
    const Matrix3 symmetric = 0.5 * (E + E.transpose());
    CalibrationEstimate::Magnetometer departure;
    departure.turn_rad = -0.5 * Vector3(E(2, 1) - E(1, 2), E(0, 2) - E(2, 0), E(1, 0) - E(0, 1));
    departure.distortion << symmetric(0, 0), symmetric(0, 1), symmetric(0, 2), symmetric(1, 1), symmetric(1, 2),
        symmetric(2, 2);
    truth.magnetometers.push_back(departure);
  }
  if (suite.wheels) {
    const ConfigurationNode& wheels = root.at("wheels");
    const Pose T_imu_wheels = read_true_pose(wheels.at("T_imu_wheels"));
    truth.wheels.correction = {wheels.at("scale").as_double() - 1.0,
                               so3::log(suite.wheels->T_imu_wheels.rotation.conjugate() * T_imu_wheels.rotation)};
  }
  return truth;
}

std::optional<CalibrationConsistency> compare_calibration(const SensorSuite& suite, const CalibrationEstimate& estimate,
                                                          const CalibrationEstimate& truth) {
  const std::vector<CalibrationRow> estimated = calibration_rows(suite, estimate);
  const std::vector<CalibrationRow> true_rows = calibration_rows(suite, truth);
  CalibrationConsistency result;
  int lidar_parameters = 0;
  double lidar_sum = 0.0;
  for (std::size_t i = 0; i < std::min(estimated.size(), true_rows.size()); ++i) {
    const CalibrationRow& row = estimated[i];
    if (!row.is_estimated()) continue;
    const double error = (row.estimate - true_rows[i].estimate) / row.sigma;
    const double prior_error = true_rows[i].estimate / row.platform_sigma;
    result.nees += error * error;
    result.prior_nees += prior_error * prior_error;
    ++result.parameters;
    if (row.sensor != "lidar") continue;
    lidar_sum += error * error;
    ++lidar_parameters;
  }
  if (result.parameters == 0) return std::nullopt;
  if (lidar_parameters > 0) result.nees_lidar = lidar_sum / lidar_parameters;
  result.nees /= result.parameters;
  result.prior_nees /= result.parameters;
  return result;
}

}  // namespace lodestone
