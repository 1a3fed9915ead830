// The sliding window as an estimator: consistency and unobservable directions, in simulated drives whose noise is
// exactly that of the factors.
#include "factors/sliding_window.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>
#include <cstdio>
#include <cstring>

#include "core/imu/propagation.h"
#include "tests/factors/window_scene.h"

namespace lodestone {
namespace {

constexpr double kLidarNoiseM = 0.02;

NavState draw_start(const NavState& truth, const Matrix17& covariance, Random& random) {
  return truth.boxplus(random.draw(covariance));
}

/// Adds keyframe k of the drive, predicted from the IMU.
void add_predicted(SlidingWindow& window, const Drive& truth, std::size_t k, const ImuNoise& noise) {
  window.add_keyframe(truth.times[k], propagate(window.state(window.size() - 1), truth.samples[k], noise, nullptr),
                      truth.samples[k]);
}

void set_scan(SlidingWindow& window, const Scan& points, const PoseMask& mask = {}) {
  const std::size_t newest = window.size() - 1;
  window.set_lidar(newest, condense_scan(points.matches, window.state(newest).T_map_imu), points.matches, mask);
}

Matrix6 covariance_of(const SlidingWindow& window, std::size_t k) {
  return window.pose_covariances(std::array<std::size_t, 1>{k}).front();
}

/// χ² quantile at `sigmas` of a normal variable (Wilson and Hilferty 1931; to 0.1 % above 100 degrees of freedom).
double chi_square_quantile(double degrees, double sigmas) {
  const double share = 2.0 / (9.0 * degrees);
  return degrees * std::pow(1.0 - share + sigmas * std::sqrt(share), 3);
}

TEST(SlidingWindow, ItsCovarianceIsThatOfItsErrors) {
  constexpr int kRuns = 60;
  constexpr std::size_t kWindow = 25;
  double causal = 0.0;
  double smoothed = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    Random random(100 + static_cast<std::uint64_t>(run));
    const DriveOptions options;
    const Drive truth = drive(options, random);
    const std::vector<Vector3> normals = room_normals(random);
    const Matrix17 covariance = start_covariance();
    SlidingWindow window(0, draw_start(truth.truth[0], covariance, random), covariance, 0, options.noise, {});
    for (std::size_t k = 1; k < truth.truth.size(); ++k) {
      add_predicted(window, truth, k, options.noise);
      set_scan(window, scan(truth.truth[k].T_map_imu, normals, 60, kLidarNoiseM, 5.0, 0.0, random));
      window.solve();
      if (window.size() > kWindow) window.marginalize_oldest();
    }
    const auto nees = [&](std::size_t k) {
      const std::size_t first = truth.truth.size() - window.size();
      const Vector6 error = window.state(k).T_map_imu.boxminus(truth.truth[first + k].T_map_imu);
      return error.dot(covariance_of(window, k).ldlt().solve(error));
    };
    causal += nees(window.size() - 1);
    smoothed += nees(0);
  }
  const double degrees = 6.0 * kRuns;
  std::printf("NEES per degree of freedom: %.3f causal, %.3f smoothed\n", causal / degrees, smoothed / degrees);
  for (const double sum : {causal, smoothed}) {
    EXPECT_GT(sum, chi_square_quantile(degrees, -2.576));
    EXPECT_LT(sum, chi_square_quantile(degrees, 2.576));
  }
}

// --- the null space
// -----------------------------------------------------------------------------------------------------

struct Tunnel {
  Vector3 axis;
  Quaternion heading;
  std::vector<Vector3> normals;  // walls, floor and ceiling: none has a component along the axis
};

Tunnel tunnel(const Quaternion& heading) {
  return {heading * Vector3::UnitX(), heading, {heading * Vector3::UnitY(), heading * Vector3::UnitZ()}};
}

/// Masks the LiDAR's translation along the axis.
PoseMask axis_mask(const Vector3& axis, const Pose& reference) {
  Vector6 direction = Vector6::Zero();
  direction.tail<3>() = axis;
  return {Matrix6::Identity() - direction * direction.transpose(), reference};
}

struct AxisSigmas {
  double window_m = 0.0;
  double filter_m = 0.0;  // of a Kalman filter linearized at the ground truth, with the planes' true normals
  double known_m = 0.0;   // of dead reckoning by accelerometer and initial state, with all else known
};

/// Sixty seconds of tunnel. `at(k, sigmas)` is called for each keyframe; returns the window's information about a
/// common shift of all poses along the axis at the end, over that at the start.
template <class Visitor>
double drive_through(const Tunnel& place, std::uint64_t seed, const Visitor& at) {
  Random random(seed);
  DriveOptions options;
  options.keyframes = 601;
  options.heading = place.heading;
  const Drive truth = drive(options, random);
  Matrix17 covariance = start_covariance();
  SlidingWindow window(0, draw_start(truth.truth[0], covariance, random), covariance, 0, options.noise, {});
  Vector17 shift = Vector17::Zero();
  shift.segment<3>(tangent::position) = place.axis;
  const double shift_at_start = shift.dot(window.prior_information() * shift);
  double largest_shift = 0.0;
  const double accelerometer_variance = std::pow(options.noise.accelerometer_noise_density, 2);
  for (std::size_t k = 1; k < truth.truth.size(); ++k) {
    add_predicted(window, truth, k, options.noise);
    // Normals have errors of half a degree: their spurious information about the axis must be masked.
    const Pose& true_pose = truth.truth[k].T_map_imu;
    const Scan points = scan(true_pose, place.normals, 200, kLidarNoiseM, 5.0, 0.01, random);
    const std::size_t newest = window.size() - 1;
    // Correspondences and linearization are centimetres off.
    const Pose guess =
        window.state(newest).T_map_imu.boxplus(0.02 * (Vector6() << random.vector(), random.vector()).finished());
    window.set_lidar(newest, condense_scan(points.matches, guess), points.matches, axis_mask(place.axis, guess));
    window.solve();
    window.set_lidar(newest, condense_scan(points.matches, window.state(newest).T_map_imu), points.matches,
                     axis_mask(place.axis, window.state(newest).T_map_imu));
    window.solve();

    propagate(truth.truth[k - 1], truth.samples[k], options.noise, &covariance);
    Scan exact;
    exact.planes = points.planes;
    for (std::size_t i = 0; i < exact.planes.size(); ++i) {
      exact.planes[i].normal = place.normals[i % place.normals.size()].cast<float>();
      exact.matches.push_back(points.matches[i]);
      exact.matches.back().plane = &exact.planes[i];
    }
    Matrix17 information = covariance.llt().solve(Matrix17::Identity());
    information.topLeftCorner<6, 6>() += condense(exact.matches, true_pose).hessian(true_pose);
    covariance = information.llt().solve(Matrix17::Identity());

    const double seconds = to_seconds(truth.times[k]);
    const Matrix17 start = start_covariance();
    AxisSigmas sigmas;
    sigmas.window_m = std::sqrt(place.axis.dot(covariance_of(window, newest).bottomRightCorner<3, 3>() * place.axis));
    sigmas.filter_m =
        std::sqrt(place.axis.dot(covariance.block<3, 3>(tangent::position, tangent::position) * place.axis));
    sigmas.known_m = std::sqrt(start(tangent::position, tangent::position) +
                               start(tangent::velocity, tangent::velocity) * seconds * seconds +
                               accelerometer_variance * std::pow(seconds, 3) / 3.0);
    at(k, sigmas);
    if (window.size() > 25) window.marginalize_oldest();
    largest_shift = std::max(largest_shift, shift.dot(window.prior_information() * shift));
  }
  return largest_shift / shift_at_start;
}

void expect_nothing_learnt(const Quaternion& heading, std::uint64_t seed) {
  double least_to_filter = 1e9;
  double least_to_known = 1e9;
  AxisSigmas last;
  const double growth = drive_through(tunnel(heading), seed, [&](std::size_t, const AxisSigmas& sigmas) {
    least_to_filter = std::min(least_to_filter, sigmas.window_m / sigmas.filter_m);
    least_to_known = std::min(least_to_known, sigmas.window_m / sigmas.known_m);
    last = sigmas;
  });
  std::printf(
      "axis sigma after 60 s: window %.3f m, filter at the truth %.3f m, dead reckoning with all else known %.3f m; "
      "least "
      "ratios %.4f and %.4f; shift information %.6f of the start's at most\n",
      last.window_m, last.filter_m, last.known_m, least_to_filter, least_to_known, growth);
  EXPECT_GT(least_to_filter, 0.99);
  EXPECT_GT(least_to_known, 0.99);
  EXPECT_LT(growth, 1.0 + 1e-6);
}

TEST(SlidingWindow, GainsNoInformationAlongATunnel) {
  expect_nothing_learnt(Quaternion::Identity(), 1);
}

TEST(SlidingWindow, GainsNoInformationAlongATunnelAskewInTheMap) {
  expect_nothing_learnt(so3::exp(Vector3(0.05, -0.15, 0.7)), 2);
  expect_nothing_learnt(so3::exp(Vector3(-0.1, 0.2, -2.3)), 3);
}

// --- determinism
// --------------------------------------------------------------------------------------------------------

/// All bits of the result of a drive of 200 keyframes with LiDAR, IMU and magnetometers.
std::vector<double> long_run() {
  Random random(7);
  DriveOptions options;
  options.keyframes = 201;
  const Drive truth = drive(options, random);
  const std::shared_ptr<const MagneticMap> map = wavy_map();
  const std::vector<Vector3> normals = room_normals(random);
  SlidingWindowOptions solver;
  solver.magnetometer_bias_epoch_s = 0.7;
  SlidingWindow window(0, truth.truth[0], start_covariance(), 3, options.noise, solver);
  std::vector<double> bits;
  for (std::size_t k = 1; k < truth.truth.size(); ++k) {
    add_predicted(window, truth, k, options.noise);
    set_scan(window, scan(truth.truth[k].T_map_imu, normals, 2000, kLidarNoiseM, 5.0, 0.005, random));
    window.set_field(
        window.size() - 1, map, FieldInterpolation::bicubic,
        field_readings(truth.truth[k].T_map_imu, *map, std::vector<Vector3>(3, Vector3::Zero()), 1.0, random), {});
    window.solve();
    if (window.size() > 25) window.marginalize_oldest();
    const NavState state = window.state(window.size() - 1);
    const Matrix6 covariance = covariance_of(window, window.size() - 1);
    bits.insert(bits.end(), state.T_map_imu.position.data(), state.T_map_imu.position.data() + 3);
    bits.insert(bits.end(), state.T_map_imu.rotation.coeffs().data(), state.T_map_imu.rotation.coeffs().data() + 4);
    bits.insert(bits.end(), state.gravity.data(), state.gravity.data() + 3);
    bits.insert(bits.end(), covariance.data(), covariance.data() + 36);
  }
  return bits;
}

TEST(SlidingWindow, GivesTheSameBitsOnEveryRunAndAnyNumberOfThreads) {
  const auto run = [](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return long_run();
  };
  const std::vector<double> first = run(1);
  // Changes addresses and order of the next run's blocks.
  std::vector<std::unique_ptr<char[]>> litter;
  for (std::size_t i = 0; i < 2000; ++i) litter.push_back(std::make_unique<char[]>(16 + (i * 7919) % 900));
  for (std::size_t i = 0; i < litter.size(); i += 3) litter[i].reset();
  for (const std::size_t threads : {1U, 2U, 4U}) {
    const std::vector<double> again = run(threads);
    ASSERT_EQ(again.size(), first.size());
    EXPECT_EQ(std::memcmp(again.data(), first.data(), first.size() * sizeof(double)), 0) << threads << " threads";
  }
}

// --- magnetometers
// ------------------------------------------------------------------------------------------------------

/// Newest state and covariance of a drive with few planes and three magnetometers, in a window of `size` keyframes.
struct MagneticRun {
  NavState state;
  Matrix6 covariance;
  Vector3 bias;
  std::vector<double> bias_errors;
};

MagneticRun magnetic_run(bool bias_states, std::size_t size) {
  Random random(11);
  DriveOptions options;
  options.keyframes = 61;
  const Drive truth = drive(options, random);
  const std::shared_ptr<const MagneticMap> map = wavy_map();
  SlidingWindowOptions solver;
  solver.magnetometer_bias_states = bias_states;
  solver.magnetometer_bias_epoch_s = 0.5;  // twelve epochs, two or three in a window of 1.2 s
  solver.max_iterations = 10;
  CalibrationSigmas calibration = exact_calibration();
  calibration.magnetometers.offset_sigma_ut = std::sqrt(2.0 * 2.0 - 0.5 * 0.5);  // with the window's own 0.5: 2
  const std::vector<Vector3> biases = bias_states
                                          ? std::vector<Vector3>{{1.0, -2.0, 0.5}, {-1.5, 1.0, 2.0}, {0.5, 0.5, -1.0}}
                                          : std::vector<Vector3>(3, Vector3::Zero());
  // Certain enough that past linearization points hardly matter, since the field is nonlinear in the pose.
  const Matrix17 covariance = start_covariance(0.1);
  SlidingWindow window(0, draw_start(truth.truth[0], covariance, random), covariance, 3, options.noise, solver,
                       calibration);
  const std::vector<Vector3> floor_and_wall{Vector3::UnitZ(), Vector3::UnitY()};
  for (std::size_t k = 1; k < truth.truth.size(); ++k) {
    add_predicted(window, truth, k, options.noise);
    set_scan(window, scan(truth.truth[k].T_map_imu, floor_and_wall, 60, kLidarNoiseM, 5.0, 0.0, random));
    std::vector<FieldReading> readings = field_readings(truth.truth[k].T_map_imu, *map, biases, 0.5, random);
    if (k % 7 == 0) readings.clear();  // occasional outages
    window.set_field(window.size() - 1, map, FieldInterpolation::bicubic, readings, {});
    window.solve();
    if (window.size() > size) window.marginalize_oldest();
  }
  const std::size_t newest = window.size() - 1;
  MagneticRun result{window.state(newest), covariance_of(window, newest), window.magnetometer_bias(newest, 1), {}};
  for (int i = 0; i < 3; ++i) {
    result.bias_errors.push_back((window.magnetometer_bias(newest, i) - biases[static_cast<std::size_t>(i)]).norm());
  }
  return result;
}

TEST(SlidingWindow, EpochsOfMagnetometerBiasesLeaveItAndTheirInformationStays) {
  for (const bool bias_states : {true, false}) {
    const MagneticRun whole = magnetic_run(bias_states, 1000);
    const MagneticRun windowed = magnetic_run(bias_states, 12);
    // Marginalization of the past does not change the information about the newest state, but for linearization points.
    const Vector6 sigma = whole.covariance.diagonal().cwiseSqrt();
    const Vector6 difference = windowed.state.T_map_imu.boxminus(whole.state.T_map_imu);
    for (int i = 0; i < 6; ++i) {
      EXPECT_LT(std::abs(difference[i]), 0.02 * sigma[i]) << bias_states << " " << i;
      EXPECT_NEAR(windowed.covariance(i, i) / whole.covariance(i, i), 1.0, 0.005) << bias_states << " " << i;
    }
    EXPECT_LT((windowed.bias - whole.bias).norm(), 0.02) << bias_states;
    for (const double error : windowed.bias_errors) EXPECT_LT(error, bias_states ? 0.5 : 1e-12);
    std::printf(
        "bias states %d: window off the whole by %.2f mm of %.2f mm sigma, variance ratio %.4f, biases off by %.3f "
        "uT\n",
        bias_states, 1e3 * difference.tail<3>().norm(), 1e3 * sigma.tail<3>().norm(),
        windowed.covariance(3, 3) / whole.covariance(3, 3), windowed.bias_errors[0]);
  }
}

}  // namespace
}  // namespace lodestone
