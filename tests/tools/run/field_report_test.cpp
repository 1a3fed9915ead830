// The stale-map report of a made-up drive of 60 m over a map with 8 m of stale field: files, text, picture. To inspect
// the picture, set LODESTONE_KEEP_PICTURES to a folder.
#include "tools/run/field_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include "frontends/configuration/trajectory_file.h"
#include "tests/tools/program_runner.h"
#include "tools/plotting/stale_map_picture.h"

namespace lodestone {
namespace {

using testing::HasSubstr;

constexpr double kHeight_m = 0.2;
constexpr int kFieldScans = 600;

Vector3 field_at(const Vector3& p) {
  return {18.0 + 4.0 * std::sin(0.8 * p.x()), -8.0 + 3.0 * std::cos(1.1 * p.x() + p.y()), -40.0};
}

MagneticMap map_of_the_survey() {
  FieldGrid grid;
  grid.resolution_m = 0.1;
  grid.columns = 641;
  grid.rows = 61;
  grid.origin = {-2.0, -3.0};
  grid.heights_m = {kHeight_m};
  std::vector<Eigen::Vector4f> nodes;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      Eigen::Vector4f node;
      node << field_at({-2.0 + 0.1 * column, -3.0 + 0.1 * row, kHeight_m}).cast<float>(), 0.3F;
      nodes.push_back(node);
    }
  }
  return MagneticMap(grid, nodes, 5.0);
}

class FieldReportTest : public testing::Test {
 protected:
  FieldReportTest() {
    std::mt19937_64 generator(1);
    std::normal_distribution<double> normal;
    for (const double y : {-0.2, 0.0, 0.2}) {
      MagnetometerModel model;
      model.name = y < 0.0 ? "right" : (y > 0.0 ? "left" : "middle");
      model.T_imu_mag.position = {0.0, y, 0.0};
      suite_.magnetometers.push_back(model);
    }
    for (int scan = 1; scan <= kFieldScans; ++scan) {
      std::vector<MagneticArraySample> samples;
      for (int k = 0; k < 10; ++k) {
        MagneticArraySample sample;
        sample.time = from_seconds(0.1 * scan - 0.095 + 0.01 * k);
        for (const MagnetometerModel& model : suite_.magnetometers) {
          const Vector3 p = pose_at(to_seconds(sample.time)) * model.T_imu_mag.position;
          Vector3 reading = field_at(p) + Vector3(normal(generator), normal(generator), normal(generator));
          if (p.x() > 20.0 && p.x() < 28.0) reading += Vector3(0.0, 12.0, -16.0);
          if (model.name == "left") reading += Vector3(3.0, 0.0, 0.0);
          sample.field_ut.emplace_back(reading);
        }
        samples.push_back(sample);
      }
      readings_.add(samples);
      Estimate estimate;
      estimate.time = from_seconds(0.1 * scan);
      estimate.state.T_map_imu = pose_at(0.1 * scan);
      estimate.covariance = 1e-6 * Matrix6::Identity();
      estimate.diagnostics.magnetic_samples = 1;
      estimate.diagnostics.magnetic_weight = 0.75;
      record_.causal(estimate);
      record_.best(estimate);
    }
  }

  static Pose pose_at(double t) { return {Quaternion::Identity(), {t, std::sin(0.2 * t), kHeight_m}}; }

  FieldReport report() { return report_field({&map_, &suite_, &options_}, readings_, record_, warnings_); }

  MagneticMap map_ = map_of_the_survey();
  SensorSuite suite_;
  RunOptions options_;
  ArrayLog readings_{3};
  EstimateRecord record_;
  WarningLog warnings_;
  TemporaryFolder folder_;
};

TEST_F(FieldReportTest, NamesThePlaceAndTheOffset) {
  const FieldReport found = report();
  ASSERT_EQ(found.stale.places.size(), 1U);
  const StalePlace& place = found.stale.places.front();
  EXPECT_NEAR(place.center.x(), 24.0, 0.5);
  EXPECT_NEAR(place.center.z(), kHeight_m, 1e-6);
  EXPECT_NEAR(place.extent_m, 8.5, 1.01);
  EXPECT_NEAR(place.largest_difference_ut, 20.0, 1.5);
  EXPECT_LT((place.difference_ut - Vector3(0.0, 12.0, -16.0)).norm(), 1.5);
  EXPECT_LT(place.p_value, 1e-6);
  EXPECT_NEAR(to_seconds(place.first_time), 20.0, 0.6);
  EXPECT_NEAR(to_seconds(place.last_time), 28.0, 0.6);
  EXPECT_EQ(warnings_.count("field.offset"), 1);
  EXPECT_THAT(warnings_.entries().at("field.offset").first_detail, HasSubstr("x, y, z: left ("));
  EXPECT_EQ(warnings_.count("field.disagrees"), 0);
  EXPECT_NEAR(found.stale.expected_false_alarms(), 1e-3 * static_cast<double>(found.stale.cells.size()), 1e-12);
  const std::string text = stale_map_text("smoother", found.stale);
  EXPECT_THAT(text, HasSubstr("smoother): 1 place ("));
  EXPECT_THAT(text, HasSubstr("false alarm 0.001 per cell"));
}

TEST_F(FieldReportTest, WritesARowAScanAndARowAPlace) {
  const FieldReport found = report();
  ASSERT_GE(found.rows.size(),
            static_cast<std::size_t>(kFieldScans - 1));  // the first scan's readings precede all poses
  for (const FieldRow& row : found.rows) {
    const double t = to_seconds(row.time);
    EXPECT_LT((row.position - pose_at(t).position).norm(), 0.1);
    EXPECT_NEAR(row.weight, 0.75, 1e-12);
    if (t > 21.0 && t < 28.0) {
      EXPECT_NEAR(row.mean_size_ut, 20.0, 2.0);
      EXPECT_GT(row.difference_ut.norm(), 10.0 * row.sigma_ut);
    }
  }
  write_field_report(folder_.path(), found);
  const std::string rows = content_of(folder_ / "field_residuals.csv");
  EXPECT_EQ(static_cast<std::size_t>(std::count(rows.begin(), rows.end(), '\n')), found.rows.size() + 1);
  EXPECT_THAT(rows, HasSubstr("\n" + format_stamp(found.rows.front().time) + ","));
  const std::string places = content_of(folder_ / "stale_places.csv");
  EXPECT_EQ(std::count(places.begin(), places.end(), '\n'), 2);
  const std::string header = places.substr(0, places.find('\n'));
  EXPECT_EQ(2 * std::count(header.begin(), header.end(), ','), std::count(places.begin(), places.end(), ','));
}

TEST_F(FieldReportTest, WhatIsLostIsNotJudged) {
  EstimateRecord lost;
  for (std::size_t i = 0; i < record_.best().size(); ++i) {
    Estimate estimate;
    estimate.time = record_.best()[i].time;
    estimate.state.T_map_imu = record_.best()[i].pose;
    estimate.covariance = record_.covariances()[i];
    estimate.health = to_seconds(estimate.time) > 15.0 ? Health::lost : Health::good;
    lost.causal(estimate);
    lost.best(estimate);
  }
  const FieldReport found = report_field({&map_, &suite_, &options_}, readings_, lost, warnings_);
  EXPECT_TRUE(found.stale.places.empty());
  EXPECT_LT(to_seconds(found.rows.back().time), 15.3);
}

TEST_F(FieldReportTest, AWrongMapIsSaidToBeSuspect) {
  FieldGrid grid = map_.grid();
  std::vector<Eigen::Vector4f> nodes = map_.nodes();
  for (std::size_t i = 0; i < nodes.size(); ++i) {  // three thirds with different errors: no offset explains them
    const std::size_t third = i % 641 / 214;
    nodes[i].head<3>() += Eigen::Vector3f::Constant(third == 0 ? 9.0F : (third == 1 ? -9.0F : 25.0F));
  }
  map_ = MagneticMap(grid, nodes, 5.0);
  const FieldReport found = report();
  EXPECT_EQ(warnings_.count("field.disagrees"), 1);
  EXPECT_THAT(stale_map_text("smoother", found.stale), HasSubstr("rather the trajectory"));
  draw_stale_map_picture(folder_ / "wrong.svg", "ieskf", map_, {}, found.stale);
  const std::string picture = content_of(folder_ / "wrong.svg");
  EXPECT_THAT(picture, HasSubstr("along the drive of ieskf<"));
  EXPECT_THAT(picture, HasSubstr(">rather the trajectory"));
  EXPECT_THAT(picture, testing::Not(HasSubstr("stale place")));
}

TEST_F(FieldReportTest, WithoutPosesNothingIsSaidOfTheMap) {
  EstimateRecord lost;
  for (const StampedPose& pose : record_.best()) {
    Estimate estimate;
    estimate.time = pose.time;
    estimate.health = Health::lost;
    lost.causal(estimate);
    lost.best(estimate);
  }
  const FieldReport found = report_field({&map_, &suite_, &options_}, readings_, lost, warnings_);
  EXPECT_THAT(stale_map_text("smoother", found.stale), HasSubstr("not tested, because no reading"));
  FieldGrid far = map_.grid();
  far.origin.x() += 1000.0;
  map_ = MagneticMap(far, map_.nodes(), 5.0);
  EXPECT_THAT(stale_map_text("smoother", report().stale), HasSubstr("the map has no field along the path"));
}

TEST_F(FieldReportTest, ThePictureIsDrawnForMuchAndForNothing) {
  const FieldReport found = report();
  std::vector<DifferencePoint> drive;
  for (const FieldRow& row : found.rows) drive.push_back({row.position, row.mean_size_ut});
  const char* keep = std::getenv("LODESTONE_KEEP_PICTURES");
  const std::filesystem::path folder = keep != nullptr ? std::filesystem::path(keep) : folder_.path();
  draw_stale_map_picture(folder / "stale_map.png", "smoother", map_, drive, found.stale);
  draw_stale_map_picture(folder / "stale_map_empty.png", "smoother", map_, {}, {});
  for (const char* name : {"stale_map.png", "stale_map_empty.png"})
    EXPECT_EQ(content_of(folder / name).substr(1, 3), "PNG");
}

}  // namespace
}  // namespace lodestone
