// `lodestone report` on a real short run, opened in Chromium like by a reader. To inspect the page, set
// LODESTONE_KEEP_REPORT to a file name.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

using testing::_;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;
using Json = nlohmann::json;
namespace fs = std::filesystem;

/// A lane between two walls that extend beyond LiDAR range: only steel distinguishes the places along it.
constexpr const char* kLane = R"(
name: lane
start_time_s: 1700000000
earth_field_ut: [20, 0, -40]
sensors:
  lidar: {rows: 16, columns: 256, max_range_m: 8}
  magnetometer_mounts:
    - {name: front, position_m: [0.3, 0.2, -0.08]}
    - {name: rear, position_m: [-0.3, -0.2, -0.08], rotation_rpy_deg: [0, 0, 180]}
survey: {lateral_offsets_m: [-0.3, 0.0, 0.3]}
cloud: {point_spacing_m: 0.1}
solids:
  - {shape: rectangle, size_m: [50, 8], steel: [{kind: rods, from_m: [-8, -4, -0.6], to_m: [12, 4, -0.4],
     density_per_m2: 1.5, length_m: [0.5, 1.5], moment_sigma_a_m2: 30}]}
  - {shape: box, at_m: [0, 3.5, 1], size_m: [50, 1, 2]}
  - {shape: box, at_m: [0, -3.5, 1], size_m: [50, 1, 2]}
sequences:
  short: {waypoints_m: [[-3, 0], [7, 0]], speed: [[0, 1.0]]}
)";

/// Simulated, mapped and run once for all tests of this file.
class ReportPage : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    std::ofstream(*folder_ / "lane.yaml") << kLane;
    expect_done("simulate " + path("lane.yaml") + " --out " + path("lane") + " --duration 8");
    expect_done("map magnetic " + path("lane/survey.bag") + " --trajectory " + path("lane/survey.tum") +
                " --platform " + path("lane/platform.yaml") + " --out " + path("lane/field.yaml"));
    run("--truth " + path("lane/truth.tum") + " --estimator smoother,ieskf --out " + path("lane/run"));
    run("--out " + path("lane/alone"));
    fs::create_directories(*folder_ / "kept");
    // Log and maps are removed: the run keeps all data of its report.
    for (const char* name : {"log.bag", "cloud.pcd", "field.yaml", "field.tif", "truth.tum"}) {
      fs::rename(*folder_ / "lane" / name, *folder_ / "kept" / name);
    }
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::string path(const std::string& name) { return (*folder_ / name).string(); }

  static void expect_done(const std::string& arguments) {
    const ProgramResult result = run_lodestone(arguments);
    ASSERT_EQ(result.code, 0) << arguments << "\n" << result.errors;
  }

  static void run(const std::string& more) {
    expect_done("run " + path("lane/log.bag") + " --platform " + path("lane/platform.yaml") + " --cloud " +
                path("lane/cloud.pcd") + " --magnetic " + path("lane/field.yaml") + " --initial-pose-from " +
                path("lane/truth.tum") + " " + more);
  }

  /// Opens the page; `options` of open_report.mjs.
  static Json open(const std::string& file, const std::string& options) {
    const std::string command = "node " + std::string(LODESTONE_SOURCE_DIR) + "/tests/tools/report/open_report.mjs " +
                                file + " " + options + " >" + path("seen.json") + " 2>" + path("seen.err");
    EXPECT_EQ(std::system(command.c_str()), 0) << content_of(path("seen.err"));
    const Json seen = Json::parse(content_of(path("seen.json")), nullptr, false);
    EXPECT_FALSE(seen.is_discarded());
    return seen;
  }

  /// Properties of every page, for all ways to open it.
  static void expect_sound(const Json& seen) {
    ASSERT_TRUE(seen.is_object());
    EXPECT_TRUE(seen["ready"].get<bool>());
    EXPECT_THAT(seen["errors"], IsEmpty());
    EXPECT_FALSE(seen["requests"].empty());
    for (const Json& request : seen["requests"]) {
      EXPECT_THAT(request.get<std::string>(), AnyOf(StartsWith("file:///"), StartsWith("data:"), StartsWith("blob:")));
    }
    for (const Json& chart : seen["charts"]) {
      EXPECT_GT(chart["painted"], 5000) << chart;
      EXPECT_GT(chart["colors"], 8) << chart;
      for (const Json& ink : chart["series"]) EXPECT_GT(ink, 30) << chart << ": a line is not to be seen";
    }
  }

  static std::map<std::string, Json> charts_of(const Json& seen) {
    std::map<std::string, Json> charts;
    for (const Json& chart : seen["charts"]) charts[chart["chart"]] = chart;
    return charts;
  }

  static inline std::unique_ptr<TemporaryFolder> folder_;
};

TEST_F(ReportPage, DrawsEveryChartAndAsksNoNetwork) {
  // Places as the stale-map report writes them.
  std::ofstream(*folder_ / "lane/run/smoother/stale_places.csv")
      << "place,x_m,y_m,largest_difference_ut,p_value\n1,1.0,0.1,14.2,1e-9\n2,3.0,0.0,11.0,2e-5\n";
  std::ofstream(*folder_ / "lane/run/smoother/calibration.csv")
      << "sensor,parameter,unit,estimate,sigma,platform_sigma\nlidar,turn_z,deg,-1.2,0.1,0.3\n"
         "magnetometers,clock,s,0.004,0.002,0.01\nfront,distortion_xx,1,0.004,0.006,0.01\n";
  // Ten scans that were not good.
  const fs::path diagnostics = *folder_ / "lane/run/smoother/diagnostics.csv";
  std::istringstream lines(content_of(diagnostics));
  std::ostringstream changed;
  int number = 0;
  for (std::string line; std::getline(lines, line); ++number) {
    const std::size_t at = line.find(",good,none,");
    if (number > 20 && number <= 30 && at != std::string::npos) line.replace(at, 11, ",lost,scan_off_map,");
    changed << line << "\n";
  }
  std::ofstream(diagnostics) << changed.str();
  const ProgramResult result = run_lodestone("report " + path("lane/run"));
  ASSERT_EQ(result.code, 0) << result.errors;
  const std::string file = path("lane/run/report.html");
  EXPECT_THAT(result.output, HasSubstr(file));
  EXPECT_LT(fs::file_size(file), 15'000'000U);
  if (const char* keep = std::getenv("LODESTONE_KEEP_REPORT"))
    fs::copy_file(file, keep, fs::copy_options::overwrite_existing);

  Json seen = open(file, "--hover 0.5");
  expect_sound(seen);
  const auto charts = charts_of(seen);
  for (const char* name : {"map", "error", "heading", "directions", "weights", "residual", "distribution"}) {
    EXPECT_EQ(charts.count(name), 1U) << name;
  }
  EXPECT_EQ(charts.at("map")["data"]["ground"], "field");
  EXPECT_EQ(charts.at("map")["data"]["tracks"], "3");  // the truth and two estimates
  EXPECT_EQ(charts.at("map")["data"]["marks"], "2");
  EXPECT_EQ(seen["page"]["rows"], 2);
  const auto trust = seen["page"]["trust"].get<std::vector<std::string>>();
  ASSERT_EQ(trust.size(), 2U + 4U) << "a sentence for each estimator, and one stretch without its name";
  EXPECT_THAT(trust[0], HasSubstr(fmt::format("smoother: {} of {} scans are good", number - 11, number - 1)));
  EXPECT_THAT(trust[0], HasSubstr(" Errors of its poses: up to "));
  EXPECT_THAT(trust[0], Not(HasSubstr("filter")));
  EXPECT_THAT(trust[1], HasSubstr("The sigma of a filter lacks errors"));
  EXPECT_EQ(charts.at("directions")["strokes"], 6) << "the legend distinguishes the directions";
  EXPECT_THAT(std::vector<std::string>(trust.begin() + 2, trust.end()), ElementsAre(_, _, "lost", "scan off map"));
  EXPECT_EQ(seen["page"]["staleRows"], 2);
  EXPECT_EQ(seen["page"]["calibrationRows"], 3);
  EXPECT_EQ(seen["page"]["width"], 1280) << "wider than the window";
  ASSERT_TRUE(seen["hovered"].is_array());
  for (const Json& values : seen["hovered"]) {
    EXPECT_THAT(values.get<std::string>(), testing::ContainsRegex("[0-9]")) << "the cursor is on every chart";
  }

  seen = open(file, "--choose cloud --size 390x844");
  expect_sound(seen);
  EXPECT_EQ(charts_of(seen).at("map")["data"]["ground"], "cloud");
  EXPECT_EQ(seen["page"]["width"], 390) << "wider than a phone";

  seen = open(file, "--choose space --dark");
  expect_sound(seen);
  const Json cloud = charts_of(seen).at("cloud");
  EXPECT_GT(std::stoi(cloud["data"]["points"].get<std::string>()), 5000);
  EXPECT_GT(cloud["colors"], 100) << "coloured by height";

  // If most of the field differs, the map is not to blame: the plan has no stale places.
  const std::string summary_text = content_of(path("lane/run/summary.json"));
  auto summary = nlohmann::ordered_json::parse(summary_text);
  auto& stale_map = summary["estimators"]["smoother"]["stale_map"];
  stale_map["stale"] = stale_map["places"];
  std::ofstream(path("lane/run/summary.json")) << summary.dump();
  expect_done("report " + path("lane/run") + " --out " + path("wrong.html"));
  EXPECT_EQ(charts_of(open(path("wrong.html"), "")).at("map")["data"]["marks"], "0");
  std::ofstream(path("lane/run/summary.json")) << summary_text;

  expect_refused("report " + path("lane/run") + " --out " + path("lane/run/summary.json/report.html"),
                 "cannot create the folder");
}

TEST_F(ReportPage, ShowsSigmaWhereThereIsNoTruth) {
  expect_done("report " + path("lane/alone"));
  const Json seen = open(path("lane/alone/report.html"), "");
  expect_sound(seen);
  const auto charts = charts_of(seen);
  EXPECT_EQ(charts.count("sigma"), 1U);
  EXPECT_EQ(charts.count("error"), 0U);
  EXPECT_EQ(charts.count("distribution"), 0U);
  EXPECT_EQ(charts.at("map")["data"]["tracks"], "1");
}

TEST_F(ReportPage, GathersAnExperiment) {
  const Json experiment = {{"experiment", "lanes"},
                           {"runs",
                            {{{"name", "short"},
                              {"group", "lane"},
                              {"seed", 0},
                              {"folder", "nowhere"},
                              {"estimators", {"smoother"}},
                              {"status", "done"}},
                             {{"name", "short"},
                              {"group", "lane"},
                              {"seed", 1},
                              {"folder", "run"},
                              {"estimators", {"smoother", "ieskf"}},
                              {"status", "done"}},
                             {{"name", "alone"},
                              {"group", "lane"},
                              {"range_m", 8},
                              {"seed", 1},
                              {"folder", "alone"},
                              {"estimators", {"smoother"}},
                              {"status", "done"}}}},
                           {"tables",
                            {{{"title", "ATE, m"},
                              {"header", {"run", "here", "paper"}},
                              {"rows", {{"short", 0.004, "0.024"}, {"</script>", nullptr, "/"}}},
                              {"note", "metres"}}}},
                           {"figures",
                            {{{"title", "Map"}, {"png", "run/pictures/map.png"}, {"caption", "of the lane"}},
                             {{"title", "Lost"}, {"svg", "gone.svg"}}}}};
  std::ofstream(*folder_ / "lane/reproduce.json") << experiment.dump();
  expect_done("report " + path("lane") + " --out " + path("lanes.html"));
  const Json seen = open(path("lanes.html"), "");
  expect_sound(seen);
  EXPECT_EQ(seen["page"]["images"], 1);
  EXPECT_EQ(seen["page"]["rows"], 2) << "the comparison of the first run that is on disk";
  EXPECT_EQ(charts_of(seen).count("error"), 1U);
  std::ofstream(*folder_ / "lane/reproduce.json") << R"({"experiment": "x", "runs": 3})";
  expect_refused("report " + path("lane"), "'runs'");
  fs::remove(*folder_ / "lane/reproduce.json");
}

TEST_F(ReportPage, NamesTheFileWhoseValuesAreOfAnotherKind) {
  const auto expect_named = [](const std::string& file, const char* key, const Json& value) {
    fs::copy(path("lane/run"), path("lane/other"), fs::copy_options::recursive);
    std::ifstream in(path("lane/other/" + file));
    Json json = Json::parse(in);
    json[key] = value;
    std::ofstream(path("lane/other/" + file)) << json.dump();
    expect_refused("report " + path("lane/other"), file + ": the values differ from those that Lodestone writes");
    fs::remove_all(path("lane/other"));
  };
  for (const char* file : {"lane/run/summary.json", "lane/run/smoother/trajectory.tum"}) {
    const std::string before = content_of(path(file));
    expect_refused("report " + path("lane/run") + " --out " + path(file),
                   "this file is not an HTML page, and the report would overwrite it");
    EXPECT_EQ(content_of(path(file)), before);
  }
  expect_named("summary.json", "status", 3);
  expect_named("overview/overview.json", "cloud_voxel_m", "fine");
  expect_named("overview/overview.json", "log_begin_s", Json::array());
  std::ofstream(path("lane/reproduce.json")) << R"({"experiment": "x", "tables": [], "figures": [],
    "runs": [{"folder": "run", "seed": "a"}, {"folder": "alone", "seed": "b"}]})";
  expect_refused("report " + path("lane"), "reproduce.json: the values differ");
  fs::remove(path("lane/reproduce.json"));
}

TEST(ReportCommand, RefusesWhatIsNoRun) {
  const TemporaryFolder folder;
  expect_refused("report " + (folder / "nowhere").string(), "no such folder");
  expect_refused("report " + folder.path().string(), "summary.json");
  EXPECT_EQ(run_lodestone("report").code, 2);
  EXPECT_THAT(run_lodestone("report --help").output, HasSubstr("Examples"));
  std::ofstream(folder / "summary.json") << "{\"estimators\": {\"smoother\": {";
  expect_refused("report " + folder.path().string(), "expected JSON");
  std::ofstream(folder / "summary.json") << R"({"estimators": {"smoother": {}}})";
  expect_refused("report " + folder.path().string(), "diagnostics.csv");
}

}  // namespace
}  // namespace lodestone
