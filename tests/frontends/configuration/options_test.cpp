#include "frontends/configuration/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "frontends/configuration/file_kind.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {

enum class Shape { round, square };

constexpr auto enum_names(Shape) {
  return EnumNames<Shape, 2>{{{Shape::round, "round"}, {Shape::square, "square"}}};
}

struct InnerOptions {
  double limit_m = 0.1;
  Shape shape = Shape::round;
  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("limit_m", limit_m, "how far");
    visitor.field("shape", shape, "what it looks like");
  }
  void check() const {
    if (limit_m <= 0.0) throw InputError("limit_m must be above 0");
  }
};

struct OuterOptions {
  bool enabled = true;
  int count = 3;
  std::string name = "a \"name\"";
  std::vector<double> weights{1.0, 2.5};
  InnerOptions inner;
  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("enabled", enabled, "whether");
    visitor.field("count", count, "how many");
    visitor.field("name", name, "whose");
    visitor.field("weights", weights, "each");
    visitor.section("inner", inner);
  }
};

namespace {

using ::lodestone::testing::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

OuterOptions load_text(const std::string& text) {
  OuterOptions options;
  load_options(ConfigurationNode::parse(text, "file.yaml"), options);
  return options;
}

std::string option_error(const std::string& text) {
  return message_of<InputError>([&] { load_text(text); });
}

TEST(Options, KeepTheirDefaultsWhereTheFileIsSilent) {
  const OuterOptions options = load_text("count: 7\ninner:\n  shape: square\n");
  EXPECT_EQ(options.count, 7);
  EXPECT_EQ(options.inner.shape, Shape::square);
  EXPECT_TRUE(options.enabled);
  EXPECT_EQ(options.inner.limit_m, 0.1);
  EXPECT_EQ(load_text("").count, 3);
}

TEST(Options, ReadBackTheSameBits) {
  OuterOptions options;
  options.enabled = false;
  options.name = "tricky: \"#'\\ \n text";
  options.weights = {0.1 + 0.2, 1e-300, -7.0, std::numeric_limits<double>::infinity(), 3.0e22};
  options.inner.limit_m = 1.0 / 3.0;
  options.inner.shape = Shape::square;
  const OuterOptions back = load_text(save_options(options));
  EXPECT_EQ(back.enabled, options.enabled);
  EXPECT_EQ(back.name, options.name);
  EXPECT_EQ(back.weights, options.weights);
  EXPECT_EQ(back.inner.limit_m, options.inner.limit_m);
  EXPECT_EQ(back.inner.shape, options.inner.shape);
}

TEST(Options, SuggestTheNearestKeyForAMisspeltOne) {
  EXPECT_EQ(option_error("count: 2\ninner:\n  limt_m: 3\n"),
            "file.yaml:3: inner.limt_m: unknown key 'limt_m'; did you mean 'limit_m'?");
  EXPECT_THAT(option_error("iner:\n  limit_m: 3\n"),
              HasSubstr("file.yaml:1: iner: unknown key 'iner'; did you mean 'inner'"));
}

TEST(Options, SuggestNothingThatIsFarFromWhatWasWritten) {
  EXPECT_EQ(option_error("inner:\n  colour: 3\n"),
            "file.yaml:2: inner.colour: unknown key 'colour'; known: limit_m, shape");
  EXPECT_THAT(option_error("inner:\n  shape: triangle\n"), Not(HasSubstr("did you mean")));
  const std::vector<std::string> names{"tesla", "gauss", "limit_m"};
  EXPECT_EQ(suggestion("telsa", names), "; did you mean 'tesla'?");
  EXPECT_EQ(suggestion("limit", names), "; did you mean 'limit_m'?");
  EXPECT_EQ(suggestion("ampere", names), "");
  EXPECT_EQ(suggestion("x", {}), "");
  EXPECT_EQ(edit_distance("ab", "ba"), 1);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
}

TEST(SeemingKind, TellsOurFilesByHowTheyBegin) {
  const std::pair<std::string, SeemingKind> cases[] = {
      {"# robot\nname: a\nlidar:\n  topic: /p\nimu: {topic: /i}\nmagnetometers: []\n", SeemingKind::platform},
      {"resolution_m: 0.1\norigin_m: [0, 0]\nheights_m: [0.1]\nimage: a.tif\n", SeemingKind::magnetic_map},
      {"name: a\nsensors:\n  lidar: {}\nsequences:\n  a: {}\n", SeemingKind::world},
      {"# t x y z\n1.5 0 0 0 0 0 0 1\n", SeemingKind::trajectory},
      {"# .PCD v0.7\nVERSION 0.7\n", SeemingKind::point_cloud},
      {"VERSION 0.7\nFIELDS x y z\n", SeemingKind::point_cloud},
      {"ply\nformat ascii 1.0\n", SeemingKind::point_cloud},
      {"#ROSBAG V2.0\n", SeemingKind::log},
      {std::string("II*\0\x08\0\0\0", 8), SeemingKind::raster},
      {"smoother:\n  window_s: 2\nmagnetic:\n  imu: 3\n", SeemingKind::unknown},
      {"1 2 3 4 5 6 7\n", SeemingKind::unknown},
      {"", SeemingKind::unknown}};
  for (const auto& [text, kind] : cases) EXPECT_EQ(seeming_kind(text), kind) << text;
}

TEST(Options, SayWhatWasExpectedAndWhatCame) {
  EXPECT_EQ(option_error("enabled: maybe\n"), "file.yaml:1: enabled: expected true or false, found 'maybe'");
  EXPECT_THAT(option_error("count: 2.5\n"), HasSubstr("expected a whole number, found '2.5'"));
  EXPECT_THAT(option_error("count: [1]\n"), HasSubstr("expected a whole number, found a list of 1"));
  EXPECT_THAT(option_error("inner:\n  limit_m: 3 m\n"), HasSubstr("inner.limit_m: expected a number, found '3 m'"));
  EXPECT_THAT(option_error("inner: 3\n"), HasSubstr("expected a map"));
  EXPECT_THAT(option_error("weights: [1, two]\n"), HasSubstr("weights[1]: expected a number, found 'two'"));
  EXPECT_THAT(option_error("inner:\n  shape: squar\n"),
              AllOf(HasSubstr("one of round, square"), HasSubstr("did you mean 'square'")));
  EXPECT_THAT(option_error("- 1\n"), HasSubstr("expected a map"));
  const std::string table = option_error("count: 1" + std::string(1000, '2') + "\n");
  EXPECT_THAT(table, HasSubstr("expected a whole number, found '12222"));
  EXPECT_THAT(table, ::testing::EndsWith("222...'"));
  EXPECT_LT(table.size(), 200U);
}

TEST(Options, NameTheFileWhereTheCheckRefusesAValue) {
  EXPECT_THAT(option_error("inner:\n  limit_m: -1\n"), AllOf(HasSubstr("file.yaml:1: inner"), HasSubstr("above 0")));
}

TEST(Options, AFileOfBytesIsCalledOne) {
  const testing::TemporaryFolder folder;
  testing::write_text(folder / "options.yaml", std::string("\x7f"
                                                           "ELF\x02\x01\0\0\x1b[31m",
                                                           13));
  EXPECT_THAT(testing::message_of<InputError>([&] { load_configuration({folder / "options.yaml"}, {}); }),
              HasSubstr("options.yaml: expected YAML, found a binary file"));
  testing::write_text(folder / "cloud.pcd", "# .PCD v0.7\nVERSION 0.7\n");
  EXPECT_THAT(testing::message_of<InputError>([&] { load_configuration({folder / "cloud.pcd"}, {}); }),
              HasSubstr("expected a file of options; this looks like a point cloud (PCD, PLY or LAS)"));
}

TEST(Options, RefuseMalformedYamlAndKeysGivenTwice) {
  EXPECT_THAT(option_error("inner: [1, 2\n"), HasSubstr("no valid YAML"));
  EXPECT_THAT(option_error("---\ncount: 1\n---\ncount: 2\n"), HasSubstr("file.yaml:4: a second YAML document begins"));
  EXPECT_THAT(option_error("count: 1\ncount: 2\n"), HasSubstr("file.yaml:2: count: the key is given twice"));
}

TEST(Options, LaterFilesAndAssignmentsPrevail) {
  const testing::TemporaryFolder folder;
  testing::write_text(folder / "a.yaml", "count: 1\ninner:\n  limit_m: 0.5\n  shape: square\n");
  testing::write_text(folder / "b.yaml", "inner:\n  limit_m: 0.7\n");
  OuterOptions options;
  load_options(load_configuration({folder / "a.yaml", folder / "b.yaml"}, {"count=9", "weights=[4, 5]"}), options);
  EXPECT_EQ(options.count, 9);
  EXPECT_EQ(options.inner.limit_m, 0.7);
  EXPECT_EQ(options.inner.shape, Shape::square);
  EXPECT_EQ(options.weights, (std::vector<double>{4, 5}));
}

TEST(Options, AMistakeInAnAssignmentIsNamedAsSuch) {
  OuterOptions options;
  EXPECT_EQ(message_of<InputError>([&] { load_options(load_configuration({}, {"inner.limt_m=3"}), options); }),
            "--set inner.limt_m=3: inner.limt_m: unknown key 'limt_m'; did you mean 'limit_m'?");
  EXPECT_THAT(message_of<InputError>([&] { load_configuration({}, {"inner.limit_m"}); }),
              HasSubstr("expected key.path=value"));
  EXPECT_THAT(message_of<InputError>([&] { load_configuration({"absent.yaml"}, {}); }),
              HasSubstr("absent.yaml: there is no such file"));
}

TEST(Options, AreListedWithPathTypeAndHelp) {
  const std::string list = list_options(OuterOptions{});
  EXPECT_THAT(list, HasSubstr("inner.shape = round  (round|square)  what it looks like\n"));
  EXPECT_THAT(list, HasSubstr("count = 3  (whole number)  how many\n"));
}

}  // namespace
}  // namespace lodestone
