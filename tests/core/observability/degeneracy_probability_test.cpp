#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <deque>
#include <random>

#include "core/lidar/condensed_cost.h"
#include "core/observability/degeneracy.h"
#include "core/observability/information_noise.h"

namespace lodestone {
namespace {

constexpr float kVariance_m2 = 4e-4F;  // of a residual: two centimetres

/// A scan at the origin among planes whose normals have errors of `tilt` (rad, one sigma of each slope).
class NoisyScan {
 public:
  NoisyScan(double tilt, std::uint64_t seed) : tilt_(tilt), generator_(seed) {}

  /// A plane and its points; `variance` of their residuals, m².
  void add(const Vector3& normal, const std::vector<Vector3>& points, float variance = kVariance_m2) {
    const Vector3 helper = std::abs(normal.z()) < 0.9 ? Vector3::UnitZ() : Vector3::UnitX();
    const Vector3 major = normal.cross(helper).normalized();
    const Vector3 tilted =
        (normal + tilt_ * (normal_(generator_) * major + normal_(generator_) * normal.cross(major))).normalized();
    Plane plane;
    plane.normal = tilted.cast<float>();
    plane.center = points.front().cast<float>();
    plane.major = (major - tilted * tilted.dot(major)).normalized().cast<float>();
    plane.major_tilt_variance = plane.minor_tilt_variance = static_cast<float>(tilt_ * tilt_);
    planes_.push_back(plane);
    for (const Vector3& point : points) correspondences_.push_back({point.cast<float>(), &planes_.back(), variance});
  }

  /// A wall across `axis`, 10 m a side, in patches with three points each.
  void add_wall(int axis, double offset, double half_side = 5.0) {
    for (int i = -10; i <= 10; ++i) {
      for (int j = -10; j <= 10; ++j) {
        std::vector<Vector3> points(3);
        for (int k = 0; k < 3; ++k) {
          points[static_cast<std::size_t>(k)][axis] = offset;
          points[static_cast<std::size_t>(k)][(axis + 1) % 3] = 0.1 * half_side * (i + 0.2 * k);
          points[static_cast<std::size_t>(k)][(axis + 2) % 3] = 0.1 * half_side * (j + 0.2 * (k == 1));
        }
        add(Vector3::Unit(axis), points);
      }
    }
  }

  void add_corridor() {
    add_wall(1, 2.0);
    add_wall(1, -2.0);
    add_wall(2, -1.0);
  }

  const std::vector<Correspondence>& correspondences() const { return correspondences_; }

  Degeneracy analyse(const DegeneracyOptions& options, double lever_arm_m = 5.0, const NormalNoise& noise = {}) const {
    const CondensedCost cost = condense(correspondences_, Pose{});
    return analyse_by_probability(cost.hessian(Pose{}) - cost.spurious_information, cost.spurious_information,
                                  correspondences_, Pose{}, lever_arm_m, options, noise);
  }

  /// The sigma rule on the same scan, with the information uncorrected.
  Degeneracy analyse_naively(const DegeneracyOptions& options) const {
    return analyse_by_sigma(condense(correspondences_, Pose{}).hessian(Pose{}), 5.0, options);
  }

 private:
  double tilt_;
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  std::deque<Plane> planes_;
  std::vector<Correspondence> correspondences_;
};

DegeneracyOptions probabilistic(MaskKind mask = MaskKind::hard) {
  DegeneracyOptions options;
  options.rule = DegeneracyRule::probabilistic;
  options.mask = mask;
  return options;
}

constexpr double kTilt = 0.06;  // spurious information above the level along every direction

TEST(ProbabilisticDegeneracy, ACorridorLosesItsAxisUnderNoiseThatHidesItFromTheSigmaRule) {
  NoisyScan scan(kTilt, 1);
  scan.add_corridor();
  EXPECT_EQ(scan.analyse_naively(probabilistic()).degenerate_directions, 0);
  const Degeneracy degeneracy = scan.analyse(probabilistic());
  EXPECT_EQ(degeneracy.degenerate_directions, 1);
  EXPECT_GT(std::abs(degeneracy.directions(3, 5)), 0.99);
  EXPECT_EQ(degeneracy.kept[5], 0.0);
  EXPECT_EQ(degeneracy.kept[4], 1.0);
  const Degeneracy soft = scan.analyse(probabilistic(MaskKind::soft));
  EXPECT_LT(soft.kept[5], 0.1);
  EXPECT_GT(soft.kept[4], 0.999);
}

TEST(ProbabilisticDegeneracy, ASinglePlaneLosesThreeABoxNoneACylinderTwo) {
  NoisyScan plane(kTilt, 2);
  plane.add_wall(2, -0.5);
  EXPECT_EQ(plane.analyse(probabilistic()).degenerate_directions, 3);

  NoisyScan box(kTilt, 3);
  box.add_wall(0, 4.0, 3.0);
  box.add_wall(0, -4.0, 3.0);
  box.add_wall(1, -3.0, 3.0);
  box.add_wall(2, -1.0, 3.0);
  EXPECT_EQ(box.analyse(probabilistic()).degenerate_directions, 0);

  NoisyScan cylinder(0.01, 4);  // rotation about its axis requires small patches: their chords leave the vault
  for (int i = 0; i < 120; ++i) {
    for (int j = -10; j <= 10; ++j) {
      const double angle = 2.0 * M_PI * i / 120.0;
      const Vector3 normal(0.0, std::cos(angle), std::sin(angle));
      cylinder.add(normal, {3.0 * normal + 0.5 * j * Vector3::UnitX()});
    }
  }
  EXPECT_EQ(cylinder.analyse(probabilistic()).degenerate_directions, 2);
}

TEST(ProbabilisticDegeneracy, WithoutNoiseItIsTheSigmaRule) {
  NoisyScan scan(0.0, 5);
  scan.add_corridor();
  const Degeneracy degeneracy = scan.analyse(probabilistic(MaskKind::soft));
  const Degeneracy expected = scan.analyse_naively(probabilistic());
  EXPECT_EQ(degeneracy.degenerate_directions, expected.degenerate_directions);
  EXPECT_EQ(degeneracy.kept, expected.kept);
}

TEST(InformationNoise, MeanIsWhatCondensingCallsSpurious) {
  NoisyScan scan(kTilt, 6);
  scan.add_corridor();
  const Pose pose{Quaternion(so3::exp({0.3, -0.2, 0.8})), {1.0, 2.0, 3.0}};
  const Matrix6 directions = Matrix6::Identity() + 0.1 * Matrix6::Ones();
  const InformationNoise noise = information_noise(scan.correspondences(), pose, directions);
  const Matrix6 spurious = condense(scan.correspondences(), pose).spurious_information;
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(noise.mean[i], directions.col(i).dot(spurious * directions.col(i)), 1e-6 * noise.mean[i]);
  }
}

/// A corridor of 80 patches with an end wall that gives the axis `information` (1/m²).
NoisyScan short_corridor(double information, std::uint64_t seed) {
  constexpr float variance = 2.5e-5F;
  NoisyScan scan(0.05, seed);
  for (int side = -1; side <= 1; side += 2) {
    for (int i = 0; i < 40; ++i) {
      const double x = 0.2 * (i - 20);
      scan.add(Vector3::UnitY(), {Vector3(x, 2.0 * side, 0.3 * (i % 5)), Vector3(x + 0.1, 2.0 * side, 0.3 * (i % 5))},
               variance);
    }
  }
  for (int i = 0; i < 6; ++i) {
    scan.add(Vector3::UnitX(), {Vector3(6.0, -1.0 + 0.4 * i, 0.5 * (i % 2))}, static_cast<float>(6.0 / information));
  }
  return scan;
}

const Vector6 kAxis = Vector6::Unit(3);

TEST(InformationNoise, VarianceIsThatOfManyDraws) {
  for (const double information : {1.0, 6000.0}) {
    double sum = 0.0, squares = 0.0, predicted = 0.0;
    constexpr int draws = 2000;
    for (int i = 0; i < draws; ++i) {
      const NoisyScan scan = short_corridor(information, 100 + static_cast<std::uint64_t>(i));
      const double found = kAxis.dot(condense(scan.correspondences(), Pose{}).hessian(Pose{}) * kAxis);
      sum += found;
      squares += found * found;
      predicted += information_noise(scan.correspondences(), Pose{}, Matrix6::Identity()).variance[3] / draws;
    }
    const double variance = squares / draws - std::pow(sum / draws, 2);
    std::printf("axis with %.0f / m2: sigma of its information over %d draws %.0f, predicted %.0f\n", information,
                draws, std::sqrt(variance), std::sqrt(predicted));
    EXPECT_NEAR(std::sqrt(predicted / variance), 1.0, 0.1);
  }
}

TEST(ProbabilisticDegeneracy, StatedProbabilityIsTheFrequency) {
  // True values spread evenly around the level: of the scans that state p, a share p is beyond the level.
  DegeneracyOptions options = probabilistic(MaskKind::soft);
  options.max_sigma_m = 0.01;
  constexpr double level = 1e4;
  std::mt19937_64 generator(7);
  constexpr int bins = 5;
  std::array<int, bins> count{}, beyond{};
  std::array<double, bins> stated{};
  for (int i = 0; i < 5000; ++i) {
    const double truth = 2.0 * level * (static_cast<double>(generator() >> 11) * 0x1.0p-53);
    const Degeneracy degeneracy =
        short_corridor(std::max(truth, 1.0), 10000 + static_cast<std::uint64_t>(i)).analyse(options, 2.0, {0.0, 0.0});
    Eigen::Index axis = 0;
    degeneracy.directions.row(3).cwiseAbs().maxCoeff(&axis);
    const double p = degeneracy.kept[axis];
    const auto bin = static_cast<std::size_t>(std::min(bins - 1, static_cast<int>(bins * p)));
    ++count[bin];
    stated[bin] += p;
    if (truth > level) ++beyond[bin];
  }
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const double mean = stated[bin] / count[bin];
    const double frequency = static_cast<double>(beyond[bin]) / count[bin];
    std::printf("stated %.3f, found %.3f in %d scans\n", mean, frequency, count[bin]);
    EXPECT_GT(count[bin], 60);
    EXPECT_NEAR(frequency, mean, 0.1);  // three sigmas of the least bin's count
  }
}

}  // namespace
}  // namespace lodestone
