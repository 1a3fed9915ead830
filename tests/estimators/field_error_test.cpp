// The field error of the map, as the smoother infers it from the readings of a drive.
#include "estimators/smoother/field_error.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>

#include "estimators/smoother/keyframe_measurements.h"

namespace lodestone {
namespace {

constexpr double kWhiteNoise_ut = 1.0;
const Vector3 kEvenField_ut(20.0, 5.0, -40.0);

/// The robot drives 100 m at 1 m/s on an exact map of an even field; a scan takes 0.1 s.
double found_variance_ut2(int samples_a_scan) {
  EstimatorInput input;
  input.suite.magnetometers.resize(1);
  input.suite.magnetometers.front().noise_ut = kWhiteNoise_ut;
  const FieldGrid grid{1.0, {-5.0, -5.0}, 121, 11, {0.0}};
  const std::vector<Eigen::Vector4f> nodes(121 * 11, Eigen::Vector4f(20.0F, 5.0F, -40.0F, 0.1F));
  input.field = std::make_shared<MagneticMap>(grid, nodes, 1.0);
  const KeyframeMeasurements measurements(input);
  std::mt19937_64 generator(5);
  std::normal_distribution<double> noise(0.0, kWhiteNoise_ut);
  const auto no_bias = [](int) { return Vector3::Zero().eval(); };
  const auto no_matrix = [](int) { return Matrix3::Zero().eval(); };
  FieldError error;
  for (int scan = 0; scan < 1000; ++scan) {
    const Time begin = scan * from_seconds(0.1);
    const Time end = begin + from_seconds(0.1);
    NavState state;
    state.T_map_imu.position.x() = 0.1 * scan;
    state.velocity.x() = 1.0;
    Keyframe keyframe;
    for (const Time time : {begin, end}) keyframe.imu.push_back({time, Vector3::Zero(), -state.gravity});
    for (int i = 1; i <= samples_a_scan; ++i) {
      const Vector3 drawn(noise(generator), noise(generator), noise(generator));
      keyframe.magnetic.push_back({begin + i * ((end - begin) / samples_a_scan),
                                   std::vector<std::optional<Vector3>>{Vector3(kEvenField_ut + drawn)}});
    }
    keyframe.predicted = state.T_map_imu;
    keyframe.predicted_covariance = 1e-8 * Matrix6::Identity();
    measurements.weigh(keyframe, state, no_bias, no_matrix, {});
    measurements.judge_field_error(keyframe, state.T_map_imu, no_bias, no_matrix, {}, error);
  }
  return error.variance_a_reading_ut2();
}

TEST(FieldError, OfAnExactMapIsSmallWhateverNumberOfSamplesIsInAReading) {
  // Readings are means of up to five samples: of one, five and two at these rates.
  for (const int samples_a_scan : {1, 5, 2}) {
    const double reading_ut2 = kWhiteNoise_ut * kWhiteNoise_ut / samples_a_scan;
    EXPECT_LT(found_variance_ut2(samples_a_scan), 0.2 * reading_ut2) << samples_a_scan;
  }
}

}  // namespace
}  // namespace lodestone
