#include "tools/check/field_series.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <stdexcept>

namespace lodestone {
namespace {

/// Field readings of a magnetometer on a turning robot near steel, µT.
Vector3 turning_field(double seconds) {
  const double turn = 0.3 * seconds;
  return {20.0 * std::cos(turn) + 8.0 * std::sin(2.1 * seconds), -20.0 * std::sin(turn) + 6.0 * std::cos(1.7 * seconds),
          -40.0 + 9.0 * std::sin(1.1 * seconds)};
}

FieldSeries make_series(const std::function<Vector3(const Vector3& field, double seconds)>& read, double late_s = 0.0) {
  FieldSeries series;
  for (int i = 0; i < 200; ++i) {
    const double seconds = 0.05 * i;
    series.times.push_back(from_seconds(seconds));
    series.expected_ut.push_back(turning_field(seconds));
    const double wobble = 0.2 * std::sin(37.0 * i);  // in place of noise
    series.measured_ut.push_back(read(turning_field(seconds - late_s), seconds) + Vector3(wobble, -wobble, wobble));
    series.variance_ut2.push_back(0.04);
    series.noise_ut2.push_back(0.1);
  }
  series.way_m = 10.0;
  return series;
}

TEST(FieldModels, ExplainAHealthySensorByNothing) {
  const FieldModels models = fit_models(make_series([](const Vector3& field, double) { return field; }));
  EXPECT_LT(models.offset_ut.norm(), 0.2);
  EXPECT_LT(models.turn_rad, 0.01);
  EXPECT_LT(models.scale_error, 0.02);
  EXPECT_LT(models.drift_ut.norm(), 0.3);
  EXPECT_LT(std::abs(models.delay_s), 0.01);
}

TEST(FieldModels, FindWhatIsWrong) {
  const Vector3 offset(5, -7, 3);
  const FieldModels shifted =
      fit_models(make_series([&](const Vector3& field, double) { return (field + offset).eval(); }));
  EXPECT_LT((shifted.offset_ut - offset).norm(), 0.3);
  EXPECT_LT(shifted.rms_offset_ut, 0.1 * shifted.rms_ut);

  const Quaternion turn = so3::exp(Vector3(0.1, 0.0, 0.3));
  const FieldModels turned = fit_models(make_series([&](const Vector3& field, double) { return turn * field; }));
  EXPECT_NEAR(turned.turn_rad, so3::log(turn).norm(), 0.01);
  EXPECT_LT(turned.rms_turned_ut, 0.3 * turned.rms_offset_ut);

  const Vector3 scale(1.2, 0.9, 1.0);
  const FieldModels stretched =
      fit_models(make_series([&](const Vector3& field, double) { return field.cwiseProduct(scale).eval(); }));
  EXPECT_NEAR(stretched.scale_error, 0.2, 0.02);
  EXPECT_LT(stretched.rms_linear_ut, 0.3 * stretched.rms_offset_ut);

  const Vector3 rate(1, -2, 0);
  const FieldModels drifting =
      fit_models(make_series([&](const Vector3& field, double s) { return (field + s * rate).eval(); }));
  EXPECT_LT((drifting.drift_ut - 10.0 * 2.0 / 3.0 * rate).norm(), 0.5);
  EXPECT_LT(drifting.rms_drift_ut, 0.2 * drifting.rms_offset_ut);
}

TEST(FieldModels, FindALateClockAndNoClockInNoise) {
  for (const double late_s : {0.03, -0.25}) {
    const FieldModels models = fit_models(make_series([](const Vector3& field, double) { return field; }, late_s));
    EXPECT_NEAR(models.delay_s, late_s, 0.005);
    EXPECT_LT(models.rms_undelayed_ut, 0.5 * models.rms_offset_ut);
  }
}

TEST(FieldModels, NeedReadings) {
  EXPECT_THROW(fit_models(FieldSeries{}), std::invalid_argument);
}

}  // namespace
}  // namespace lodestone
