// The alternation of localization and calibration, in drives whose noise is exactly that of the model.
#include "estimators/baselines/magnetic_calibrating/calibrating_window.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <array>
#include <cmath>
#include <cstdio>

#include "core/imu/propagation.h"
#include "estimators/baselines/magnetic_calibrating/magnetic_calibrating_options.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

constexpr double kFieldNoise_ut = 0.4;
constexpr std::size_t kWindowLength = 20;

/// wavy_map at two heights, so that the height is not held.
std::shared_ptr<const MagneticMap> wavy_map_of_two_layers() {
  const auto one = wavy_map();
  FieldGrid grid = one->grid();
  grid.heights_m = {-5.0, 5.0};
  std::vector<Eigen::Vector4f> nodes = one->nodes();
  const std::vector<Eigen::Vector4f> upper = nodes;
  nodes.insert(nodes.end(), upper.begin(), upper.end());
  return std::make_shared<MagneticMap>(grid, nodes, 5.0);
}

/// Four magnetometers at the corners of the robot.
SensorSuite suite_of_four() {
  SensorSuite suite;
  for (int j = 0; j < 4; ++j) {
    MagnetometerModel model;
    model.name = "mag_" + std::to_string(j);
    model.T_imu_mag = {so3::exp(Vector3(0.0, 0.0, 0.5 * j)), Vector3(j < 2 ? 0.3 : -0.3, j % 2 ? 0.25 : -0.25, -0.1)};
    model.noise_ut = kFieldNoise_ut;
    suite.magnetometers.push_back(model);
  }
  suite.calibration = exact_calibration();
  suite.calibration.magnetometers.offset_sigma_ut = 1.0;
  suite.calibration.magnetometers.matrix_sigma = 0.01;
  suite.calibration.magnetometers.rotation_sigma_deg = 1.0;
  return suite;
}

MagneticOptions without_map_error() {
  MagneticOptions options;
  options.map_sigma = false;
  return options;
}

/// What a magnetometer of the drive reads: bias + (1 + E) field.
struct TrueCalibration {
  Vector3 bias_ut = Vector3::Zero();
  Matrix3 matrix = Matrix3::Zero();
};

/// A drive that a window estimates, keyframe by keyframe.
class CalibratedDrive {
 public:
  CalibratedDrive(std::uint64_t seed, int keyframes, std::vector<TrueCalibration> calibrations,
                  const MagneticOptions& magnetic = without_map_error())
      : calibrations_(std::move(calibrations)), random_(seed) {
    DriveOptions options;
    options.keyframes = keyframes;
    options.heading = so3::exp(Vector3(0.0, 0.0, 6.28 * static_cast<double>(seed % 10) / 10.0));
    suite_.imu = options.noise;
    truth_ = drive(options, random_);
    const Matrix17 covariance = start_covariance();
    window_ = std::make_unique<CalibratingWindow>(0, truth_.truth[0].boxplus(random_.draw(covariance)), covariance,
                                                  suite_, map_, magnetic);
    read(0, 0.0);
  }

  /// Adds keyframe k with readings; a share of them are outliers.
  void add(std::size_t k, double outlier_share = 0.0) {
    const SlidingWindow& window = window_->window();
    const NavState predicted = propagate(window.state(window.size() - 1), truth_.samples[k], suite_.imu, nullptr);
    window_->add_keyframe(truth_.times[k], predicted, truth_.samples[k]);
    read(k, outlier_share);
  }

  void marginalize() {
    while (window_->window().size() > kWindowLength) window_->marginalize_oldest();
  }

  CalibratingWindow& window() { return *window_; }
  const SensorSuite& suite() const { return suite_; }
  const MagneticMap& map() const { return *map_; }
  std::size_t keyframes() const { return truth_.truth.size(); }
  const std::vector<std::vector<ArrayReading>>& readings() const { return readings_; }

  /// Error of the newest pose, φ and p.
  Vector6 newest_error() const {
    const SlidingWindow& window = window_->window();
    return window.state(window.size() - 1).T_map_imu.boxminus(truth_.truth[readings_.size() - 1].T_map_imu);
  }

  Vector3 bias_ut(int magnetometer) const {
    return window_->window().magnetometer_bias(window_->window().size() - 1, magnetometer);
  }

 private:
  void read(std::size_t k, double outlier_share) {
    std::vector<ArrayReading> arrays(2);
    for (ArrayReading& array : arrays) {
      for (std::size_t j = 0; j < suite_.magnetometers.size(); ++j) {
        const Pose T_map_mag = truth_.truth[k].T_map_imu * suite_.magnetometers[j].T_imu_mag;
        const Vector3 field =
            T_map_mag.rotation.conjugate() * map_->query(T_map_mag.position, FieldInterpolation::bicubic)->field_ut;
        const TrueCalibration& calibration = calibrations_[j];
        MeanReading reading;
        reading.T_end_mag = suite_.magnetometers[j].T_imu_mag;
        reading.magnetometer = static_cast<int>(j);
        reading.samples = 1;
        reading.measured_ut = calibration.bias_ut + field + calibration.matrix * field + random_.vector(kFieldNoise_ut);
        if (std::abs(random_.normal()) < outlier_share) reading.measured_ut += random_.vector(30.0);
        array.readings.push_back(reading);
      }
    }
    window_->set_readings(arrays, 0.05);
    readings_.push_back(std::move(arrays));
  }

  SensorSuite suite_ = suite_of_four();
  std::shared_ptr<const MagneticMap> map_ = wavy_map_of_two_layers();
  std::vector<TrueCalibration> calibrations_;
  Random random_;
  Drive truth_;
  std::unique_ptr<CalibratingWindow> window_;
  std::vector<std::vector<ArrayReading>> readings_;
};

TEST(CalibratingWindow, EveryStepOfTheAlternationLowersTheJointCost) {
  std::vector<TrueCalibration> calibrations(4);
  calibrations[1].bias_ut = Vector3(1.0, -0.5, 0.8);
  calibrations[3].matrix = Vector3(0.01, -0.01, 0.005).asDiagonal();
  CalibratedDrive drive(4, 15, calibrations);
  for (std::size_t k = 1; k < drive.keyframes(); ++k) {
    drive.add(k, 0.1);
    double before = drive.window().joint_cost();
    for (int round = 0; round < 4; ++round) {
      const double localized = drive.window().localize();
      EXPECT_LE(localized, before + 1e-6) << "keyframe " << k << ", round " << round;
      before = drive.window().calibrate();
      EXPECT_LE(before, localized + 1e-6) << "keyframe " << k << ", round " << round;
    }
  }
}

TEST(CalibratingWindow, CalibratesByTheLeastSquaresOfReadingsAndPrior) {
  std::vector<TrueCalibration> calibrations(4);
  calibrations[2].bias_ut = Vector3(0.5, 0.4, -0.6);
  CalibratedDrive drive(5, 6, calibrations);
  for (std::size_t k = 1; k < drive.keyframes(); ++k) drive.add(k);
  for (int i = 0; i < 3; ++i) drive.window().localize();  // the Huber weights of all readings become one, or nearly so
  for (int i = 0; i < 20; ++i) drive.window().calibrate();
  const SlidingWindow& window = drive.window().window();
  const auto& given = drive.suite().calibration.magnetometers;
  const double threshold = 2.7955;  // √χ²₃(0.95)
  for (int j = 0; j < 4; ++j) {
    std::vector<Eigen::Matrix<double, 3, 13>> parts;  // bias, matrix, constant
    for (std::size_t k = 0; k < window.size(); ++k) {
      for (const ArrayReading& array : drive.readings()[k]) {
        const MeanReading& reading = array.readings[static_cast<std::size_t>(j)];
        const Pose T_map_mag = window.state(k).T_map_imu * reading.T_end_mag;
        const Vector3 field = T_map_mag.rotation.conjugate() *
                              drive.map().query(T_map_mag.position, FieldInterpolation::bicubic)->field_ut;
        Eigen::Matrix<double, 3, 13> rows;
        rows.leftCols<3>().setIdentity();
        for (int i = 0; i < 9; ++i) {
          const Eigen::Matrix<double, 9, 1> unit = Eigen::Matrix<double, 9, 1>::Unit(i);
          rows.col(3 + i) = CalibrationEstimate::matrix_of(unit.data()) * field;
        }
        rows.col(12) = reading.measured_ut - field;
        // The weights at the solution itself.
        const Vector3 residual = rows.col(12) - window.magnetometer_bias(k, j) - window.magnetometer_matrix(j) * field;
        const double distance = residual.norm() / kFieldNoise_ut;
        parts.push_back(rows * (std::sqrt(std::min(1.0, threshold / distance)) / kFieldNoise_ut));
      }
    }
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(parts.size()) + 12, 13);
    for (std::size_t i = 0; i < parts.size(); ++i) system.middleRows<3>(3 * static_cast<Eigen::Index>(i)) = parts[i];
    Eigen::Matrix<double, 12, 1> sigma;
    sigma << Vector3::Constant(std::hypot(0.5, given.offset_sigma_ut)),
        Vector3::Constant(given.rotation_sigma_deg * M_PI / 180.0), Vector6::Constant(given.matrix_sigma);
    system.bottomLeftCorner<12, 12>() = sigma.cwiseInverse().asDiagonal();
    const Eigen::VectorXd solution = system.leftCols<12>().colPivHouseholderQr().solve(system.col(12).eval());
    EXPECT_LT((window.magnetometer_bias(0, j) - solution.head<3>()).norm(), 1e-3) << "magnetometer " << j;
    EXPECT_LT((window.magnetometer_matrix(j) - CalibrationEstimate::matrix_of(solution.data() + 3)).norm(), 1e-4)
        << "magnetometer " << j;
  }
}

TEST(CalibratingWindow, FindsAHardIronOfFiveMicroteslaWhileItLocalizes) {
  std::vector<TrueCalibration> calibrations(4);
  calibrations[2].bias_ut = Vector3(3.0, -4.0, 0.0);
  CalibratedDrive drive(6, 60, calibrations);
  for (std::size_t k = 1; k < drive.keyframes(); ++k) {
    drive.add(k);
    drive.window().alternate(MagneticCalibratingOptions{}.alternations);
    drive.marginalize();
  }
  std::printf("hard iron %.2f %.2f %.2f uT, position error %.3f m\n", drive.bias_ut(2).x(), drive.bias_ut(2).y(),
              drive.bias_ut(2).z(), drive.newest_error().segment<2>(3).norm());
  EXPECT_LT((drive.bias_ut(2) - calibrations[2].bias_ut).norm(), 1.0);
  for (const int healthy : {0, 1, 3}) EXPECT_LT(drive.bias_ut(healthy).norm(), 1.0);
  EXPECT_LT(drive.newest_error().segment<2>(3).norm(), 0.1);
}

TEST(CalibratingWindow, OutliersMoveItLessThanLeastSquares) {
  const auto rms_m = [](bool huber) {
    MagneticOptions options = without_map_error();
    options.huber = huber;
    CalibratedDrive drive(7, 40, std::vector<TrueCalibration>(4), options);
    double squared = 0.0;
    for (std::size_t k = 1; k < drive.keyframes(); ++k) {
      drive.add(k, 0.15);  // about 12 % of the readings
      drive.window().alternate(MagneticCalibratingOptions{}.alternations);
      drive.marginalize();
      squared += drive.newest_error().segment<2>(3).squaredNorm();
    }
    return std::sqrt(squared / 39.0);
  };
  const double robust = rms_m(true);
  const double least_squares = rms_m(false);
  std::printf("horizontal error %.3f m, %.3f m with least squares\n", robust, least_squares);
  EXPECT_LT(robust, 0.06);
  EXPECT_LT(robust, 0.5 * least_squares);
}

TEST(CalibratingWindow, ItsCovarianceIsThatOfItsErrorsIncludingThoseOfTheCalibration) {
  constexpr int kDrives = 24;
  double sum = 0.0;
  for (int run = 0; run < kDrives; ++run) {
    Random random(500 + static_cast<std::uint64_t>(run));
    std::vector<TrueCalibration> calibrations(4);
    for (TrueCalibration& calibration : calibrations) {
      calibration.bias_ut = random.vector(std::hypot(0.5, 1.0));
      Eigen::Matrix<double, 9, 1> parameters;
      parameters << random.vector(M_PI / 180.0), random.vector(0.01), random.vector(0.01);
      calibration.matrix = CalibrationEstimate::matrix_of(parameters.data());
    }
    CalibratedDrive drive(900 + static_cast<std::uint64_t>(run), 30, calibrations);
    for (std::size_t k = 1; k < drive.keyframes(); ++k) {
      drive.add(k);
      drive.window().alternate(MagneticCalibratingOptions{}.alternations);
      drive.marginalize();
    }
    const SlidingWindow& window = drive.window().window();
    const Matrix6 covariance = window.pose_covariances(std::array<std::size_t, 1>{window.size() - 1}).front();
    const Vector6 error = drive.newest_error();
    sum += error.dot(covariance.ldlt().solve(error)) / (6.0 * kDrives);
  }
  std::printf("NEES per degree of freedom: %.3f\n", sum);
  // 144 degrees of freedom: sigma 0.12.
  EXPECT_GT(sum, 0.65);
  EXPECT_LT(sum, 1.35);
}

TEST(CalibratingWindow, TheHeightOfAMapOfOneLayerIsHeld) {
  const SensorSuite suite = suite_of_four();
  NavState state;
  state.T_map_imu.position = Vector3(0.5, -0.3, 0.25);  // the array is 0.15 m above the layer
  CalibratingWindow window(0, state, start_covariance(4.0), suite, wavy_map(), without_map_error());
  window.localize();
  // Sigma 0.2 m of the initial height against 0.02 m of the layer.
  EXPECT_NEAR(window.window().state(0).T_map_imu.position.z(), 0.1, 0.01);
  EXPECT_NEAR(window.window().state(0).T_map_imu.position.x(), 0.5, 1e-3);
}

}  // namespace
}  // namespace lodestone
