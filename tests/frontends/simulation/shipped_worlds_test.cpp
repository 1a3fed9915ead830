#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>

#include "frontends/simulation/magnetic_field.h"
#include "frontends/simulation/route.h"
#include "frontends/simulation/scene.h"

namespace lodestone::simulation {
namespace {

std::vector<std::string> shipped_worlds() {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(LODESTONE_SOURCE_DIR "/config/worlds"))
    if (entry.path().extension() == ".yaml") files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

/// Horizontal gradients of the field's components along a path at the magnetometers' height, every 5 cm.
struct FieldStatistics {
  double gradient_rms = 0.0;        ///< µT/m, of one component along one horizontal axis
  double weakest_gradient_rms = 0.0;  ///< the same over the weakest 2 m of the path
  double field_sigma = 0.0;         ///< µT, a component, about its mean over 5 m
  double structure_m = 0.0;         ///< field_sigma / gradient_rms: the field changes by its own size over this length
};

FieldStatistics field_statistics(const World& world, const Sequence& sequence) {
  const MagneticField field(world.earth_field_ut, build_scene(world).sources);
  const double height = world.imu.height_m + world.magnetometers.mounts.at(0).T_imu_mag().position.z();
  const Route route(sequence.waypoints, sequence.corner_radius_m);
  constexpr double step = 0.05, half = 0.01;
  std::vector<double> squares;
  std::vector<Vector3> values;
  for (double distance = 0.0; distance < route.length(); distance += step) {
    const Eigen::Vector2d place = route.at(distance).position;
    const Vector3 point(place.x(), place.y(), height);
    double sum = 0.0;
    for (int axis = 0; axis < 2; ++axis) {
      const Vector3 offset = half * Vector3::Unit(axis);
      sum += ((field.field_ut(point + offset) - field.field_ut(point - offset)) / (2.0 * half)).squaredNorm();
    }
    squares.push_back(sum / 6.0);
    values.push_back(field.field_ut(point));
  }
  const auto mean_square = [&](std::size_t begin, std::size_t end) {
    double sum = 0.0;
    for (std::size_t i = begin; i < end; ++i) sum += squares[i];
    return sum / static_cast<double>(end - begin);
  };
  FieldStatistics statistics;
  statistics.gradient_rms = std::sqrt(mean_square(0, squares.size()));
  statistics.weakest_gradient_rms = 1e9;
  for (std::size_t i = 0; i + 40 <= squares.size(); ++i)
    statistics.weakest_gradient_rms = std::min(statistics.weakest_gradient_rms, std::sqrt(mean_square(i, i + 40)));
  double variance = 0.0;
  std::size_t count = 0;
  for (std::size_t begin = 0; begin + 100 <= values.size(); begin += 100) {
    Vector3 mean = Vector3::Zero();
    for (std::size_t i = begin; i < begin + 100; ++i) mean += values[i] / 100.0;
    for (std::size_t i = begin; i < begin + 100; ++i, ++count) variance += (values[i] - mean).squaredNorm() / 3.0;
  }
  statistics.field_sigma = std::sqrt(variance / static_cast<double>(count));
  statistics.structure_m = statistics.field_sigma / statistics.gradient_rms;
  return statistics;
}

/// A field with which a map of 0.5 µT error places eight magnetometers to a centimetre or two: gradients near those
/// measured in buildings at this height, and structure that a map of 0.1 m cells can hold.
TEST(ShippedWorlds, FieldAlongEveryPathCanPlaceARobot) {
  for (const std::string& file : shipped_worlds()) {
    const World world = load_world(file);
    for (const auto& [name, sequence] : world.sequences) {
      const FieldStatistics s = field_statistics(world, sequence);
      const Route route(sequence.waypoints, sequence.corner_radius_m);
      std::cout << std::filesystem::path(file).filename().string() << " sequence " << name << ": " << route.length()
                << " m, gradient rms " << s.gradient_rms << " (weakest 2 m: " << s.weakest_gradient_rms
                << ") uT/m, sigma " << s.field_sigma << " uT, structure " << s.structure_m << " m\n";
      EXPECT_GT(s.gradient_rms, 8.0) << file << " " << name;
      EXPECT_LT(s.gradient_rms, 30.0) << file << " " << name;
      EXPECT_GT(s.weakest_gradient_rms, 3.0) << file << " " << name;
      EXPECT_GT(s.structure_m, 0.3) << file << " " << name;
      EXPECT_LT(s.structure_m, 1.2) << file << " " << name;
    }
  }
}

TEST(ShippedWorlds, SequencesLastAsLongAsTheyShould) {
  for (const std::string& file : shipped_worlds()) {
    const World world = load_world(file);
    for (const auto& [name, sequence] : world.sequences) {
      const auto plan = plan_drive(sequence);
      double fastest = 0.0;
      for (const PlannedPose& pose : plan) fastest = std::max(fastest, pose.speed);
      std::cout << std::filesystem::path(file).filename().string() << " sequence " << name << ": "
                << static_cast<double>(plan.size()) * plan_step_s << " s, up to " << fastest << " m/s\n";
      EXPECT_GT(static_cast<double>(plan.size()) * plan_step_s, 80.0);
      EXPECT_LT(static_cast<double>(plan.size()) * plan_step_s, 220.0);
      EXPECT_LE(fastest, 3.1);
    }
  }
}

}  // namespace
}  // namespace lodestone::simulation
