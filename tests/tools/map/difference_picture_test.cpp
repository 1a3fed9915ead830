#include "tools/map/difference_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/evaluation/difference_significance.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Two maps of 60 x 40 m; the second has 20 and 12 µT more along z at two places.
MagneticDifference two_changes() {
  const FieldGrid grid{0.5, {100.0, 200.0}, 121, 81, {0.2}};
  std::vector<Eigen::Vector4f> before;
  std::vector<Eigen::Vector4f> after;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const bool strong = row >= 40 && row < 44 && column >= 30 && column < 34;
      const bool weak = row >= 10 && row < 12 && column >= 90 && column < 93;
      const bool peak = row == 41 && column == 31;
      const float change = peak ? 40.0F : strong ? 20.0F : weak ? 12.0F : 0.0F;
      before.emplace_back(18.0F, -4.0F, -44.0F, 0.3F);
      after.emplace_back(18.0F, -4.0F, -44.0F + change, 0.3F);
    }
  }
  return compare_maps(MagneticMap(grid, before, 1.0), MagneticMap(grid, after, 1.0));
}

TEST(DifferencePicture, NumbersTheLargestPlaceAndMarksACutScale) {
  const TemporaryFolder folder;
  const MagneticDifference difference = two_changes();
  const std::vector<ChangedPlace> places = changed_places(difference, significance_of(difference), 5.0, 0.05);
  ASSERT_EQ(places.size(), 2U);
  draw_difference_picture(folder / "change.svg", difference, places, "change");
  const std::string svg = content_of(folder / "change.svg");
  EXPECT_THAT(svg, HasSubstr(">1: 40.0 µT at 115.50, 220.50 m<"));
  EXPECT_THAT(svg, HasSubstr(">2<"));
  EXPECT_THAT(svg, Not(HasSubstr(">3<")));
  // 22 of 9,801 nodes changed: the scale ends at the 99.5 % quantile, far below 40 µT.
  EXPECT_THAT(svg, HasSubstr(">≥ 0.1<"));
}

TEST(DifferencePicture, ALongTitleFitsAndAPlaceWithinTheRingHasItsNumberThere) {
  const TemporaryFolder folder;
  const MagneticDifference difference = two_changes();
  std::vector<ChangedPlace> places = changed_places(difference, significance_of(difference), 5.0, 0.05);
  ASSERT_EQ(places.size(), 2U);
  places.front().largest_at.x() += 0.4;  // 8 logical pixels at 20 pixels a metre
  draw_difference_picture(folder / "change.svg", difference, places, std::string(300, 'm'));
  const std::string svg = content_of(folder / "change.svg");
  EXPECT_THAT(svg, HasSubstr(">1: 40.0 µT at 115.50, 220.50 m<"));
  EXPECT_THAT(svg, Not(HasSubstr(">1<")));
  const std::size_t size = svg.find("font-size=\"") + 11;
  EXPECT_LT(std::stod(svg.substr(size)), 6.0) << "300 letters on a sheet of 1,420";
}

TEST(DifferencePicture, NumbersEachPlaceIfTheRingIsElsewhere) {
  const TemporaryFolder folder;
  const MagneticDifference difference = two_changes();
  std::vector<ChangedPlace> places = changed_places(difference, significance_of(difference), 5.0, 0.05);
  ASSERT_EQ(places.size(), 2U);
  places.erase(places.begin());
  draw_difference_picture(folder / "change.svg", difference, places, "change");
  const std::string svg = content_of(folder / "change.svg");
  EXPECT_THAT(svg, HasSubstr(">1<"));
  EXPECT_THAT(svg, HasSubstr(">40.0 µT at 115.50, 220.50 m<"));
}

}  // namespace
}  // namespace lodestone
