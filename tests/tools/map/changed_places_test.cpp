// Places where two maps differ after known changes of one of them.
#include "tools/map/changed_places.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace lodestone {
namespace {

/// Two maps of 150 x 100 nodes at 0.1 m, in two layers; the second map has `change` µT more along z.
MagneticDifference difference_by(const std::function<double(int layer, int row, int column)>& change) {
  const FieldGrid grid{0.1, {-5.0, 3.0}, 150, 100, {0.2, 0.6}};
  std::vector<Eigen::Vector4f> before;
  std::vector<Eigen::Vector4f> after;
  for (int layer = 0; layer < 2; ++layer) {
    for (int row = 0; row < grid.rows; ++row) {
      for (int column = 0; column < grid.columns; ++column) {
        before.emplace_back(18.0F, -4.0F, -44.0F, column == 100 ? NAN : 0.3F);  // a gap in the survey
        after.emplace_back(18.0F, -4.0F, -44.0F + static_cast<float>(change(layer, row, column)), 0.3F);
      }
    }
  }
  return compare_maps(MagneticMap(grid, before, 1.0), MagneticMap(grid, after, 1.0));
}

TEST(ChangedPlaces, AreTheConnectedStretchesAboveTheThreshold) {
  const auto change = [](int layer, int row, int column) {
    if (row >= 60 && row < 70 && column >= 60 && column < 80)
      return layer == 1 && row == 65 && column == 70 ? 20.0 : 8.0;
    if (row == 70 && column == 80) return 12.0;  // touches the place at a corner
    if (row == 10 && column > 90) return 15.0;   // cut by the gap
    return layer == 0 ? 1.0 : 0.0;
  };
  const MagneticDifference difference = difference_by(change);
  const std::vector<ChangedPlace> places = changed_places(difference, significance_of(difference), 5.0, 0.05);
  ASSERT_EQ(places.size(), 3U);
  EXPECT_NEAR(places[0].largest_ut, 20.0, 1e-4);
  EXPECT_LT((places[0].largest_at - Vector3(-5.0 + 7.0, 3.0 + 6.5, 0.6)).norm(), 1e-9);
  EXPECT_NEAR(places[0].area_m2, 201 * 0.01, 1e-9);
  EXPECT_NEAR(places[0].mean_ut, (199 * 8.0 + 20.0 + 12.0) / 201, 1e-3);
  const Eigen::Vector2d center((200 * 69.5 + 80.0) / 201, (200 * 64.5 + 70.0) / 201);
  EXPECT_LT((places[0].center - Eigen::Vector2d(-5.0, 3.0) - 0.1 * center).norm(), 1e-9);
  EXPECT_NEAR(places[1].area_m2 + places[2].area_m2, 58 * 0.01, 1e-9);
  EXPECT_NEAR(places[1].largest_ut, 15.0, 1e-4);
  EXPECT_TRUE(changed_places(difference, significance_of(difference), 1000.0, 0.05).empty());
  EXPECT_TRUE(changed_places({}, significance_of({}), 1.0, 0.05).empty());
  EXPECT_NEAR(places[0].sigma_ut, 0.3 * std::sqrt(2.0), 1e-6);
  EXPECT_LT(places[2].p_value, 1e-6);
}

}  // namespace
}  // namespace lodestone
