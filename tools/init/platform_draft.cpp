#include "tools/init/platform_draft.h"

#include <fmt/format.h>

#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "core/angles.h"
#include "core/evaluation/statistics.h"
#include "frontends/configuration/options.h"
#include "frontends/messages/known_types.h"
#include "frontends/messages/sensor_checks.h"
#include "tools/check/log_sample.h"
#include "tools/init/imu_noise_file.h"
#include "tools/init/standstill_noise.h"
#include "tools/progress.h"

namespace lodestone {
namespace {

constexpr double standard_gravity_m_s2 = 9.80665;

// TDK InvenSense ICM-20948: 0.015 °/s/√Hz and 230 µg/√Hz (docs/design/051-init.md).
constexpr double consumer_gyroscope_density = 0.015 / degrees_per_radian;
constexpr double consumer_accelerometer_density = 230e-6 * standard_gravity_m_s2;
constexpr const char* consumer_imu = "data sheet of a consumer-grade IMU (TDK ICM-20948), without vibration";
// Data sheets state no random walk of the bias; these are the values of config/platforms/scout_os32.yaml.
constexpr double usual_gyroscope_walk = 2e-5;
constexpr double usual_accelerometer_walk = 5e-4;
constexpr double usual_field_noise_ut = 1.0;
constexpr double rotation_by_eye_deg = 2.0;  // sigma of a rotation that is measured by eye

/// Four significant digits: more are noise, and make the file hard to read.
double to_four_digits(double value) {
  return std::strtod(fmt::format("{:.4g}", value).c_str(), nullptr);
}

/// "/magnetometer_0/field" as "magnetometer_0_field".
std::string name_of_topic(const std::string& topic) {
  std::string name;
  for (const char letter : topic) {
    const bool plain = std::isalnum(static_cast<unsigned char>(letter)) != 0;
    if (plain || !name.empty()) name += plain ? letter : '_';
  }
  return name.empty() ? "magnetometer" : name;
}

std::string frame_of(const SurveyedTopic& topic) {
  return topic.frame.empty() ? "without a frame id" : "frame '" + topic.frame + "'";
}

class PlatformDraft {
 public:
  PlatformDraft(const LogSurvey& survey, const std::string& name)
      : survey_(survey), lidar_(chosen_lidar(survey)), imu_(chosen_imu(survey)) {
    platform_.name = name;
    platform_.file = name + ".yaml";
    platform_.suite.gravity_m_s2 = standard_gravity_m_s2;
    comment("magnetometer_calibration",
            "usual: one sigma of T_imu_mag, clock, hard iron and soft iron; increase what you measured roughly");
    comment("gravity_m_s2", "guess: standard gravity; the local value differs by up to 0.03 m/s2");
    if (lidar_ != nullptr) add_lidar();
    add_imu();
    for (const SurveyedTopic& topic : survey.topics) {
      if (topic.sensor == Sensor::magnetometer && !topic.refused) add_magnetometer(topic);
    }
    if (const std::string odometry = survey.odometry_topics(); !odometry.empty()) {
      comment("name",
              "not read: " + odometry + "; if one is wheel odometry, add the section 'wheels' (docs/user/wheels.md)");
    }
    if (lidar_ == nullptr) {
      platform_.lidar.topic.clear();
      comment("imu", "no LiDAR: these logs have none; if another log has its points, name both logs");
    }
    if (const std::string unread = reasons_of_refusal(survey, Sensor::magnetometer); !unread.empty()) {
      comment("magnetometers", "not read: " + unread);
    } else if (magnetometers_.empty()) {
      comment("magnetometers",
              "no sensor_msgs/MagneticField with messages; in a message of another type, state the key 'values' "
              "(docs/user/messages.md)");
    }
  }

  /// Reads units and noise.
  CommentedPlatform finish(double seconds, const std::string& imu_noise) {
    std::vector<LogSample> samples;
    WarningLog unheard;  // survey_logs has the same
    for (const std::string& log : survey_.logs) {
      throw_if_interrupted();
      samples.push_back(
          read_log_sample(log, platform_, seconds, unheard, {.lidar = false, .imu = true, .magnetometers = true}));
    }
    infer_acceleration_unit(samples);
    infer_field_units(samples);
    std::optional<StandstillNoise> noise;
    for (const LogSample& sample : samples) {
      if (!noise) noise = standstill_noise(sample, imu_.period_s);
    }
    if (imu_noise.empty()) {
      set_imu_noise(noise, seconds);
    } else {
      take_imu_noise(imu_noise);
    }
    set_field_noise(noise, seconds);
    comment("guesses", "nobody measured these; remove each from the list once you have");
    for (const auto& [key, text] : comments_) {
      if (key.ends_with("T_imu_lidar") || key.ends_with("T_imu_mag")) {
        if (is_guess(key)) platform_.guesses.push_back(key);
      }
    }
    return {platform_, comments_};
  }

 private:
  void comment(const std::string& key, const std::string& text) { comments_[key] = text; }

  bool is_guess(const std::string& key) const {
    const auto found = comments_.find(key);
    return found != comments_.end() && found->second.starts_with("guess");
  }

  std::string described(const SurveyedTopic& topic, const char* others, const char* remedy) const {
    const std::string text = fmt::format("{}, {}", topic.info.type, frame_of(topic));
    const std::string more = other_topics(survey_, topic);
    return more.empty() ? text : fmt::format("{}; {}: {}{}", text, others, more, remedy);
  }

  void add_lidar() {
    platform_.lidar = lidar_->layout;
    LidarModel& model = platform_.suite.lidar;
    model.scan_period_s = to_four_digits(lidar_->period_s);
    comment("lidar.topic", described(*lidar_, "the LiDAR with most points; others in the log",
                                     " (a second LiDAR is an entry of further_lidars)"));
    comment("lidar.scan_period_s", "median of the first stamps");
    add_layout();
    const char* sheet = "guess: the LiDAR's data sheet or config/platforms has the value";
    model.range_noise_m = 0.02;
    comment("lidar.range_noise_m", sheet);
    model.min_range_m = 0.5;
    comment("lidar.min_range_m", "guess: beyond the robot's own parts");
    model.max_range_m = 100.0;
    comment("lidar.max_range_m", sheet);
    model.T_imu_lidar = mounting("lidar.T_imu_lidar", lidar_->frame, "LiDAR");
    const char* usual =
        "usual: one sigma of T_imu_lidar, of the clock and of bends of the map; increase what you measured roughly";
    if (is_guess("lidar.T_imu_lidar")) {
      platform_.suite.calibration.lidar.rotation_sigma_deg = rotation_by_eye_deg;
      usual =
          "one sigma of T_imu_lidar by tape measure and eye (0.3 deg from a drawing or a calibration), of the clock "
          "and of bends of the map";
    }
    comment("lidar.calibration", usual);
  }

  void add_layout() {
    LidarMessageLayout& layout = platform_.lidar;
    const bool livox = message_type(lidar_->info.type) == MessageType::livox;
    const bool relative =
        layout.time_zero == PointTimeZero::scan_start || layout.time_zero == PointTimeZero::lidar_clock;
    if (relative || livox) {
      layout.stamp = ScanStamp::start;
      comment("lidar.stamp", "guess: most drivers stamp the scan's start; `lodestone check` compares with the IMU");
    }
    if (layout.point_times == PointTimes::none) {
      comment(
          "lidar.point_times",
          "no field has times of the points: correct for deskewed scans only; otherwise record the driver's points");
    } else if (layout.time_field.empty()) {
      comment("lidar", "the point fields and their times are read from the messages");
    } else {
      comment("lidar.fields", "as the first cloud shows");
      comment("lidar.time_unit", "from the span of the times, one scan");
      comment("lidar.time_zero", "from the size of the times");
    }
  }

  void add_imu() {
    platform_.imu.topic = imu_.info.name;
    platform_.suite.imu.rate_hz =
        imu_.period_s > 0.0 ? to_four_digits(1.0 / imu_.period_s) : platform_.suite.imu.rate_hz;
    comment("imu.topic", described(imu_, "the IMU with most messages; others in the log", ""));
    comment("imu.calibration", "usual: one sigma of the IMU's scales and axes");
    comment("imu.rate_hz", imu_.period_s > 0.0 ? "median of the first stamps" : "guess: the log has a single message");
  }

  void add_magnetometer(const SurveyedTopic& topic) {
    const std::string key = fmt::format("magnetometers[{}]", magnetometers_.size());
    magnetometers_.push_back(&topic);
    std::string name = name_of_topic(topic.info.name);
    while (!names_.insert(name).second) name += "_";
    platform_.magnetometers.push_back({topic.info.name, FieldUnit::tesla});
    MagnetometerModel& model = platform_.suite.magnetometers.emplace_back();
    model.name = name;
    comment(key + ".topic", fmt::format("{}{}", frame_of(topic),
                                        topic.period_s > 0.0 ? fmt::format(", {:.4g} Hz", 1.0 / topic.period_s) : ""));
    model.T_imu_mag = mounting(key + ".T_imu_mag", topic.frame, "magnetometer");
    if (is_guess(key + ".T_imu_mag")) {
      platform_.suite.calibration.magnetometers.rotation_sigma_deg = rotation_by_eye_deg;
    }
  }

  /// T_imu_frame from the static transforms, otherwise the identity.
  Pose mounting(const std::string& key, const std::string& frame, const char* sensor) {
    if (!frame.empty() && frame == imu_.frame) {
      comment(key,
              fmt::format("guess: identity, because IMU and {} have the same frame '{}'; if they are apart, measure "
                          "the position of the {} in the axes of the IMU",
                          sensor, frame, sensor));
      return {};
    }
    if (const std::optional<Pose> found = survey_.transforms.between(imu_.frame, frame)) {
      comment(key, fmt::format("from /tf_static, '{}' to '{}'", imu_.frame, frame));
      return *found;
    }
    comment(key, fmt::format("guess: identity, because {}; measure the position of the {} in the axes of the IMU, in "
                             "metres, and how its axes are rotated (docs/user/platform-file.md)",
                             survey_.transforms.empty() ? "the log has no /tf_static"
                             : imu_.frame.empty() || frame.empty()
                                 ? "the messages name no frames"
                                 : fmt::format("/tf_static does not connect '{}' with '{}'", imu_.frame, frame),
                             sensor));
    return {};
  }

  void infer_acceleration_unit(std::vector<LogSample>& samples) {
    FirstReadings readings;
    for (const LogSample& sample : samples) {
      for (const ImuSample& imu : sample.imu) readings.add(imu.time, imu.linear_acceleration.norm());
    }
    const double mean = readings.mean_magnitude();
    const auto unit = fitting_acceleration_unit(mean, standard_gravity_m_s2);
    comment("imu.acceleration_unit", unit ? fmt::format("the mean magnitude is {:.3g}", mean)
                                          : fmt::format("guess: the mean magnitude is {:.3g}, which is gravity in "
                                                        "neither m/s2 nor g",
                                                        mean));
    if (unit != AccelerationUnit::standard_gravity) return;
    platform_.imu.acceleration_unit = *unit;
    for (LogSample& sample : samples) {
      for (ImuSample& imu : sample.imu) imu.linear_acceleration *= standard_gravity_m_s2;
    }
  }

  void infer_field_units(std::vector<LogSample>& samples) {
    for (std::size_t i = 0; i < magnetometers_.size(); ++i) {
      std::vector<double> magnitudes;
      for (const LogSample& sample : samples) {
        for (const MagneticSample& field : sample.fields[i])
          magnitudes.push_back(field.field_ut.norm() / microtesla_per(FieldUnit::tesla));
      }
      const double as_written = summarize(magnitudes).median;
      const std::string fitting = as_written > 0.0 ? fitting_field_unit(as_written) : "";
      FieldUnit& unit = platform_.magnetometers[i].unit;
      options_detail::parse_name(fitting, unit);
      comment(fmt::format("magnetometers[{}].unit", i),
              magnitudes.empty() ? "guess: the first messages have no finite reading"
              : fitting.empty()
                  ? fmt::format("guess: the median magnitude is {:.3g}, which is near the earth's field in no "
                                "unit",
                                as_written)
                  : fmt::format("the median magnitude is {:.3g}", as_written));
      const double factor = microtesla_per(unit) / microtesla_per(FieldUnit::tesla);
      for (LogSample& sample : samples) {
        for (MagneticSample& field : sample.fields[i]) field.field_ut *= factor;
      }
    }
  }

  /// `found`: 0 if unknown.
  void set_density(const std::string& key, double found, double otherwise, const std::string& how, double& density) {
    density = to_four_digits(found > 0.0 ? found : otherwise);
    comment("imu." + key, found > 0.0 ? how : fmt::format("guess: {}; {}", no_standstill_, consumer_imu));
  }

  void set_imu_noise(const std::optional<StandstillNoise>& noise, double seconds) {
    ImuNoise& imu = platform_.suite.imu;
    no_standstill_ =
        noise ? "the samples at rest are constant" : fmt::format("no standstill of 2 s in the first {:g} s", seconds);
    const std::string how =
        noise ? fmt::format("{:.1f} s at rest or in straight and even motion; increase the value if the robot vibrates",
                            noise->duration_s)
              : "";
    set_density("gyroscope_noise_density_rad_s_sqrt_hz", noise ? noise->gyroscope_density : 0.0,
                consumer_gyroscope_density, how, imu.gyroscope_noise_density);
    set_density("accelerometer_noise_density_m_s2_sqrt_hz", noise ? noise->accelerometer_density : 0.0,
                consumer_accelerometer_density, how, imu.accelerometer_noise_density);
    set_usual_random_walks();
  }

  void take_imu_noise(const std::string& path) {
    ImuNoise& imu = platform_.suite.imu;
    const std::vector<StatedImuNoise> stated = read_imu_noise(path, imu.rate_hz);
    const StatedImuNoise& found = imu_of_topic(stated, imu_.info.name, path);
    imu.gyroscope_noise_density = found.noise.gyroscope_noise_density;
    imu.accelerometer_noise_density = found.noise.accelerometer_noise_density;
    std::string how = "stated by " + std::filesystem::path(path).filename().string();
    if (!found.topic.empty() && found.topic != imu_.info.name) how += " for the topic " + found.topic;
    if (!found.random_walks) {  // computed from the noise of a sample
      imu.gyroscope_noise_density = to_four_digits(imu.gyroscope_noise_density);
      imu.accelerometer_noise_density = to_four_digits(imu.accelerometer_noise_density);
      how += fmt::format(" for one sample, at {:g} Hz", imu.rate_hz);
    }
    comment("imu.gyroscope_noise_density_rad_s_sqrt_hz", how);
    comment("imu.accelerometer_noise_density_m_s2_sqrt_hz", how);
    if (!found.random_walks) return set_usual_random_walks();
    imu.gyroscope_bias_random_walk = found.noise.gyroscope_bias_random_walk;
    imu.accelerometer_bias_random_walk = found.noise.accelerometer_bias_random_walk;
    comment("imu.gyroscope_bias_random_walk_rad_s2_sqrt_hz", how);
    comment("imu.accelerometer_bias_random_walk_m_s3_sqrt_hz", how);
  }

  void set_usual_random_walks() {
    platform_.suite.imu.gyroscope_bias_random_walk = usual_gyroscope_walk;
    platform_.suite.imu.accelerometer_bias_random_walk = usual_accelerometer_walk;
    const char* walk = "guess: usual; an Allan deviation over hours shows the value";
    comment("imu.gyroscope_bias_random_walk_rad_s2_sqrt_hz", walk);
    comment("imu.accelerometer_bias_random_walk_m_s3_sqrt_hz", walk);
  }

  void set_field_noise(const std::optional<StandstillNoise>& noise, double seconds) {
    for (std::size_t i = 0; i < magnetometers_.size(); ++i) {
      const double found = noise ? to_four_digits(noise->fields_ut[i]) : 0.0;
      platform_.suite.magnetometers[i].noise_ut = found > 0.0 ? found : usual_field_noise_ut;
      comment(fmt::format("magnetometers[{}].noise_ut", i),
              found > 0.0 ? fmt::format("{:.1f} s at rest or in straight and even motion; motors may add noise",
                                        noise->duration_s)
              : noise     ? "guess: the readings at rest are too few, or constant"
                          : fmt::format("guess: no standstill of 2 s in the first {:g} s", seconds));
    }
  }

  const LogSurvey& survey_;
  const SurveyedTopic* lidar_;  // null: none
  const SurveyedTopic& imu_;
  std::vector<const SurveyedTopic*> magnetometers_;
  std::set<std::string> names_;
  std::string no_standstill_;  ///< why the noise at rest is unknown
  Platform platform_;
  std::map<std::string, std::string> comments_;
};

}  // namespace

CommentedPlatform draft_platform(const LogSurvey& survey, const std::string& name, double seconds,
                                 const std::string& imu_noise) {
  return PlatformDraft(survey, name).finish(seconds, imu_noise);
}

}  // namespace lodestone
