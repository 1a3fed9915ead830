// A map with few tiles in memory gives the same bits as the map that is wholly in memory.
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "core/magnetometer/field_tile_cache.h"
#include "core/magnetometer/magnetic_map.h"
#include "core/parallel.h"

namespace lodestone {
namespace {

/// Lanes of field through 40 x 33 m, with holes, two layers; hash noise, so that every node matters.
class Lanes final : public FieldNodes {
 public:
  static FieldGrid grid() { return {0.1, {-7.3, 4.1}, 401, 331, {0.1, 0.4}}; }

  static Eigen::Vector4f node(int layer, int row, int column) {
    const bool lane = column % 90 < 25 || row % 110 < 20;
    const std::uint32_t hash = (static_cast<std::uint32_t>(row) * 2654435761U) ^
                               (static_cast<std::uint32_t>(column) * 40503U + 7U * static_cast<std::uint32_t>(layer));
    if (!lane || hash % 97U == 0) return Eigen::Vector4f::Constant(std::numeric_limits<float>::quiet_NaN());
    const auto noise = [&](std::uint32_t shift) { return static_cast<float>((hash >> shift) % 1000U) * 1e-3F; };
    return {20.0F + noise(2), -3.0F + noise(5), -44.0F + noise(9), 0.2F + 0.3F * noise(12)};
  }

  bool read(int layer, int row, int column, int rows, int columns, Eigen::Vector4f* nodes) const override {
    bool any = false;
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j < columns; ++j, ++nodes) {
        *nodes = node(layer, row + i, column + j);
        any = any || nodes->allFinite();
      }
    }
    ++reads;
    return any;
  }

  mutable std::atomic<int> reads{0};
};

std::vector<Eigen::Vector4f> all_nodes() {
  const FieldGrid grid = Lanes::grid();
  std::vector<Eigen::Vector4f> nodes;
  for (int layer = 0; layer < 2; ++layer) {
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) nodes.push_back(Lanes::node(layer, row, column));
    }
  }
  return nodes;
}

bool same(const std::optional<FieldValue>& a, const std::optional<FieldValue>& b) {
  if (a.has_value() != b.has_value()) return false;
  return !a ||
         (std::memcmp(a->field_ut.data(), b->field_ut.data(), sizeof(double) * 3) == 0 &&
          std::memcmp(a->gradient.data(), b->gradient.data(), sizeof(double) * 9) == 0 && a->sigma_ut == b->sigma_ut);
}

std::vector<Vector3> tile_places(int count) {
  std::mt19937_64 generator(4);
  std::uniform_real_distribution<double> uniform(-0.02, 1.02);
  std::vector<Vector3> result;
  for (int i = 0; i < count; ++i)
    result.emplace_back(-7.3 + 40.0 * uniform(generator), 4.1 + 33.0 * uniform(generator), 0.6 * uniform(generator));
  return result;
}

class NoField final : public FieldNodes {
 public:
  bool read(int, int, int, int, int, Eigen::Vector4f*) const override { return ++reads, false; }
  mutable std::atomic<int> reads{0};
};

TEST(FieldTiles, WhatNobodyAsksForTakesNoMemory) {
  // With one bit a tile this would be 200 TB.
  const FieldGrid grid{0.1, {0.0, 0.0}, 1 << 28, 1 << 28, std::vector<double>(100, 0.0)};
  const auto source = std::make_shared<const NoField>();
  const FieldTileCache cache(grid, source, 0);
  for (int again = 0; again < 3; ++again) {
    EXPECT_EQ(cache.find(99, cache.rows() - 1, 5), nullptr);
    EXPECT_EQ(cache.find(99, cache.rows() - 1, 7), nullptr);
  }
  EXPECT_EQ(source->reads, 2);  // the tile without field is remembered
}

TEST(FieldTiles, MapsOfAFewTilesGiveTheBitsOfTheWhole) {
  const MagneticMap whole(Lanes::grid(), all_nodes(), 0.45);
  const auto source = std::make_shared<const Lanes>();
  const MagneticMap some(Lanes::grid(), source, 0.45, 0);
  int found = 0;
  for (const FieldInterpolation interpolation : {FieldInterpolation::bilinear, FieldInterpolation::bicubic}) {
    for (const Vector3& place : tile_places(600)) {
      const auto expected = whole.query(place, interpolation);
      ASSERT_TRUE(same(some.query(place, interpolation), expected)) << place.transpose();
      found += expected.has_value();
    }
  }
  EXPECT_GT(found, 200);
  EXPECT_GT(source->reads, 200);  // tiles were unloaded and loaded again
  const auto nodes = all_nodes();
  const auto back = some.nodes();
  ASSERT_EQ(back.size(), nodes.size());
  EXPECT_EQ(std::memcmp(back.data(), nodes.data(), nodes.size() * sizeof(nodes[0])), 0);
}

TEST(FieldTiles, TheSameOnAnyNumberOfThreads) {
  const MagneticMap whole(Lanes::grid(), all_nodes(), 0.45);
  const MagneticMap some(Lanes::grid(), std::make_shared<const Lanes>(), 0.45, 0);
  const std::vector<Vector3> all = tile_places(2000);
  std::atomic<int> different{0};
  parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) {
    if (!same(some.query(all[i], FieldInterpolation::bicubic), whole.query(all[i], FieldInterpolation::bicubic)))
      ++different;
  });
  EXPECT_EQ(different, 0);
}

TEST(FieldTiles, MemoryIsBoundedAlongADriveAndEachTileIsReadOnce) {
  // 2 km of lane along x: 313 tiles. Queries back and forth over a tile's edge read nothing again.
  FieldGrid grid{0.1, {0.0, 0.0}, 20001, 41, {0.1, 0.4}};
  const auto source = std::make_shared<const Lanes>();
  const std::size_t bytes = 40 * FieldTile::bytes();
  const MagneticMap map(grid, source, 0.45, bytes);
  for (double x = 0.0; x < 2000.0; x += 0.25)
    map.query({x + std::sin(10.0 * x), 0.5, 0.2}, FieldInterpolation::bicubic);
  EXPECT_LE(map.tiles().most_resident_bytes(), bytes);
  EXPECT_EQ(map.tiles().loads(), 2 * 313);
  EXPECT_EQ(source->reads, 2 * 313);
}

TEST(FieldTiles, WhatWasNotSurveyedTakesNoMemory) {
  struct Spot final : FieldNodes {
    bool read(int layer, int row, int column, int rows, int columns, Eigen::Vector4f* nodes) const override {
      if (row > 100 || column > 100) return false;
      std::fill_n(nodes, rows * columns, Eigen::Vector4f(1, 2, 3, 0.1F));
      return true;
    }
  };
  const FieldGrid grid{0.1, {0.0, 0.0}, 3001, 3001, {0.1}};
  const MagneticMap map(grid, std::make_shared<const Spot>(), 0.45, 1U << 30U);
  int nodes = 0;
  map.for_each_node([&](const Eigen::Vector4f&) { ++nodes; });
  EXPECT_GT(nodes, 10000);
  EXPECT_LE(map.tiles().most_resident_bytes(), 9 * FieldTile::bytes());
  EXPECT_FALSE(map.query({200.0, 200.0, 0.1}, FieldInterpolation::bicubic));
  EXPECT_TRUE(map.query({5.0, 5.0, 0.1}, FieldInterpolation::bicubic));
}

}  // namespace
}  // namespace lodestone
