#include "tools/check/field_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/angles.h"
#include "core/evaluation/statistics.h"
#include "tools/check/field_exchange.h"
#include "tools/check/field_series.h"
#include "tools/check/vector_series.h"

namespace lodestone {
namespace {

constexpr double significant_ut = 3.0;  // smaller differences do not harm the estimators
constexpr double significant_sigmas = 5.0;
constexpr double explains = 0.7;  // largest remaining share of the rms if a model explains the differences
constexpr double significant_array_turn_rad = 0.035;  // 2°
constexpr double significant_scale = 0.04;
constexpr double significant_delay_s = 0.012;
constexpr double delay_explains = 0.85;
constexpr std::size_t fewest_readings = 10;
constexpr double size_tolerance = 0.3;  // relative, of the field's magnitude
constexpr double passing_ut = 2.5;
constexpr double passing_factor = 4.0;  // relative to the median difference
constexpr double passing_share = 0.7;   // share of the magnetometers at the same time
constexpr Time bin = 500'000'000;

struct FieldSensor {
  std::size_t index;
  FieldSeries series;
  FieldModels models;
};

class FieldCheck {
 public:
  FieldCheck(const FieldComparison& comparison, const Platform& platform, const std::set<std::size_t>& known)
      : platform_(platform), file_(platform.file_name()) {
    std::vector<FieldSeries> all = field_series(comparison);
    for (const std::size_t j : known) all[j] = FieldSeries{};
    reassign_exchanged(all);
    for (std::size_t j = 0; j < all.size(); ++j) {
      if (all[j].times.size() < fewest_readings) continue;
      const FieldModels models = fit_models(all[j]);
      sensors_.push_back({j, std::move(all[j]), models});
    }
  }

  Findings run() {
    if (sensors_.empty()) {
      findings_.push_back(
          {Severity::warning, "field.off_map", "the magnetic map has no field along the drive",
           "set --magnetic to the map of this place, in the frame of the cloud map; or check --initial-pose"});
      return findings_;
    }
    if (wrong_map()) return findings_;
    if (find_delays()) return findings_;
    for (const FieldSensor& sensor : sensors_) check_sensor(sensor);
    // A difference of most magnetometers at the same time is not the fault of a single sensor.
    const bool most = 2 * faulty_.size() > sensors_.size();
    if (most) faulty_.clear();
    const bool passes = find_passing_steel();
    if (most && passes) return findings_;
    blame_mountings();
    append(findings_, std::move(faults_));
    return findings_;
  }

 private:
  void add(Severity severity, const std::string& kind, const std::string& seen, const std::string& change,
           std::optional<Time> time) {
    findings_.push_back({severity, kind, seen, change, time});
  }

  void add_fault(const std::string& kind, const std::string& seen, const std::string& change, Time time) {
    faults_.push_back({Severity::warning, kind, seen, change, time});
  }

  std::string name_of(const FieldSensor& sensor) const { return name_of(sensor.index); }
  const std::string& name_of(std::size_t index) const { return platform_.suite.magnetometers[index].name; }

  /// Reports exchanged magnetometers and reassigns their readings. Otherwise they would also be reported as rotated,
  /// stretched and late.
  void reassign_exchanged(std::vector<FieldSeries>& all) {
    const std::vector<std::size_t> followed = match_mounts(all);
    std::vector<FieldSeries> right = all;
    std::set<std::size_t> reported;
    for (std::size_t j = 0; j < all.size(); ++j) {
      if (followed[j] == j) continue;
      right[followed[j]] = exchanged(all[followed[j]], all[j]);
      if (reported.count(j) > 0) continue;
      std::string ring = name_of(j), change;
      for (std::size_t k = j; reported.insert(k).second; k = followed[k]) {
        ring += " -> " + name_of(followed[k]);
        const MagnetometerMessageLayout& read = platform_.magnetometers[k];
        const bool whole_array = read.topic == platform_.magnetometers[followed[k]].topic;
        change += fmt::format("{}magnetometers[{}].{}: {}", change.empty() ? "" : ", ", followed[k],
                              whole_array ? "path" : "topic", whole_array ? read.path : read.topic);
      }
      add(Severity::warning, "magnetometer.exchanged",
          fmt::format("{}: each of these reads the field at the position of the next: topics or plugs are exchanged",
                      ring),
          change + " in " + file_, all[j].times.front());
    }
    all = std::move(right);
  }

  double middle(double FieldModels::*value) const {
    std::vector<double> values;
    for (const FieldSensor& sensor : sensors_) values.push_back(sensor.models.*value);
    return summarize(values).median;
  }

  /// True if so many magnetometers differ that the map, the unit or the initial pose must be wrong.
  bool wrong_map() {
    std::vector<double> measured, expected;
    for (const FieldSensor& sensor : sensors_) {
      measured.push_back(median_length(sensor.series.measured_ut));
      expected.push_back(median_length(sensor.series.expected_ut));
    }
    const double found = summarize(measured).median;
    const double should = summarize(expected).median;
    const double rms = middle(&FieldModels::rms_ut);
    const Time begin = sensors_.front().series.times.front();
    if (std::abs(found / should - 1.0) > size_tolerance) {
      add(Severity::error, "field.magnitude",
          fmt::format("the measured field is {:.4g} uT, the map's field {:.4g} uT (medians over {} magnetometers)",
                      found, should, sensors_.size()),
          "check magnetometers[].unit in " + file_ + ", the calibration, or the map of --magnetic", begin);
      return true;
    }
    if (rms < 0.25 * should || std::abs(middle(&FieldModels::delay_s)) > significant_delay_s) return false;
    add(Severity::error, "field.map",
        fmt::format("field and map differ by {:.1f} uT of {:.1f} uT at half of the magnetometers or more", rms, should),
        "check the place and frame of --magnetic, magnetometers[].T_imu_mag in " + file_ + ", or --initial-pose",
        begin);
    return true;
  }

  /// A delay is reported only if it explains more than every other model.
  static bool is_late(const FieldSensor& sensor) {
    const FieldModels& models = sensor.models;
    return std::abs(models.delay_s) > significant_delay_s &&
           models.rms_undelayed_ut < delay_explains * models.rms_offset_ut &&
           models.rms_undelayed_ut < std::min({models.rms_turned_ut, models.rms_linear_ut, models.rms_drift_ut});
  }

  bool find_delays() {
    std::vector<double> late_s;
    for (const FieldSensor& sensor : sensors_) {
      if (is_late(sensor)) late_s.push_back(sensor.models.delay_s);
    }
    if (2 * late_s.size() > sensors_.size()) {
      const double delay_s = summarize(late_s).median;
      add(Severity::warning, "clock.magnetometers",
          fmt::format("the magnetometers' stamps are {:.3f} s {} than the trajectory's ({} of {} magnetometers)",
                      std::abs(delay_s), delay_s > 0.0 ? "later" : "earlier", late_s.size(), sensors_.size()),
          fmt::format("use one clock for all stamps, or set magnetometer_clock_offset_s: {:.3f} in {}",
                      platform_.magnetometer_clock_offset_s + delay_s, file_),
          sensors_.front().series.times.front());
      return true;
    }
    for (const FieldSensor& sensor : sensors_) {
      if (!is_late(sensor)) continue;
      faulty_.insert(sensor.index);
      add(Severity::warning, "clock.magnetometer",
          fmt::format("{}: its stamps are {:.3f} s {} than the trajectory's", name_of(sensor),
                      std::abs(sensor.models.delay_s), sensor.models.delay_s > 0.0 ? "later" : "earlier"),
          fmt::format("use one clock for all stamps, or remove magnetometers[{}] from {}", sensor.index, file_),
          sensor.series.times.front());
    }
    return false;
  }

  void check_sensor(const FieldSensor& sensor) {
    const FieldModels& models = sensor.models;
    if (faulty_.count(sensor.index) > 0) return;
    const Time begin = sensor.series.times.front();
    const std::string place = fmt::format("magnetometers[{}]", sensor.index);
    const double offset = models.offset_ut.norm();
    const bool shifted = offset > significant_ut && offset > significant_sigmas * models.offset_sigma_ut;
    const bool drifts =
        models.drift_ut.norm() > significant_ut && models.drift_ut.norm() > significant_sigmas * models.drift_sigma_ut;
    const bool odd = models.rms_offset_ut > significant_ut &&
                     models.rms_offset_ut > passing_factor * middle(&FieldModels::rms_offset_ut);
    if (!shifted && !drifts && !odd) return;
    faulty_.insert(sensor.index);
    const bool evenly = drifts && models.rms_drift_ut < explains * models.rms_offset_ut;
    if (evenly && models.rms_drift_ut < std::min(models.rms_turned_ut, models.rms_linear_ut)) {
      add_drift(sensor);
    } else if (models.turn_rad > significant_array_turn_rad && models.rms_turned_ut < explains * models.rms_offset_ut) {
      add_fault("magnetometer.turned",
                fmt::format("{}: is rotated by {:.1f} deg relative to the platform file: with this rotation it differs "
                            "by {:.1f} uT from the map, "
                            "with an offset by {:.1f} uT",
                            name_of(sensor), models.turn_rad * degrees_per_radian, models.rms_turned_ut,
                            models.rms_offset_ut),
                fmt::format("correct {}.T_imu_mag in {}", place, file_), begin);
    } else if (models.scale_error > significant_scale && models.rms_linear_ut < explains * models.rms_offset_ut) {
      add_fault(
          "magnetometer.stretched",
          fmt::format(
              "{}: scales the field by up to {:.0f} % along an axis (soft iron, scale): it differs by {:.1f} uT from "
              "the map, after "
              "correction by {:.1f} uT",
              name_of(sensor), 100.0 * models.scale_error, models.rms_ut, models.rms_linear_ut),
          "calibrate " + place, begin);
    } else if (drifts) {
      add_drift(sensor);
    } else if (shifted) {
      add_fault(
          "magnetometer.offset",
          fmt::format(
              "{}: differs by ({:.1f} {:.1f} {:.1f}) uT from the map, sigma {:.2f} uT: hard iron, or a mounting that "
              "differs from the platform file",
              name_of(sensor), models.offset_ut.x(), models.offset_ut.y(), models.offset_ut.z(),
              models.offset_sigma_ut),
          "calibrate " + place + ", or correct its T_imu_mag in " + file_, begin);
    } else {
      add_fault(
          "magnetometer.odd",
          fmt::format(
              "{}: its difference from the map varies by {:.1f} uT along the path, that of the others by {:.1f} uT",
              name_of(sensor), models.rms_offset_ut, middle(&FieldModels::rms_offset_ut)),
          "check the sensor, or remove " + place + " from " + file_, begin);
    }
  }

  void add_drift(const FieldSensor& sensor) {
    const Vector3& drift = sensor.models.drift_ut;
    add_fault(
        "magnetometer.drift",
        fmt::format("{}: drifts by ({:.1f} {:.1f} {:.1f}) uT in this span", name_of(sensor), drift.x(), drift.y(),
                    drift.z()),
        fmt::format("calibrate the sensor, let it warm up, or remove magnetometers[{}] from {}", sensor.index, file_),
        sensor.series.times.front());
  }

  /// Sensors do not drift together. What most of them show while the robot turns is an error of their mountings, here
  /// or in the file with which the map was made.
  void blame_mountings() {
    const auto drifts = [](const Finding& one) { return one.kind == "magnetometer.drift"; };
    const auto count = std::count_if(faults_.begin(), faults_.end(), drifts);
    if (count < 2 || 2 * static_cast<std::size_t>(count) <= sensors_.size()) return;
    std::erase_if(faults_, drifts);
    findings_.push_back({Severity::warning, "magnetometer.mountings",
                         fmt::format("the differences of {} of {} magnetometers from the map change along the path",
                                     count, sensors_.size()),
                         "check magnetometers[].T_imu_mag in " + file_ +
                             ", and in the file with which --magnetic was made; only then calibrate the sensors",
                         sensors_.front().series.times.front()});
  }

  /// Intervals in which most magnetometers at once deviate from their usual difference.
  bool find_passing_steel() {
    std::map<Time, std::vector<double>> bins;
    std::size_t healthy = 0;
    for (const FieldSensor& sensor : sensors_) {
      if (faulty_.count(sensor.index) > 0) continue;
      ++healthy;
      std::map<Time, std::vector<Vector3>> own;
      const std::vector<Vector3> differences = sensor.series.differences();
      for (std::size_t i = 0; i < differences.size(); ++i) {
        own[sensor.series.times[i] / bin].push_back(differences[i]);
      }
      for (const auto& [when, values] : own) bins[when].push_back(median_length(values));
    }
    const double usual = middle(&FieldModels::rms_offset_ut);
    const double limit = std::max(passing_ut, passing_factor * usual);
    std::optional<Time> first;
    int count = 0;
    double largest = 0.0;
    for (const auto& [when, sizes] : bins) {
      const auto beyond = std::count_if(sizes.begin(), sizes.end(), [&](double size) { return size > limit; });
      if (static_cast<double>(beyond) < passing_share * static_cast<double>(healthy)) continue;
      if (!first) first = when * bin;
      ++count;
      largest = std::max(largest, *std::max_element(sizes.begin(), sizes.end()));
    }
    if (!first) return false;
    add(Severity::warning, "field.passing",
        fmt::format(
            "for {:.1f} s, the whole array differs from the map by up to {:.1f} uT, otherwise by {:.1f} uT: passing or "
            "moved steel",
            count * to_seconds(bin), largest, usual),
        "", first);
    return true;
  }

  const Platform& platform_;
  std::string file_;
  std::vector<FieldSensor> sensors_;
  std::set<std::size_t> faulty_;  ///< magnetometers with a fault of their own
  Findings faults_;               ///< their findings
  Findings findings_;
};

}  // namespace

Findings check_field_along(const FieldComparison& comparison, const Platform& platform,
                           const std::set<std::size_t>& known) {
  if (known.size() >= platform.magnetometers.size()) return {};
  return FieldCheck(comparison, platform, known).run();
}

}  // namespace lodestone
