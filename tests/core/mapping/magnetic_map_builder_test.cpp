#include "core/mapping/magnetic_map_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/error.h"
#include "drifting_survey.h"

namespace lodestone {
namespace {

/// The field of a row of dipoles under the floor, µT, a smooth field with sharp places.
Vector3 dipoles(const Vector3& p) {
  Vector3 field(18.0, 2.0, -42.0);
  for (int i = 0; i < 12; ++i) {
    const Vector3 offset = p - Vector3(1.1 * i, 0.7 + 0.5 * std::sin(2.0 * i), -0.35);
    const Vector3 moment = 1.2 * Vector3(std::cos(3.0 * i), std::sin(5.0 * i), 1.0);
    const double distance = offset.norm();
    const Vector3 direction = offset / distance;
    field += (3.0 * direction * direction.dot(moment) - moment) / std::pow(distance, 3);
  }
  return field;
}

std::vector<FieldObservation> dipole_survey(double noise, std::vector<bool>* in_block = nullptr) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  std::vector<FieldObservation> observations;
  for (int lane = 0; lane < 8; ++lane) {
    for (int i = 0; i < 2400; ++i) {
      FieldObservation observation;
      observation.position = Vector3(0.005 * i, 0.2 * lane, 0.3);
      observation.field_ut =
          dipoles(observation.position) + noise * Vector3(normal(generator), normal(generator), normal(generator));
      observation.noise_ut = noise;
      observations.push_back(observation);
      if (in_block) in_block->push_back((i / 80 + lane) % 10 == 3);
    }
  }
  return observations;
}

TEST(MagneticMapBuilderTest, ReportsItsProgressAndCanBeEnded) {
  const std::vector<FieldObservation> survey = dipole_survey(1.0);
  std::vector<double> shares;
  build_magnetic_map(survey, {}, [&](double share) { shares.push_back(share); });
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_EQ(shares.front(), 0.0);
  EXPECT_EQ(shares.back(), 1.0);
  EXPECT_GT(shares.size(), 10U);
  for (const double last : {0.0, 0.5}) {
    const auto end = [last](double share) {
      if (share >= last) throw Interrupted();
    };
    EXPECT_THROW(build_magnetic_map(survey, {}, end), Interrupted);
  }
}

TEST(MagneticMapBuilderTest, MapIsTheFieldWithinItsSigma) {
  const MagneticMapResult result = build_magnetic_map(dipole_survey(1.0), MagneticMapOptions{});
  std::mt19937_64 generator(4);
  const auto uniform = [&] { return static_cast<double>(generator() >> 11) * 0x1.0p-53; };
  int answered = 0;
  double squares = 0.0;
  double normalized = 0.0;
  for (int i = 0; i < 3000; ++i) {
    const Vector3 position(0.1 + 11.7 * uniform(), 0.05 + 1.3 * uniform(), 0.3);
    const auto value = result.map.query(position, FieldInterpolation::bicubic);
    if (!value) continue;
    ++answered;
    const double error = (value->field_ut - dipoles(position)).squaredNorm() / 3.0;
    squares += error;
    normalized += error / (value->sigma_ut * value->sigma_ut);
  }
  EXPECT_GT(answered, 2950);
  std::printf("rms %.3f uT, median sigma %.3f, 95%% %.3f, normalized %.3f\n", std::sqrt(squares / answered),
              result.median_sigma_ut, result.high_sigma_ut, std::sqrt(normalized / answered));
  EXPECT_LT(std::sqrt(squares / answered), 0.5);
  EXPECT_GT(std::sqrt(normalized / answered), 0.6);
  EXPECT_LT(std::sqrt(normalized / answered), 1.4);
  // Outside the survey there is no field.
  EXPECT_FALSE(result.map.query({6.0, 4.0, 0.3}, FieldInterpolation::bicubic));
  EXPECT_EQ(std::remainder(result.map.grid().origin.x(), 0.1),
            std::remainder(std::round(result.map.grid().origin.x() * 10) * 0.1, 0.1));
}

TEST(MagneticMapBuilderTest, HeldOutScoreIsHonest) {
  std::vector<bool> in_block;
  const auto all = dipole_survey(1.0, &in_block);
  std::vector<FieldObservation> training, held_out;
  for (std::size_t i = 0; i < all.size(); ++i) (in_block[i] ? held_out : training).push_back(all[i]);
  const SlidingGprOptions options;
  const FieldKernelFit fit = fit_field_kernels(training, 0.1, options);
  const HeldOutScore score =
      score_held_out({thin_survey(training, fit.cell_m), thin_survey(held_out, fit.cell_m)}, fit, 5.0, options);
  EXPECT_GT(score.cells, 50U);
  for (int k = 0; k < 3; ++k) {
    EXPECT_GT(score.normalized_rms[k], 0.6);
    EXPECT_LT(score.normalized_rms[k], 1.4);
  }
}

TEST(MagneticMapBuilderTest, SubtractsOffsetsOnlyIfHeldOutReadingsAgree) {
  const testing::SteelFloor floor(5);
  MagneticMapOptions options;
  options.regression.calibration_block_m = 1.5;
  const auto survey = [&](double offset_ut, std::vector<Vector3>* truth) {
    return testing::drive_over(floor, 5, {0.0, offset_ut, 0.2}, 0.0, truth);
  };
  std::vector<Vector3> truth;
  const MagneticMapResult with = build_magnetic_map(survey(3.0, &truth), options);
  options.offset_sigma_ut = 0.0;
  const MagneticMapResult ignored = build_magnetic_map(survey(3.0, nullptr), options);
  double error = 0.0, error_ignored = 0.0;
  int count = 0;
  for (double x = 0.3; x < 4.7; x += 0.11) {
    for (double y = 0.3; y < 1.8; y += 0.13) {
      const Vector3 place(x, y, 0.1);
      const auto found = with.map.query(place, FieldInterpolation::bicubic);
      const auto other = ignored.map.query(place, FieldInterpolation::bicubic);
      if (!found || !other) continue;
      error += (found->field_ut - floor.field_ut(place)).head<2>().squaredNorm();
      error_ignored += (other->field_ut - floor.field_ut(place)).head<2>().squaredNorm();
      ++count;
    }
  }
  ASSERT_GT(count, 200);
  EXPECT_LT(error, 0.5 * error_ignored);
  ASSERT_EQ(with.errors.offsets_ut.size(), 3U);
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_LT((with.errors.offsets_ut[j] - truth[j]).head<2>().norm(), 0.5 * truth[j].head<2>().norm());
  }

  options.offset_sigma_ut = 1.0;
  const MagneticMapResult without = build_magnetic_map(survey(0.0, nullptr), options);
  options.offset_sigma_ut = 0.0;
  const MagneticMapResult plain = build_magnetic_map(survey(0.0, nullptr), options);
  EXPECT_TRUE(without.errors.offsets_ut.empty());
  EXPECT_EQ(without.median_sigma_ut, plain.median_sigma_ut);
}

/// Offsets as large as the field's variation are found and subtracted; what the survey knows of the field is the same.
TEST(MagneticMapBuilderTest, LargeOffsetsOfMagnetometersDoNotEmptyTheMap) {
  const testing::SteelFloor floor(6);
  MagneticMapOptions options;
  options.regression.calibration_block_m = 1.5;
  options.offset_sigma_ut = 10.0;
  options.clock_sigma_s = 0.0;
  const MagneticMapResult without = build_magnetic_map(testing::drive_over(floor, 6, {0.003, 0.0, 0.2}), options);
  const MagneticMapResult with = build_magnetic_map(testing::drive_over(floor, 6, {0.003, 10.0, 0.2}), options);
  EXPECT_GT(with.nodes, without.nodes * 9 / 10);
  EXPECT_LT(with.nodes, without.nodes * 11 / 10);
  // A limit without the offsets would leave few of them.
  options.max_sigma_ut = without.map.max_sigma_ut();
  EXPECT_LT(build_magnetic_map(testing::drive_over(floor, 6, {0.003, 10.0, 0.2}), options).nodes, without.nodes / 2);
}

TEST(MagneticMapBuilderTest, CorrectsTheClockOnlyIfHeldOutReadingsAgree) {
  const testing::SteelFloor floor(6);
  MagneticMapOptions options;
  options.regression.calibration_block_m = 1.5;
  options.offset_sigma_ut = 0.0;
  const auto error_of = [&](const MagneticMapResult& result) {
    double squares = 0.0;
    int count = 0;
    for (double x = 0.3; x < 4.7; x += 0.11) {
      for (double y = 0.3; y < 1.8; y += 0.13) {
        const Vector3 place(x, y, 0.1);
        const auto found = result.map.query(place, FieldInterpolation::bicubic);
        if (!found) continue;
        squares += (found->field_ut - floor.field_ut(place)).squaredNorm();
        ++count;
      }
    }
    EXPECT_GT(count, 200);
    return std::sqrt(squares / std::max(count, 1));
  };
  const auto late = testing::drive_over(floor, 6, {0.003, 0.0, 0.2, 0.04, 2.0});
  const auto punctual = testing::drive_over(floor, 6, {0.003, 0.0, 0.2, 0.0, 2.0});
  const MagneticMapResult corrected = build_magnetic_map(late, options);
  EXPECT_NEAR(corrected.errors.clock_s, 0.04, 0.004);
  const double with_right_clock = error_of(build_magnetic_map(punctual, options));
  EXPECT_LT(error_of(corrected), 1.2 * with_right_clock);
  options.clock_sigma_s = 0.0;
  const MagneticMapResult uncorrected = build_magnetic_map(late, options);
  EXPECT_EQ(uncorrected.errors.clock_s, 0.0);
  EXPECT_GT(error_of(uncorrected), 1.5 * error_of(corrected));
}

// The floor of the survey rises and falls; one magnetometer sits higher than the other.
TEST(MagneticMapBuilderTest, KnowsHowMuchTheArraysHeightVariesAboutTheLayer) {
  std::vector<FieldObservation> survey = dipole_survey(1.0);
  const double amplitude_m = 0.02;
  for (std::size_t i = 0; i < survey.size(); ++i) {
    survey[i].magnetometer = static_cast<int>(i % 2);
    const double floor_m = amplitude_m * std::sin(survey[i].position.x());
    survey[i].position.z() = 0.3 + floor_m + (i % 2 == 0 ? 0.05 : -0.05);
  }
  const double rms_m = amplitude_m / std::sqrt(2.0);
  EXPECT_NEAR(build_magnetic_map(survey, {}).map.errors().height_sigma_m, rms_m, 0.1 * rms_m);
  MagneticMapOptions options;
  options.heights_m = {0.33};
  EXPECT_NEAR(build_magnetic_map(survey, options).map.errors().height_sigma_m, std::hypot(rms_m, 0.03), 0.002);
  options.heights_m = {0.28, 0.33};
  EXPECT_LT(build_magnetic_map(survey, options).map.errors().height_sigma_m, 0.0);
}

// A survey by hand, or over a ramp. One layer would describe the field at none of these heights.
TEST(MagneticMapBuilderTest, HasLayersWhereTheSurveysHeightVaries) {
  std::vector<FieldObservation> survey = dipole_survey(0.1);
  std::mt19937_64 generator(7);
  std::normal_distribution<double> noise(0.0, 0.1);
  for (FieldObservation& observation : survey) {
    observation.position.z() = 0.4 + 0.2 * std::sin(0.7 * observation.position.x() + 9.0 * observation.position.y());
    const double x = noise(generator), y = noise(generator), z = noise(generator);
    observation.field_ut = dipoles(observation.position) + Vector3(x, y, z);
  }
  const auto rms_on_track = [&](const MagneticMapOptions& options) {
    const MagneticMap map = build_magnetic_map(survey, options).map;
    double squares = 0.0, count = 0.0;
    for (std::size_t i = 0; i < survey.size(); i += 7) {
      Vector3 place = survey[i].position;
      if (map.grid().heights_m.size() == 1) place.z() = map.grid().heights_m.front();
      const auto field = map.query(place, FieldInterpolation::bilinear);
      if (!field) continue;
      squares += (field->field_ut - dipoles(survey[i].position)).squaredNorm() / 3.0;
      count += 1.0;
    }
    EXPECT_GT(count, 0.9 * static_cast<double>(survey.size()) / 7.0);
    return std::sqrt(squares / count);
  };
  const MagneticMap map = build_magnetic_map(survey, {}).map;
  EXPECT_GT(map.grid().heights_m.size(), 2U);
  EXPECT_LT(map.grid().heights_m.front(), 0.21);
  EXPECT_GT(map.grid().heights_m.back(), 0.59);
  MagneticMapOptions one_layer;
  one_layer.heights_m = {0.4};
  EXPECT_LT(rms_on_track({}), 0.5 * rms_on_track(one_layer));
}

TEST(MagneticMapBuilderTest, RefusesAGridTooLarge) {
  auto observations = dipole_survey(1.0);
  observations.back().position.x() = 1e6;
  EXPECT_THROW(build_magnetic_map(observations, MagneticMapOptions{}), InputError);
  MagneticMapOptions options;
  options.resolution_m = -1.0;
  EXPECT_THROW(build_magnetic_map(dipole_survey(1.0), options), InputError);
}

}  // namespace
}  // namespace lodestone
