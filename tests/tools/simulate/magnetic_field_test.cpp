#include "tools/simulate/magnetic_field.h"

#include <gtest/gtest.h>

#include "core/random_stream.h"

namespace lodestone::simulation {
namespace {

FieldSource bar(const Vector3& center, const Vector3& axis, double length, double moment) {
  FieldSource source;
  source.is_bar = true;
  source.position = center + 0.5 * length * axis.normalized();
  source.south = center - 0.5 * length * axis.normalized();
  source.pole = moment / length;
  return source;
}

FieldSource dipole(const Vector3& center, const Vector3& moment) {
  FieldSource source;
  source.position = center;
  source.moment = moment;
  return source;
}

std::vector<FieldSource> scattered(int count) {
  RandomStream random(7, "test");
  std::vector<FieldSource> sources;
  for (int i = 0; i < count; ++i) {
    const Vector3 center(random.uniform(-30, 30), random.uniform(-30, 30), random.uniform(-0.7, -0.3));
    sources.push_back(i % 2 == 0 ? dipole(center, 8.0 * random.normal3())
                                 : bar(center, random.normal3(), random.uniform(0.5, 2.0), 12.0 * random.normal()));
  }
  return sources;
}

TEST(MagneticField, DipoleOnItsAxisAndEquator) {
  const FieldSource source = dipole(Vector3::Zero(), {0, 0, 10});
  EXPECT_LT((source_field_ut(source, {0, 0, 2}) - Vector3(0, 0, 0.1 * 2 * 10 / 8.0)).norm(), 1e-12);
  EXPECT_LT((source_field_ut(source, {2, 0, 0}) - Vector3(0, 0, -0.1 * 10 / 8.0)).norm(), 1e-12);
}

TEST(MagneticField, BarIsADipoleFromAfar) {
  const Vector3 axis = Vector3(1, 2, -1).normalized();
  const FieldSource rod = bar(Vector3::Zero(), axis, 1.0, 20.0), point = dipole(Vector3::Zero(), 20.0 * axis);
  for (const double distance : {10.0, 20.0, 40.0}) {
    const Vector3 place = distance * Vector3(0.3, -0.5, 0.8).normalized();
    const Vector3 difference = source_field_ut(rod, place) - source_field_ut(point, place);
    // The next multipole decreases by a further factor of (length / distance)².
    EXPECT_LT(difference.norm(), 2.0 / (distance * distance) * source_field_ut(point, place).norm());
  }
}

TEST(MagneticField, IsCurlFreeAndSourceFree) {
  const MagneticField field({18, -8, -40}, scattered(400));
  constexpr double h = 1e-3;
  RandomStream random(3, "places");
  for (int i = 0; i < 200; ++i) {
    const Vector3 place(random.uniform(-25, 25), random.uniform(-25, 25), 0.12);
    Matrix3 gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3 offset = h * Vector3::Unit(axis);
      gradient.col(axis) = (field.field_ut(place + offset) - field.field_ut(place - offset)) / (2 * h);
    }
    // The error of interpolating the far field is four orders below the gradients.
    EXPECT_NEAR(gradient.trace(), 0.0, 2e-3);
    EXPECT_LT((gradient - gradient.transpose()).cwiseAbs().maxCoeff(), 2e-3);
  }
}

TEST(MagneticField, InterpolationOfWhatIsFarKeepsTheSumOfAll) {
  const MagneticField field({18, -8, -40}, scattered(3600));
  RandomStream random(4, "places");
  double worst = 0.0;
  for (int i = 0; i < 300; ++i) {
    const Vector3 place(random.uniform(-25, 25), random.uniform(-25, 25), random.uniform(0.0, 0.5));
    worst = std::max(worst, (field.field_ut(place) - field.field_of_all_ut(place)).norm());
  }
  EXPECT_LT(worst, 5e-4);
}

TEST(MagneticField, HasNoStepsAcrossCells) {
  const MagneticField field({18, -8, -40}, scattered(400));
  constexpr double h = 1e-4;
  double largest = 0.0;
  Vector3 previous = (field.field_ut({-20, 0.3, 0.12}) - field.field_ut({-20 - h, 0.3, 0.12})) / h;
  for (int k = 1; k < 40000; ++k) {
    const double x = -20 + k * 1e-3;
    const Vector3 slope = (field.field_ut({x, 0.3, 0.12}) - field.field_ut({x - h, 0.3, 0.12})) / h;
    largest = std::max(largest, (slope - previous).norm());
    previous = slope;
  }
  // A step of 1e-3 µT would appear as a slope of 10 µT/m.
  EXPECT_LT(largest, 3.0);
}

TEST(MagneticField, WithoutSteelIsTheEarths) {
  const MagneticField field({18, -8, -40}, {});
  EXPECT_LT((field.field_ut({3, 4, 5}) - Vector3(18, -8, -40)).norm(), 1e-12);
}

}  // namespace
}  // namespace lodestone::simulation
