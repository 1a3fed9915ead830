#include "core/magnetometer/magnetic_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "core/magnetometer/field_residual.h"

namespace lodestone {
namespace {

constexpr FieldInterpolation both[] = {FieldInterpolation::bilinear, FieldInterpolation::bicubic};

FieldGrid test_grid(std::vector<double> heights = {0.3}) {
  FieldGrid grid;
  grid.resolution_m = 0.1;
  grid.origin = {-1.5, 2.25};
  grid.columns = 31;
  grid.rows = 23;
  grid.heights_m = std::move(heights);
  return grid;
}

Vector3 node_position(const FieldGrid& grid, int layer, int row, int column) {
  return {grid.origin.x() + grid.resolution_m * column, grid.origin.y() + grid.resolution_m * row,
          grid.heights_m[layer]};
}

std::vector<Eigen::Vector4f> sample(const FieldGrid& grid, const std::function<Vector3(const Vector3&)>& field,
                                    const std::function<double(const Vector3&)>& sigma) {
  std::vector<Eigen::Vector4f> nodes;
  for (int layer = 0; layer < static_cast<int>(grid.heights_m.size()); ++layer) {
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        const Vector3 position = node_position(grid, layer, row, column);
        Eigen::Vector4f node;
        node << field(position).cast<float>(), static_cast<float>(sigma(position));
        nodes.push_back(node);
      }
    }
  }
  return nodes;
}

Vector3 wavy(const Vector3& p) {
  return {20.0 + 5.0 * std::sin(3.0 * p.x()) * std::cos(2.0 * p.y()) + 4.0 * p.z(),
          -4.0 + 3.0 * std::cos(4.0 * p.x() + p.y()), -45.0 + 6.0 * std::sin(2.0 * p.y()) * (1.0 + p.z() * p.z())};
}

double half(const Vector3&) {
  return 0.5;
}

/// A uniform position strictly inside the grid.
Vector3 inside(const FieldGrid& grid, std::mt19937_64& generator) {
  const auto uniform = [&] { return static_cast<double>(generator() >> 11) * 0x1.0p-53; };
  return {grid.origin.x() + grid.resolution_m * (grid.columns - 1) * (0.001 + 0.998 * uniform()),
          grid.origin.y() + grid.resolution_m * (grid.rows - 1) * (0.001 + 0.998 * uniform()),
          grid.heights_m.front() - 0.2 + (grid.heights_m.back() - grid.heights_m.front() + 0.4) * uniform()};
}

TEST(MagneticMapTest, GradientIsTheDerivativeOfTheInterpolation) {
  for (const auto& heights : {std::vector<double>{0.3}, std::vector<double>{0.1, 0.4, 1.0}}) {
    const FieldGrid grid = test_grid(heights);
    const MagneticMap map(grid, sample(grid, wavy, half), 2.0);
    std::mt19937_64 generator(7);
    const double step = 1e-6;
    for (const FieldInterpolation interpolation : both) {
      int checked = 0;
      for (int i = 0; i < 5000; ++i) {
        const Vector3 position = inside(grid, generator);
        const auto value = map.query(position, interpolation);
        ASSERT_TRUE(value);
        // Differences across a kink (a bilinear cell's edge, a layer) are not comparable with a derivative.
        const auto near_kink = [&](double coordinate) { return std::abs(coordinate - std::round(coordinate)) < 1e-4; };
        bool skip = near_kink((position.x() - grid.origin.x()) / grid.resolution_m) ||
                    near_kink((position.y() - grid.origin.y()) / grid.resolution_m);
        for (const double height : heights) skip = skip || std::abs(position.z() - height) < 1e-5;
        if (skip) continue;
        ++checked;
        for (int axis = 0; axis < 3; ++axis) {
          const Vector3 delta = step * Vector3::Unit(axis);
          const Vector3 numeric = (map.query(position + delta, interpolation)->field_ut -
                                   map.query(position - delta, interpolation)->field_ut) /
                                  (2.0 * step);
          ASSERT_LT((numeric - value->gradient.col(axis)).norm(), 1e-5) << position.transpose() << " axis " << axis;
        }
      }
      EXPECT_GT(checked, 4900);
    }
  }
}

TEST(MagneticMapTest, ReproducesNodesExactly) {
  const FieldGrid grid = test_grid({0.0, 0.5});
  const auto nodes = sample(grid, wavy, half);
  const MagneticMap map(grid, nodes, 2.0);
  std::size_t index = 0;
  for (int layer = 0; layer < 2; ++layer) {
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column, ++index) {
        for (const FieldInterpolation interpolation : both) {
          const auto value = map.query(node_position(grid, layer, row, column), interpolation);
          ASSERT_TRUE(value);
          EXPECT_LT((value->field_ut - nodes[index].head<3>().cast<double>()).norm(), 1e-10);
          EXPECT_NEAR(value->sigma_ut, 0.5, 1e-12);
        }
      }
    }
  }
  EXPECT_EQ(map.nodes(), nodes);
}

TEST(MagneticMapTest, ReproducesLinearFieldsUpToTheEdge) {
  Matrix3 slope;
  slope << 4, -8, 2, 1, 16, -4, 0.5, -2, 8;  // powers of two: the nodes' floats are nearly exact
  const auto linear = [&](const Vector3& p) -> Vector3 { return Vector3(16, -8, -32) + slope * p; };
  const FieldGrid grid = test_grid({0.25, 0.5});
  const MagneticMap map(grid, sample(grid, linear, half), 2.0);
  std::mt19937_64 generator(8);
  for (int i = 0; i < 2000; ++i) {
    Vector3 position = inside(grid, generator);
    position.z() = std::clamp(position.z(), 0.26, 0.49);
    for (const FieldInterpolation interpolation : both) {
      const auto value = map.query(position, interpolation);
      ASSERT_TRUE(value);
      EXPECT_LT((value->field_ut - linear(position)).norm(), 2e-5);
      EXPECT_LT((value->gradient - slope).norm(), 1e-3);
    }
  }
}

TEST(MagneticMapTest, BicubicHasAContinuousGradientAcrossCellsAlsoAtHoles) {
  const FieldGrid grid = test_grid();
  auto nodes = sample(grid, wavy, half);
  for (int row = 8; row < 11; ++row) {
    for (int column = 12; column < 16; ++column) nodes[row * grid.columns + column].setConstant(std::nanf(""));
  }
  const MagneticMap map(grid, nodes, 2.0);
  std::mt19937_64 generator(9);
  int compared = 0;
  for (int i = 0; i < 5000; ++i) {
    Vector3 position = inside(grid, generator);
    const int axis = i % 2;  // move to an edge between two cells
    double& coordinate = position[axis];
    coordinate =
        grid.origin[axis] + grid.resolution_m * std::round((coordinate - grid.origin[axis]) / grid.resolution_m);
    const Vector3 step = 1e-9 * Vector3::Unit(axis);
    const auto before = map.query(position - step, FieldInterpolation::bicubic);
    const auto after = map.query(position + step, FieldInterpolation::bicubic);
    if (!before || !after) continue;
    ++compared;
    EXPECT_LT((before->field_ut - after->field_ut).norm(), 1e-6);
    EXPECT_LT((before->gradient - after->gradient).norm(), 1e-4);
  }
  EXPECT_GT(compared, 4000);
}

TEST(MagneticMapTest, RefusesWhereThereIsNoField) {
  const FieldGrid grid = test_grid();
  auto nodes = sample(grid, wavy, [](const Vector3& p) { return p.x() > 0.55 ? 3.0 : 0.5; });
  nodes[5 * grid.columns + 4].setConstant(std::nanf(""));
  const MagneticMap map(grid, nodes, 1.0);
  const double nan = std::nan("");
  for (const FieldInterpolation interpolation : both) {
    EXPECT_FALSE(map.query({-1.51, 3.0, 0.3}, interpolation));
    EXPECT_FALSE(map.query({1.51, 3.0, 0.3}, interpolation));
    EXPECT_FALSE(map.query({0.0, 2.24, 0.3}, interpolation));
    EXPECT_FALSE(map.query({0.0, 4.46, 0.3}, interpolation));
    EXPECT_FALSE(map.query({nan, 3.0, 0.3}, interpolation));
    EXPECT_FALSE(map.query({0.0, nan, 0.3}, interpolation));
    EXPECT_FALSE(map.query({1e30, 3.0, 0.3}, interpolation));
    EXPECT_FALSE(map.query({1.0, 3.0, 0.3}, interpolation));  // σ over the limit
    // Each of the four cells at the hole, and no others.
    EXPECT_FALSE(map.query({-1.5 + 0.45, 2.25 + 0.45, 0.3}, interpolation));
    EXPECT_FALSE(map.query({-1.5 + 0.35, 2.25 + 0.55, 0.3}, interpolation));
    EXPECT_TRUE(map.query({-1.5 + 0.55, 2.25 + 0.45, 0.3}, interpolation));
    EXPECT_TRUE(map.query({-1.5 + 0.45, 2.25 + 0.65, 0.3}, interpolation));
    EXPECT_TRUE(map.query({-1.5, 2.25, 0.3}, interpolation));  // the grid's corner itself
  }
}

TEST(MagneticMapTest, HoldsTheNearestLayerOutsideTheHeights) {
  const FieldGrid grid = test_grid({0.1, 0.4});
  const MagneticMap map(grid, sample(grid, wavy, half), 2.0);
  const auto below = map.query({0.0, 3.0, -5.0}, FieldInterpolation::bicubic);
  const auto lowest = map.query({0.0, 3.0, 0.1}, FieldInterpolation::bicubic);
  ASSERT_TRUE(below && lowest);
  EXPECT_LT((below->field_ut - lowest->field_ut).norm(), 1e-12);
  EXPECT_EQ(below->gradient.col(2).norm(), 0.0);
}

TEST(MagneticMapTest, RefusesSizesThatDisagree) {
  FieldGrid grid = test_grid();
  EXPECT_THROW(MagneticMap(grid, std::vector<Eigen::Vector4f>(5), 1.0), std::invalid_argument);
  grid.heights_m = {0.4, 0.4};
  EXPECT_THROW(MagneticMap(grid, std::vector<Eigen::Vector4f>(2 * 31 * 23), 1.0), std::invalid_argument);
  grid = test_grid();
  grid.columns = 1;
  EXPECT_THROW(MagneticMap(grid, std::vector<Eigen::Vector4f>(23), 1.0), std::invalid_argument);
}

TEST(FieldResidualTest, JacobianMatchesDifferences) {
  const FieldGrid grid = test_grid({0.0, 1.0});
  const MagneticMap map(grid, sample(grid, wavy, half), 2.0);
  std::mt19937_64 generator(11);
  std::normal_distribution<double> normal;
  const auto random = [&](double scale) -> Vector3 {
    return scale * Vector3(normal(generator), normal(generator), normal(generator));
  };
  for (int i = 0; i < 500; ++i) {
    const Pose T_map_imu{so3::exp(random(1.0)), Vector3(0.0, 3.3, 0.5) + random(0.05)};
    const Pose T_imu_mag{so3::exp(random(1.0)), random(0.15)};
    const Vector3 measured = random(40.0);
    const auto residual = [&](const Pose& pose, FieldInterpolation interpolation) {
      return field_residual(pose, T_imu_mag, measured, *map.query(pose * T_imu_mag.position, interpolation));
    };
    const FieldResidual at = residual(T_map_imu, FieldInterpolation::bicubic);
    const double step = 1e-6;
    for (int k = 0; k < 6; ++k) {
      const Vector6 delta = step * Vector6::Unit(k);
      const Vector3 numeric = (residual(T_map_imu.boxplus(delta), FieldInterpolation::bicubic).residual_ut -
                               residual(T_map_imu.boxplus(-delta), FieldInterpolation::bicubic).residual_ut) /
                              (2.0 * step);
      EXPECT_LT((numeric - at.jacobian.col(k)).norm(), 1e-6 * (1.0 + at.jacobian.norm())) << k;
    }
  }
}

}  // namespace
}  // namespace lodestone
