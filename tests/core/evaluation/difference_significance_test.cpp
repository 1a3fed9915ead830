// Test whether two maps differ by more than their errors: the stated rate of false places, on fields drawn from the
// assumed distribution and on maps of surveys with pose errors; and moved steel.
#include "core/evaluation/difference_significance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/evaluation/stale_map.h"
#include "core/mapping/magnetic_map_builder.h"
#include "tests/core/mapping/drifting_survey.h"

namespace lodestone {
namespace {

using testing::drive_over;
using testing::DriveErrors;
using testing::SteelFloor;

double largest_chi_square(const MagneticDifference& difference, const DifferenceSignificance& significance,
                          Eigen::Vector2d* at = nullptr) {
  double largest = 0.0;
  for (const DifferencePiece& piece : difference.pieces) {
    for (int row = 0; row < piece.rows; ++row) {
      for (int column = 0; column < piece.columns; ++column) {
        const Eigen::Vector4f& node = piece.at(0, row, column);
        if (!std::isfinite(node[3]) || !(significance.chi_square(node) > largest)) continue;
        largest = significance.chi_square(node);
        if (at == nullptr) continue;
        *at = difference.grid.origin +
              difference.grid.resolution_m * Eigen::Vector2d(piece.column + column, piece.row + row);
      }
    }
  }
  return largest;
}

TEST(DifferenceSignificance, CriticalValueIsTheInverseOfThePValue) {
  DifferenceSignificance significance;
  significance.nodes = 1e5;
  significance.regions = 1.0;
  significance.half_edge = 60.0;
  significance.area = 400.0;
  double last = 0.0;
  for (const double level : {0.5, 0.05, 1e-3, 1e-9}) {
    const double critical = significance.critical(level);
    EXPECT_NEAR(significance.p_value(critical), level, 1e-9 + 1e-6 * level);
    EXPECT_GT(critical, last);
    last = critical;
  }
  // One node: the tail of χ² with three degrees of freedom.
  DifferenceSignificance one;
  one.nodes = one.regions = 1.0;
  EXPECT_NEAR(one.p_value(14.16), 0.0027, 1e-4);
  EXPECT_NEAR(one.p_value(14.16), chi_square_tail(14.16), 1e-12);
}

/// A map of a smooth Gaussian field of unit variance around (18, 2, -42) µT: correlation exp(-d²/2l²).
MagneticMap smooth_map(std::mt19937_64& generator, double length_m, const FieldGrid& grid) {
  constexpr int waves = 60;
  std::normal_distribution<double> normal;
  const auto uniform = [&] { return static_cast<double>(generator() >> 11U) * 0x1.0p-53; };
  std::vector<Eigen::Vector4f> nodes(static_cast<std::size_t>(grid.columns) * grid.rows, {18.0F, 2.0F, -42.0F, 1.0F});
  for (int k = 0; k < 3; ++k) {
    std::vector<Eigen::Array4d> parts;
    for (int wave = 0; wave < waves; ++wave) {
      const double x = normal(generator) / length_m, y = normal(generator) / length_m;
      const double amplitude = normal(generator) * std::sqrt(2.0 / waves);
      parts.emplace_back(x, y, amplitude, 2.0 * std::numbers::pi * uniform());
    }
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        double value = 0.0;
        for (const Eigen::Array4d& part : parts) {
          value += part[2] * std::cos(grid.resolution_m * (part[0] * column + part[1] * row) + part[3]);
        }
        nodes[static_cast<std::size_t>(row) * grid.columns + column][k] += static_cast<float>(value);
      }
    }
  }
  return {grid, nodes, 10.0};
}

TEST(DifferenceSignificance, KeepsTheStatedRateOnSmoothFields) {
  constexpr int pairs = 400;
  std::mt19937_64 generator(11);
  for (const auto& [length_m, columns] : {std::pair{0.3, 60}, std::pair{0.15, 90}}) {
    const FieldGrid grid{0.1, {0.0, 0.0}, columns, 30, {0.1}};
    std::array<int, 2> found{};
    for (int pair = 0; pair < pairs; ++pair) {
      const MagneticDifference difference =
          compare_maps(smooth_map(generator, length_m, grid), smooth_map(generator, length_m, grid));
      const DifferenceSignificance significance = significance_of(difference);
      const double p = significance.p_value(largest_chi_square(difference, significance));
      found[0] += p <= 0.05;
      found[1] += p <= 0.2;
    }
    const double at_5 = 100.0 * found[0] / pairs, at_20 = 100.0 * found[1] / pairs;
    std::printf("length %.2f m: false places in %.1f %% of the pairs at 5 %%, %.1f %% at 20 %%\n", length_m, at_5,
                at_20);
    EXPECT_GT(at_5, 1.0);
    EXPECT_LT(at_5, 8.0);
    EXPECT_GT(at_20, 7.0);
    EXPECT_LT(at_20, 26.0);
  }
}

TEST(DifferenceSignificance, FindsMovedSteelAndNoFalsePlacesBetweenSurveysWhosePosesErr) {
  constexpr int surveys = 6;
  int pairs = 0, false_places = 0, naive = 0, moved = 0, found = 0;
  for (const std::uint64_t seed : {1U, 2U}) {
    const SteelFloor floor(seed);
    SteelFloor changed(seed);  // a steel shelf was added
    for (int i = 0; i < 3; ++i) changed.add({2.4 + 0.2 * i, 1.0, -0.5}, {0.5, 0.5, 2.0});
    std::vector<MagneticMap> maps;
    for (int i = 0; i < surveys; ++i) {
      maps.push_back(build_magnetic_map(drive_over(floor, 100 + static_cast<std::uint64_t>(i), DriveErrors{}), {}).map);
    }
    for (int i = 0; i < surveys; ++i) {
      for (int j = i + 1; j < surveys; ++j) {
        const MagneticDifference difference = compare_maps(maps[i], maps[j]);
        const DifferenceSignificance significance = significance_of(difference);
        const double largest = largest_chi_square(difference, significance);
        ++pairs;
        false_places += significance.p_value(largest) <= 0.05;
        naive += chi_square_tail(largest) <= 0.05;
      }
    }
    for (int i = 0; i < 3; ++i) {
      const auto survey = drive_over(changed, 200 + static_cast<std::uint64_t>(i), DriveErrors{});
      const MagneticDifference difference = compare_maps(maps[i], build_magnetic_map(survey, {}).map);
      const DifferenceSignificance significance = significance_of(difference);
      Eigen::Vector2d at(0.0, 0.0);
      const double p = significance.p_value(largest_chi_square(difference, significance, &at));
      ++moved;
      found += p < 0.01 && (at - Eigen::Vector2d(2.6, 1.0)).norm() < 0.8;
    }
  }
  std::printf("%d pairs of unchanged floors: %d with a false place at 5 %% (%d by the test of a single node)\n", pairs,
              false_places, naive);
  EXPECT_LE(false_places, 3);  // of 30
  EXPECT_GT(naive, 3 + 2 * false_places);
  EXPECT_EQ(found, moved);
}

TEST(DifferenceSignificance, AnOffsetOfAllMagnetometersIsNoPlace) {
  std::mt19937_64 generator(12);
  const FieldGrid grid{0.1, {0.0, 0.0}, 60, 30, {0.1}};
  const MagneticMap first = smooth_map(generator, 0.3, grid);
  std::vector<Eigen::Vector4f> nodes = first.nodes();
  for (Eigen::Vector4f& node : nodes) node.head<3>() += Eigen::Vector3f(5.0F, -3.0F, 8.0F);
  const MagneticDifference difference = compare_maps(first, MagneticMap(grid, nodes, 10.0));
  const DifferenceSignificance significance = significance_of(difference);
  EXPECT_LT((significance.common_ut - Vector3(5.0, -3.0, 8.0)).norm(), 1e-4);
  EXPECT_EQ(significance.p_value(largest_chi_square(difference, significance)), 1.0);
}

}  // namespace
}  // namespace lodestone
