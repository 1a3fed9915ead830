#include "tools/init/platform_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "frontends/configuration/options.h"
#include "frontends/configuration/platform_calibration.h"

namespace lodestone {
namespace {

using options_detail::write_value;

/// Names in a log may contain anything, but a comment ends with its line.
std::string on_one_line(std::string text) {
  for (char& letter : text) {
    if ((letter >= 0 && letter < ' ') || letter == '\x7f') letter = '?';
  }
  return text;
}

/// Writes lines of YAML, each with the comment of its key.
class CommentedLines {
 public:
  explicit CommentedLines(const std::map<std::string, std::string>& comments) : comments_(comments) {}

  /// `parent`: path of the map that contains the key; empty at the root. `first_of_item`: the line begins a list item.
  void line(const std::string& parent, const std::string& key, const std::string& value, bool first_of_item = false) {
    const std::string path = parent.empty() ? key : parent + "." + key;
    const auto depth = static_cast<std::size_t>(std::count(parent.begin(), parent.end(), '.') + !parent.empty());
    std::string indent(2 * (depth + (parent.find('[') == std::string::npos ? 0 : 1)), ' ');
    if (first_of_item) indent.replace(indent.size() - 2, 2, "- ");
    const std::string text = indent + key + ":" + (value.empty() ? "" : " " + value);
    text_ += text + comment_of(path) + "\n";
  }

  template <class Value>
  void value(const std::string& parent, const std::string& key, const Value& value) {
    line(parent, key, write_value(value));
  }

  void pose(const std::string& parent, const std::string& key, const Pose& pose) {
    const Vector3& p = pose.position;
    const Quaternion& q = pose.rotation;
    const std::string path = parent + "." + key;
    line(parent, key, "");
    value(path, "translation_m", std::vector<double>{p.x(), p.y(), p.z()});
    value(path, "quaternion_xyzw", std::vector<double>{q.x(), q.y(), q.z(), q.w()});
  }

  /// Lines that are YAML already; the comment of `path` goes to the first of them.
  void block(const std::string& path, std::string lines) {
    if (const auto comment = comment_of(path); !comment.empty()) lines.insert(lines.find('\n'), comment);
    text_ += lines;
  }

  void item(const std::string& value) { text_ += "  - " + value + "\n"; }

  const std::string& text() const { return text_; }

 private:
  std::string comment_of(const std::string& path) const {
    const auto found = comments_.find(path);
    return found == comments_.end() ? "" : "  # " + on_one_line(found->second);
  }

  const std::map<std::string, std::string>& comments_;
  std::string text_;
};

void write_lidar(CommentedLines& out, const LidarMessageLayout& layout, const LidarModel& model,
                 const LidarCalibrationSigmas& sigmas) {
  const std::string lidar = "lidar", fields = "lidar.fields";
  out.line("", lidar, "");
  out.value(lidar, "topic", layout.topic);
  if (layout.stamp) out.value(lidar, "stamp", *layout.stamp);
  if (!layout.time_field.empty()) {
    out.line(lidar, "fields", "");
    out.value(fields, "time", layout.time_field);
    if (!layout.intensity_field.empty()) out.value(fields, "intensity", layout.intensity_field);
    if (!layout.ring_field.empty()) out.value(fields, "ring", layout.ring_field);
  }
  if (layout.time_unit) out.value(lidar, "time_unit", *layout.time_unit);
  if (layout.time_zero) out.value(lidar, "time_zero", *layout.time_zero);
  if (layout.point_times != PointTimes::field) out.value(lidar, "point_times", layout.point_times);
  out.value(lidar, "range_noise_m", model.range_noise_m);
  out.value(lidar, "min_range_m", model.min_range_m);
  out.value(lidar, "max_range_m", model.max_range_m);
  out.value(lidar, "scan_period_s", model.scan_period_s);
  out.pose(lidar, "T_imu_lidar", model.T_imu_lidar);
  out.block("lidar.calibration", calibration_sigma_lines(1, "calibration", sigmas));
}

void write_imu(CommentedLines& out, const ImuMessageLayout& layout, const ImuNoise& noise,
               const ImuCalibrationSigmas& sigmas) {
  const std::string imu = "imu";
  out.line("", imu, "");
  out.value(imu, "topic", layout.topic);
  out.value(imu, "acceleration_unit", layout.acceleration_unit);
  out.value(imu, "rate_hz", noise.rate_hz);
  out.value(imu, "gyroscope_noise_density_rad_s_sqrt_hz", noise.gyroscope_noise_density);
  out.value(imu, "accelerometer_noise_density_m_s2_sqrt_hz", noise.accelerometer_noise_density);
  out.value(imu, "gyroscope_bias_random_walk_rad_s2_sqrt_hz", noise.gyroscope_bias_random_walk);
  out.value(imu, "accelerometer_bias_random_walk_m_s3_sqrt_hz", noise.accelerometer_bias_random_walk);
  out.block("imu.calibration", calibration_sigma_lines(1, "calibration", sigmas));
}

void write_magnetometers(CommentedLines& out, const Platform& platform) {
  if (platform.magnetometers.empty()) return out.line("", "magnetometers", "[]");
  const std::string calibration = "magnetometer_calibration";
  out.block(calibration, calibration_sigma_lines(0, calibration, platform.suite.calibration.magnetometers));
  out.line("", "magnetometers", "");
  for (std::size_t i = 0; i < platform.magnetometers.size(); ++i) {
    const std::string item = fmt::format("magnetometers[{}]", i);
    const MagnetometerModel& model = platform.suite.magnetometers[i];
    out.line(item, "name", write_value(model.name), true);
    out.value(item, "topic", platform.magnetometers[i].topic);
    out.value(item, "unit", platform.magnetometers[i].unit);
    out.value(item, "noise_ut", model.noise_ut);
    out.pose(item, "T_imu_mag", model.T_imu_mag);
  }
}

}  // namespace

std::string commented_text(const CommentedPlatform& commented) {
  const Platform& platform = commented.platform;
  CommentedLines out(commented.comments);
  out.value("", "name", platform.name);
  out.value("", "gravity_m_s2", platform.suite.gravity_m_s2);
  if (platform.has_lidar()) write_lidar(out, platform.lidar, platform.suite.lidar, platform.suite.calibration.lidar);
  write_imu(out, platform.imu, platform.suite.imu, platform.suite.calibration.imu);
  write_magnetometers(out, platform);
  if (!platform.guesses.empty()) {
    out.line("", "guesses", "");
    for (const std::string& key : platform.guesses) out.item(write_value(key));
  }
  return out.text();
}

}  // namespace lodestone
