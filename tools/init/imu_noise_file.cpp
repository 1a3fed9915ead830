#include "tools/init/imu_noise_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/configuration_node.h"
#include "frontends/configuration/file_kind.h"

namespace lodestone {
namespace {

constexpr const char* kFirstKey = "accelerometer_noise_density";

double positive(const ConfigurationNode& imu, const std::string& key) {
  const double value = imu.at(key).as_double();
  if (!(value > 0.0) || !std::isfinite(value)) {
    imu.at(key).fail(fmt::format("expected a number above 0, found {}", value));
  }
  return value;
}

StatedImuNoise imu_of(const ConfigurationNode& node) {
  StatedImuNoise result;
  if (const ConfigurationNode* topic = node.find("rostopic")) result.topic = topic->as_string();
  result.noise.accelerometer_noise_density = positive(node, kFirstKey);
  result.noise.accelerometer_bias_random_walk = positive(node, "accelerometer_random_walk");
  result.noise.gyroscope_noise_density = positive(node, "gyroscope_noise_density");
  result.noise.gyroscope_bias_random_walk = positive(node, "gyroscope_random_walk");
  return result;
}

StatedImuNoise imu_of_imu_utils(const ConfigurationNode& root, double rate_hz) {
  StatedImuNoise result;
  result.random_walks = false;
  result.noise.accelerometer_noise_density = positive(root.at("Acc").at("avg-axis"), "acc_n") / std::sqrt(rate_hz);
  result.noise.gyroscope_noise_density = positive(root.at("Gyr").at("avg-axis"), "gyr_n") / std::sqrt(rate_hz);
  return result;
}

}  // namespace

std::vector<StatedImuNoise> read_imu_noise(const std::string& path, double rate_hz) {
  const ConfigurationNode root = ConfigurationNode::load(path);
  if (root.has("Gyr")) return {imu_of_imu_utils(root, rate_hz)};
  std::vector<StatedImuNoise> result;
  for (const std::string& key : root.keys()) {
    const ConfigurationNode& section = root.at(key);
    if (section.kind() == ConfigurationNode::Kind::map && section.has(kFirstKey)) result.push_back(imu_of(section));
  }
  if (result.empty() && !root.has(kFirstKey)) {
    throw InputError(fmt::format("{}: expected a file of Kalibr, allan_variance_ros or imu_utils, with the key '{}'{}",
                                 path, kFirstKey, looks_like(path)));
  }
  if (result.empty()) result.push_back(imu_of(root));
  return result;
}

const StatedImuNoise& imu_of_topic(const std::vector<StatedImuNoise>& imus, const std::string& topic,
                                   const std::string& path) {
  const auto found = std::ranges::find(imus, topic, &StatedImuNoise::topic);
  if (found != imus.end()) return *found;
  if (imus.size() == 1) return imus.front();
  throw InputError(fmt::format("{}: none of the IMUs ({}) is the log's, {}; correct its rostopic, or keep one IMU",
                               path, join_names(imus, &StatedImuNoise::topic), topic));
}

}  // namespace lodestone
