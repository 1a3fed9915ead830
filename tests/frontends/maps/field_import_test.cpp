#include "frontends/maps/field_import.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>

#include "core/error.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::message_of;
using ::lodestone::testing::TemporaryFolder;
using ::lodestone::testing::write_text;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// A field in µT that differs between all positions.
Vector3 field_at(double x, double y, double z) {
  return {20.0 + x, 5.0 * y - 1.0, -40.0 + 3.0 * z + 0.1 * x * y};
}

/// Format of a table.
struct Style {
  std::string header = "x,y,z,Bx,By,Bz";
  std::string separator = ",";
  double per_ut = 1.0;
  double step_m = 0.1;
  std::vector<double> heights_m{0.12};
  int digits = 4;
  bool shuffled = true, with_z = true, with_sigma = false;
  std::function<bool(int, int)> has = [](int, int) { return true; };
};

/// 7 x 5 nodes, from (3, -2) on.
std::string table(const Style& style) {
  std::vector<std::string> lines;
  for (const double z : style.heights_m) {
    for (int row = 0; row < 5; ++row) {
      for (int column = 0; column < 7; ++column) {
        if (!style.has(row, column)) continue;
        const double x = 3.0 + style.step_m * column, y = -2.0 + style.step_m * row;
        const Vector3 field = field_at(x, y, z) * style.per_ut;
        std::vector<std::string> cells{fmt::format("{:.{}f}", x, style.digits),
                                       fmt::format("{:.{}f}", y, style.digits)};
        if (style.with_z) cells.push_back(fmt::format("{}", z));
        for (int axis = 0; axis < 3; ++axis) cells.push_back(fmt::format("{:.9g}", field[axis]));
        if (style.with_sigma) cells.push_back(fmt::format("{:.9g}", (0.1 + 0.01 * row) * style.per_ut));
        lines.push_back(fmt::format("{}\n", fmt::join(cells, style.separator)));
      }
    }
  }
  if (style.shuffled) std::shuffle(lines.begin(), lines.end(), std::mt19937(1));
  return (style.header.empty() ? "" : style.header + "\n") + fmt::format("{}", fmt::join(lines, ""));
}

class FieldImport : public ::testing::Test {
 protected:
  ImportedField import(const std::string& text, const FieldImportOptions& options = {}) {
    write_text(path_, text);
    return import_field_table(path_, options);
  }
  std::string error(const std::string& text, const FieldImportOptions& options = {}) {
    write_text(path_, text);
    return message_of<InputError>([&] { import_field_table(path_, options); });
  }
  static void expect_field(const ImportedField& imported, const Style& style) {
    const FieldGrid& grid = imported.map.grid();
    ASSERT_EQ(grid.columns, 7);
    ASSERT_EQ(grid.rows, 5);
    ASSERT_EQ(grid.heights_m, style.heights_m);
    EXPECT_NEAR(grid.resolution_m, style.step_m, 1e-3);
    for (const double z : style.heights_m) {
      for (int row = 0; row < 5; ++row) {
        for (int column = 0; column < 7; ++column) {
          // Just inside the border of the map: the interpolation is continuous there.
          const Vector3 at(grid.origin.x() + grid.resolution_m * std::clamp<double>(column, 1e-6, 6 - 1e-6),
                           grid.origin.y() + grid.resolution_m * std::clamp<double>(row, 1e-6, 4 - 1e-6), z);
          const auto value = imported.map.query(at, FieldInterpolation::bilinear);
          ASSERT_TRUE(value.has_value());
          EXPECT_LT((value->field_ut - field_at(3.0 + style.step_m * column, -2.0 + style.step_m * row, z)).norm(),
                    1e-4);
          EXPECT_NEAR(value->sigma_ut, style.with_sigma ? 0.1 + 0.01 * row : 1.0, 1e-5);
        }
      }
    }
  }

  TemporaryFolder folder_;
  std::string path_ = folder_ / "field.csv";
};

TEST_F(FieldImport, AnyOrderSeparatorHeaderAndUnitGivesTheSameMap) {
  const std::pair<const char*, double> units[] = {{"T", 1e-6}, {"uT", 1.0}, {"nT", 1e3}, {"gauss", 1e-2}, {"mG", 10.0}};
  for (const std::string separator : {",", ";", "\t", " ", "  "}) {
    for (const auto& [name, per_ut] : units) {
      for (const bool named : {true, false}) {
        SCOPED_TRACE(fmt::format("'{}' {} {}", separator, name, named));
        Style style;
        style.separator = separator;
        style.per_ut = per_ut;
        style.header = named ? fmt::format("x_m{0}y_m{0}z_m{0}B_x_{1}{0}B_y_{1}{0}B_z_{1}", separator, name) : "";
        const ImportedField imported = import(table(style));
        expect_field(imported, style);
        EXPECT_EQ(imported.unit_from_size, !named);
        EXPECT_EQ(imported.nodes, 35);
        EXPECT_EQ(imported.in_cells, 35);
      }
    }
  }
}

TEST_F(FieldImport, HeadersAsPeopleWriteThem) {
  for (const std::string header : {"X,Y,Z,BX,BY,BZ", "# x, y, z, Bx, By, Bz", "pos_x,pos_y,pos_z,mag_x,mag_y,mag_z",
                                   "x [m],y [m],z [m],Bx (µT),By (µT),Bz (µT)", "x,y,height,mx,my,mz",
                                   "\xEF\xBB\xBFx,y,z,field_x_ut,field_y_ut,field_z_ut"}) {
    SCOPED_TRACE(header);
    Style style;
    style.header = header;
    expect_field(import(table(style)), style);
  }
  // Any order, further columns, sigma.
  write_text(path_, "");
  std::string text = "id,Bz,By,Bx,sigma_ut,y,x\n";
  for (int i = 0; i < 35; ++i) {
    const double x = 3.0 + 0.1 * (i % 7), y = -2.0 + 0.1 * (i / 7);
    const Vector3 field = field_at(x, y, 0.5);
    text += fmt::format("{},{:.9g},{:.9g},{:.9g},{},{:.3f},{:.3f}\n", i, field.z(), field.y(), field.x(),
                        0.1 + 0.01 * (i / 7), y, x);
  }
  Style style;
  style.heights_m = {0.5};
  style.with_sigma = true;
  FieldImportOptions options;
  options.height_m = 0.5;
  expect_field(import(text, options), style);
}

TEST_F(FieldImport, RoundedPositionsAndLayers) {
  Style style;
  style.step_m = 1.0 / 3.0;
  style.digits = 2;
  style.heights_m = {0.1, 0.35, 1.0};
  style.with_sigma = true;
  style.header.clear();
  expect_field(import(table(style)), style);
}

TEST_F(FieldImport, PositionsThatWereMeasuredScatterAboutTheirNodes) {
  Style style;
  style.step_m = 0.2;
  style.heights_m = {0.1, 0.6};
  std::mt19937 random(5);
  for (const double scatter_m : {0.001, 0.004}) {
    std::uniform_real_distribution<double> off(-scatter_m, scatter_m);
    std::string text;
    for (const double height : style.heights_m) {
      for (int i = 0; i < 35; ++i) {
        const double x = 3.0 + 0.2 * (i % 7), y = -2.0 + 0.2 * (i / 7);
        const Vector3 field = field_at(x, y, height);
        text += fmt::format("{:.6f},{:.6f},{:.6f},{:.9g},{:.9g},{:.9g}\n", x + off(random), y + off(random),
                            height + off(random), field.x(), field.y(), field.z());
      }
    }
    const ImportedField imported = import(text);
    EXPECT_EQ(imported.nodes, 70);
    EXPECT_EQ(imported.in_cells, 70);
    const FieldGrid& grid = imported.map.grid();
    EXPECT_NEAR(grid.resolution_m, 0.2, 0.002);
    ASSERT_EQ(grid.heights_m.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(grid.heights_m[i], style.heights_m[i], scatter_m);
    const auto middle = imported.map.query({3.6, -1.6, grid.heights_m[0]}, FieldInterpolation::bilinear);
    ASSERT_TRUE(middle);
    EXPECT_LT((middle->field_ut - field_at(3.6, -1.6, 0.1)).norm(), 0.5);
  }
}

TEST_F(FieldImport, PositionsInMillimetresAreDoubted) {
  const auto doubted = [&](const std::string& header, double step, double offset) {
    std::string text = header.empty() ? "" : header + "\n";
    for (int i = 0; i < 35; ++i)
      text += fmt::format("{},{},120,20,{},-40\n", offset + step * (i % 7), step * (i / 7), i);
    return import(text).metres_in_doubt;
  };
  for (const std::string header : {"", "x,y,z,Bx,By,Bz", "# of a robot\nx,y,z,Bx_uT,By_uT,Bz_uT"}) {
    EXPECT_TRUE(doubted(header, 100.0, 3000.0)) << header;  // every 10 cm
    EXPECT_TRUE(doubted(header, 4000.5, 0.0)) << header;    // 24 km
    EXPECT_FALSE(doubted(header, 0.1, 3.0)) << header;
    EXPECT_FALSE(doubted(header, 10.0, 0.0)) << header;
    EXPECT_FALSE(doubted(header, 25.0, 0.5)) << header << ": no whole numbers";
  }
  for (const std::string header : {"x_m,y_m,z_m,Bx,By,Bz", "x [m],y [m],z [m],Bx,By,Bz"}) {
    EXPECT_FALSE(doubted(header, 100.0, 0.0));
    EXPECT_FALSE(doubted(header, 4000.0, 0.0));
  }
}

TEST_F(FieldImport, MissingNodesAreWithoutField) {
  Style style;
  style.has = [](int row, int column) { return row != 2 || column != 3; };
  const ImportedField imported = import(table(style) + "3.3,-1.8,0.12,nan,nan,nan\n");
  EXPECT_EQ(imported.nodes, 34);
  EXPECT_EQ(imported.in_cells, 34);
  EXPECT_FALSE(imported.map.query({3.28, -1.82, 0.12}, FieldInterpolation::bilinear));
  EXPECT_TRUE(imported.map.query({3.05, -1.95, 0.12}, FieldInterpolation::bilinear));
  for (const std::string empty : {"nan,nan,nan", ",,"}) {
    const ImportedField other = import(table(style) + "3.3,-1.8,2.5," + empty + "\n");
    EXPECT_EQ(other.map.grid().heights_m.size(), 1U) << "a layer without field is none";
    EXPECT_TRUE(other.map.query({3.05, -1.95, 0.3}, FieldInterpolation::bilinear));
  }
  style.has = [](int row, int column) { return column < 2 || (row == 0 && column == 6); };
  EXPECT_EQ(import(table(style)).in_cells, 10) << "a node alone has no cell";
}

TEST_F(FieldImport, ScatteredReadingsAreForMapMagnetic) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(0.0, 5.0);
  for (const int digits : {6, 2, 1}) {
    std::string text;
    for (int i = 0; i < 300; ++i)
      text += fmt::format("{:.{}f},{:.{}f},0.1,20,1,-40\n", place(random), digits, place(random), digits);
    if (digits == 1) text = "0.0,0.0,0.1,20,1,-40\n0.1,4.9,0.1,20,1,-40\n2.5,2.4,0.1,20,1,-40\n4.9,0.1,0.1,20,1,-40\n";
    EXPECT_THAT(error(text), AllOf(HasSubstr("field.csv: "),
                                   HasSubstr("build a map from the survey with `lodestone map magnetic`")));
  }
}

TEST_F(FieldImport, SaysWhatIsWrong) {
  Style style;
  EXPECT_THAT(error("#ROSBAG V2.0\n"),
              HasSubstr("expected a table of x, y, z, Bx, By, Bz in text; this looks like a log"));
  EXPECT_THAT(error("a,b,c\n1,2,3\n"),
              HasSubstr("field.csv:1: found the columns a, b, c; expected x, y, z, Bx, By, Bz"));
  EXPECT_THAT(error("x,y,z,Bx_nT,By_nT,Bz_nT,sigma_uT\n1,2,3,4,5,6,7\n"),
              HasSubstr("the columns 'Bz_nT' and 'sigma_uT' have different units"));
  EXPECT_THAT(error("x,y,z,Bx,By,Bz,sigma_x,sigma_y,sigma_z\n1,2,3,4,5,6,7,8,9\n"),
              HasSubstr("'sigma_x' is the sigma of one axis"));
  EXPECT_THAT(error("1,2,3\n"), HasSubstr("3 columns without names"));
  EXPECT_THAT(error("# nothing\n"), HasSubstr("there is no line of numbers"));
  EXPECT_THAT(error(table(style) + "3,4,five,1,2,3\n"), HasSubstr("field.csv:37: 'five' is not a number, in column 3"));
  EXPECT_THAT(error(table(style) + "3.1,-2.0,1\n"), HasSubstr("field.csv:37: expected 6 columns, found 3"));
  EXPECT_THAT(error(table(style) + "3.0,-2.0,0.12,1,2,3\n"), HasSubstr("have the same position, x 3, y -2"));
  EXPECT_THAT(error(table(style) + "3.0,-2.0,0.12,1,inf,3\n"),
              HasSubstr("field.csv:37: inf microtesla is not a valid field"));
  EXPECT_THAT(error("x_mm,y_mm,z_mm,Bx,By,Bz\n1,2,3,4,5,6\n"), HasSubstr("'x_mm' is in mm; expected metres"));
  style.with_z = false;
  style.header.clear();
  EXPECT_THAT(error(table(style)), HasSubstr("set --height"));
  style.with_z = true;
  FieldImportOptions options;
  options.height_m = 1.0;
  EXPECT_THAT(error(table(style), options), HasSubstr("omit --height"));
  options = {};
  options.unit = FieldUnit::tesla;
  EXPECT_THAT(error(table(style), options), HasSubstr("it looks like microtesla, set --unit microtesla"));
  style.per_ut = 1e9;
  EXPECT_THAT(error(table(style)), HasSubstr("set --unit"));
  EXPECT_THAT(error("0,0,0,20,0,-40\n1,0,0,20,0,-40\n0,2,0,20,0,-40\n1,2,0,20,0,-40\n"),
              HasSubstr("1 m apart along x and 2 m along y"));
  EXPECT_THAT(error("0,0,0,20,0,-40\n1,0,0,20,0,-40\n"), HasSubstr("all positions have the same y"));
  EXPECT_THAT(message_of<InputError>([&] { import_field_table(folder_ / "absent.csv", {}); }),
              HasSubstr("no such file"));
}

}  // namespace
}  // namespace lodestone
