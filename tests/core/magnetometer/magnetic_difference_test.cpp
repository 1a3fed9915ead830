// The difference of two maps of dipole fields against its closed form.
#include "core/magnetometer/magnetic_difference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

namespace lodestone {
namespace {

/// µT of a dipole of moment m (A m²) at `from`: μ0/4π (3 (m·u) u − m) / r³.
Vector3 dipole(const Vector3& position, const Vector3& from, const Vector3& moment) {
  const Vector3 to = position - from;
  const Vector3 unit = to.normalized();
  return 0.1 * (3.0 * moment.dot(unit) * unit - moment) / std::pow(to.norm(), 3);
}

const Vector3 earth(18.0, -4.0, -44.0);

Vector3 before(const Vector3& p) {
  return earth + dipole(p, {-2.0, 1.0, -0.7}, {20, -10, 60});
}

/// The change: two more dipoles, the right one twice as strong.
Vector3 change(const Vector3& p) {
  return dipole(p, {2.03, -0.51, -0.6}, {0, 0, 50}) + dipole(p, {-2.5, -1.0, -0.6}, {0, 0, 25});
}

Vector3 after(const Vector3& p) {
  return before(p) + change(p);
}

Vector3 place(const FieldGrid& grid, int layer, int row, int column) {
  return {grid.origin.x() + grid.resolution_m * column, grid.origin.y() + grid.resolution_m * row,
          grid.heights_m[layer]};
}

MagneticMap make_map(
    const FieldGrid& grid, const std::function<Vector3(const Vector3&)>& field, float sigma,
    const std::function<bool(const Vector3&)>& surveyed = [](const Vector3&) { return true; }) {
  std::vector<Eigen::Vector4f> nodes;
  for (int layer = 0; layer < static_cast<int>(grid.heights_m.size()); ++layer) {
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const Vector3 at = place(grid, layer, row, column);
        Eigen::Vector4f node = Eigen::Vector4f::Constant(std::numeric_limits<float>::quiet_NaN());
        if (surveyed(at)) node << field(at).cast<float>(), sigma;
        nodes.push_back(node);
      }
    }
  }
  return {grid, nodes, 1.0};
}

const FieldGrid coarse{0.1, {-5.0, -3.0}, 101, 61, {0.2}};
const FieldGrid fine{0.07, {-5.51, -3.33}, 160, 101, {0.2}};  // covers the coarse grid; its nodes lie elsewhere

TEST(MagneticDifference, IsTheFieldOfWhatCame) {
  const MagneticDifference difference = compare_maps(make_map(coarse, before, 0.3F), make_map(fine, after, 0.4F));
  double sum = 0.0, squares = 0.0, largest = 0.0, above = 0.0;
  Vector3 largest_at = Vector3::Zero();
  for (int row = 0; row < coarse.rows; ++row) {
    for (int column = 0; column < coarse.columns; ++column) {
      const Vector3 at = place(coarse, 0, row, column);
      const double size = change(at).norm();
      sum += size;
      squares += size * size;
      above += size > 1.5;
      if (size > largest) {
        largest = size;
        largest_at = at;
      }
    }
  }
  ASSERT_GT(largest, 10.0);
  const double count = 101.0 * 61.0;
  // Error of bicubic interpolation at 7 cm, dipoles 80 cm below: some 1e-2 µT right above them, far less elsewhere.
  EXPECT_NEAR(difference.largest_ut, largest, 0.03);
  EXPECT_NEAR((difference.largest_at - largest_at).norm(), 0.0, 1e-9);
  EXPECT_NEAR(difference.mean_ut, sum / count, 2e-3);
  EXPECT_NEAR(difference.rms_ut, std::sqrt(squares / count), 2e-3);
  EXPECT_NEAR(difference.normalized_rms, std::sqrt(squares / count / 3.0) / 0.5, 5e-3);
  EXPECT_NEAR(difference.share_above_three_sigma, above / count, 2e-3);
  EXPECT_EQ(difference.nodes, 101 * 61);
  EXPECT_NEAR(difference.compared_m2, count * 0.01, 1e-9);
  EXPECT_EQ(difference.only_first_m2, 0.0);
  EXPECT_NEAR(difference.only_second_m2, 160 * 101 * 0.0049 - 10.0 * 6.0, 0.6);
  for (const DifferencePiece& piece : difference.pieces) {
    for (int row = 0; row < piece.rows; ++row) {
      for (int column = 0; column < piece.columns; ++column) {
        const Vector3 expected = change(place(coarse, 0, piece.row + row, piece.column + column));
        ASSERT_LT((piece.at(0, row, column).head<3>().cast<double>() - expected).norm(), 0.03);
      }
    }
  }
}

TEST(MagneticDifference, TheOtherWayRoundTurnsTheSignOnly) {
  const MagneticMap a = make_map(coarse, before, 0.3F);
  const MagneticMap b = make_map(coarse, after, 0.4F);
  const MagneticDifference forth = compare_maps(a, b);
  const MagneticDifference back = compare_maps(b, a);
  EXPECT_NEAR(forth.largest_ut, back.largest_ut, 1e-4);
  EXPECT_LT((forth.pieces[0].at(0, 3, 5) + back.pieces[0].at(0, 3, 5)).head<3>().norm(), 1e-4F);
  const MagneticDifference none = compare_maps(a, a);
  EXPECT_EQ(none.largest_ut, 0.0);
  EXPECT_EQ(none.share_above_three_sigma, 0.0);
}

TEST(MagneticDifference, WhatOneMapAloneCoversIsCountedApart) {
  const MagneticDifference difference =
      compare_maps(make_map(coarse, before, 0.3F, [](const Vector3& p) { return p.x() < 1.01; }),
                   make_map(coarse, after, 0.3F, [](const Vector3& p) { return p.x() > -2.01; }));
  EXPECT_NEAR(difference.compared_m2, 31 * 61 * 0.01, 1e-9);
  EXPECT_NEAR(difference.only_first_m2, 30 * 61 * 0.01, 1e-9);
  EXPECT_NEAR(difference.only_second_m2, 40 * 61 * 0.01, 1e-9);
  const MagneticDifference apart =
      compare_maps(make_map(coarse, before, 0.3F), make_map({0.1, {50.0, 50.0}, 20, 20, {0.2}}, after, 0.3F));
  EXPECT_EQ(apart.nodes, 0);
  EXPECT_EQ(apart.compared_m2, 0.0);
}

TEST(MagneticDifference, LayersAreComparedAtTheirHeights) {
  FieldGrid layered = coarse;
  layered.heights_m = {0.2, 0.6};
  FieldGrid other = fine;
  other.heights_m = {0.1, 0.2, 0.4, 0.6};
  const MagneticDifference difference = compare_maps(make_map(layered, before, 0.3F), make_map(other, after, 0.3F));
  EXPECT_EQ(difference.nodes, 2 * 101 * 61);
  EXPECT_NEAR(difference.compared_m2, 101 * 61 * 0.01, 1e-9);
  const DifferencePiece& piece = difference.pieces.front();
  for (int layer = 0; layer < 2; ++layer) {
    const Vector3 expected = change(place(layered, layer, piece.row + 20, piece.column + 30));
    EXPECT_LT((piece.at(layer, 20, 30).head<3>().cast<double>() - expected).norm(), 0.01);
  }
  // The change is larger nearer to the steel.
  EXPECT_EQ(difference.largest_at.z(), 0.2);
}

}  // namespace
}  // namespace lodestone
