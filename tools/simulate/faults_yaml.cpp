#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/nearest_name.h"
#include "frontends/configuration/configuration_node.h"
#include "frontends/configuration/options.h"
#include "tools/simulate/faults.h"
#include "tools/simulate/sensor_options.h"

namespace lodestone::simulation {
namespace {

constexpr double largest_slip = 100.0;    // spinning wheels
constexpr double largest_offset_s = 5.0;  // with larger offsets, sensors have no common clock at all

Vector3 vector_of(const ConfigurationNode& node) {
  return Vector3(node.as_doubles(3).data());
}

/// Allowed keys of an entry, without `kind`.
std::vector<std::string> keys_of(FaultKind kind) {
  switch (kind) {
    case FaultKind::hard_iron:
      return {"magnetometer", "begin_s", "end_s", "offset_ut"};
    case FaultKind::soft_iron:
      return {"magnetometer", "begin_s", "end_s", "matrix", "scale", "shear"};
    case FaultKind::misalignment:
      return {"magnetometer", "begin_s", "end_s", "rotation_rpy_deg"};
    case FaultKind::bias_drift:
      return {"magnetometer", "begin_s", "end_s", "rate_ut_s", "random_walk_ut_sqrt_s"};
    case FaultKind::dead:
    case FaultKind::stuck:
      return {"magnetometer", "begin_s", "end_s"};
    case FaultKind::saturated:
      return {"magnetometer", "begin_s", "end_s", "limit_ut"};
    case FaultKind::spikes:
      return {"magnetometer", "begin_s", "end_s", "rate_per_s", "size_ut"};
    case FaultKind::lidar_outage:
      return {"begin_s", "end_s", "scans"};
    case FaultKind::imu_gap:
      return {"begin_s", "end_s"};
    case FaultKind::imu_bias_jump:
      return {"at_s", "gyroscope_rad_s", "accelerometer_m_s2"};
    case FaultKind::passing_steel:
      return {"begin_s", "end_s", "from_m", "to_m", "moment_a_m2"};
    case FaultKind::slip:
      return {"begin_s", "end_s", "fraction"};
    case FaultKind::clock_offset:
      break;
  }
  return {"sensor", "begin_s", "end_s", "offset_s"};
}

/// One entry of the list.
class Entry {
 public:
  Entry(const ConfigurationNode& node, const std::vector<std::string>& magnetometers, bool has_wheels)
      : node_(node), magnetometers_(magnetometers), has_wheels_(has_wheels) {}

  Fault read() {
    options_detail::read_value(node_.at("kind"), fault_.kind);
    // Unknown keys are reported before missing keys: a missing key may be misspelt.
    std::vector<std::string> known = keys_of(fault_.kind);
    known.emplace_back("kind");
    node_.refuse_keys_other_than(known);
    if (fault_.kind == FaultKind::imu_bias_jump) {
      read_bias_jump();
      return fault_;
    }
    read_span();
    if (known.front() == "magnetometer") read_magnetometers();
    switch (fault_.kind) {
      case FaultKind::hard_iron:
        fault_.offset_ut = vector_of(node_.at("offset_ut"));
        break;
      case FaultKind::soft_iron:
        read_matrix();
        break;
      case FaultKind::misalignment:
        fault_.matrix = mounting_pose({0.0, 0.0, 0.0}, node_.at("rotation_rpy_deg").as_doubles(3))
                            .rotation.conjugate()
                            .toRotationMatrix();
        break;
      case FaultKind::bias_drift:
        read_drift();
        break;
      case FaultKind::saturated:
        fault_.limit_ut = positive("limit_ut");
        break;
      case FaultKind::spikes:
        fault_.rate_per_s = positive("rate_per_s");
        fault_.size_ut = positive("size_ut");
        break;
      case FaultKind::lidar_outage:
        read_outage();
        break;
      case FaultKind::clock_offset:
        read_clock();
        break;
      case FaultKind::passing_steel:
        read_passing_steel();
        break;
      case FaultKind::slip:
        read_slip();
        break;
      default:
        break;
    }
    return fault_;
  }

 private:
  double positive(const std::string& key) const {
    const double value = node_.at(key).as_double();
    if (!(value > 0.0)) node_.at(key).fail("must be above 0");
    return value;
  }

  /// Without begin_s and end_s, a fault lasts for the whole drive. Outages, gaps and passing steel require both keys.
  void read_span() {
    const bool needed = fault_.kind == FaultKind::lidar_outage || fault_.kind == FaultKind::imu_gap ||
                        fault_.kind == FaultKind::passing_steel;
    const ConfigurationNode* begin = needed ? &node_.at("begin_s") : node_.find("begin_s");
    const ConfigurationNode* end = needed ? &node_.at("end_s") : node_.find("end_s");
    if (begin != nullptr) fault_.begin_s = begin->as_double();
    if (end != nullptr) fault_.end_s = end->as_double();
    if (!(fault_.begin_s >= 0.0)) begin->fail("must be at least 0 (seconds since the log's begin)");
    if (!(fault_.end_s > fault_.begin_s)) (end != nullptr ? end : begin)->fail("end_s must be more than begin_s");
  }

  void add_magnetometer(const ConfigurationNode& name) {
    const auto found = std::find(magnetometers_.begin(), magnetometers_.end(), name.as_string());
    if (found == magnetometers_.end()) {
      name.fail(magnetometers_.empty()
                    ? "the robot has no magnetometers (sensors.magnetometer_mounts)"
                    : fmt::format("there is no magnetometer '{}'{} (known: {}, all)", name.as_string(),
                                  suggestion(name.as_string(), magnetometers_), join_names(magnetometers_)));
    }
    const int index = static_cast<int>(found - magnetometers_.begin());
    if (std::find(fault_.magnetometers.begin(), fault_.magnetometers.end(), index) != fault_.magnetometers.end()) {
      name.fail("'" + name.as_string() + "' is named twice");
    }
    fault_.magnetometers.push_back(index);
  }

  void add_all_magnetometers() {
    for (int j = 0; j < static_cast<int>(magnetometers_.size()); ++j) fault_.magnetometers.push_back(j);
  }

  void read_magnetometers() {
    const ConfigurationNode& which = node_.at("magnetometer");
    if (which.kind() == ConfigurationNode::Kind::sequence) {
      for (const ConfigurationNode& name : which.elements()) add_magnetometer(name);
    } else if (which.as_string() == "all") {
      add_all_magnetometers();
    } else {
      add_magnetometer(which);
    }
    if (fault_.magnetometers.empty()) which.fail("names no magnetometer; expected a name, a list of names, or all");
  }

  void read_matrix() {
    const ConfigurationNode* matrix = node_.find("matrix");
    const ConfigurationNode* scale = node_.find("scale");
    const ConfigurationNode* shear = node_.find("shear");
    if ((matrix != nullptr) == (scale != nullptr || shear != nullptr)) {
      node_.fail("expected either matrix (three rows of three), or scale: [x, y, z] and shear: [xy, xz, yz]");
    }
    if (matrix != nullptr) {
      const auto& rows = matrix->elements();
      if (rows.size() != 3) matrix->fail("expected three rows of three numbers");
      for (int row = 0; row < 3; ++row) fault_.matrix.row(row) = vector_of(rows[static_cast<std::size_t>(row)]);
      return;
    }
    if (scale != nullptr) fault_.matrix.diagonal() = vector_of(*scale);
    if (shear == nullptr) return;
    const Vector3 off = vector_of(*shear);
    fault_.matrix(0, 1) = fault_.matrix(1, 0) = off[0];
    fault_.matrix(0, 2) = fault_.matrix(2, 0) = off[1];
    fault_.matrix(1, 2) = fault_.matrix(2, 1) = off[2];
  }

  void read_drift() {
    const ConfigurationNode* rate = node_.find("rate_ut_s");
    const bool walks = node_.has("random_walk_ut_sqrt_s");
    if (rate != nullptr) fault_.rate_ut_s = vector_of(*rate);
    if (walks) fault_.random_walk_ut_sqrt_s = positive("random_walk_ut_sqrt_s");
    if (rate == nullptr && !walks) node_.fail("expected rate_ut_s: [x, y, z], random_walk_ut_sqrt_s, or both");
  }

  void read_outage() {
    const ConfigurationNode* scans = node_.find("scans");
    if (scans == nullptr) return;
    const std::string text = scans->as_string();
    if (text != "none" && text != "empty") scans->fail("expected none or empty, found '" + text + "'");
    fault_.empty_scans = text == "empty";
  }

  void read_bias_jump() {
    const ConfigurationNode& at_s = node_.at("at_s");
    fault_.begin_s = at_s.as_double();
    if (!(fault_.begin_s >= 0.0)) at_s.fail("must be at least 0 (seconds since the log's begin)");
    const ConfigurationNode* gyroscope = node_.find("gyroscope_rad_s");
    const ConfigurationNode* accelerometer = node_.find("accelerometer_m_s2");
    if (gyroscope == nullptr && accelerometer == nullptr) {
      node_.fail("expected gyroscope_rad_s: [x, y, z], accelerometer_m_s2: [x, y, z], or both");
    }
    if (gyroscope != nullptr) fault_.gyroscope_rad_s = vector_of(*gyroscope);
    if (accelerometer != nullptr) fault_.accelerometer_m_s2 = vector_of(*accelerometer);
  }

  void read_clock() {
    const ConfigurationNode& sensor = node_.at("sensor");
    const std::string text = sensor.as_string();
    if (text == "imu") {
      fault_.imu_clock = true;
    } else if (text == "lidar") {
      fault_.lidar_clock = true;
    } else if (text == "magnetometers") {
      add_all_magnetometers();
    } else if (std::find(magnetometers_.begin(), magnetometers_.end(), text) != magnetometers_.end()) {
      add_magnetometer(sensor);
    } else {
      std::vector<std::string> names{"imu", "lidar", "magnetometers"};
      names.insert(names.end(), magnetometers_.begin(), magnetometers_.end());
      sensor.fail(
          fmt::format("there is no sensor '{}'{} (known: {})", text, suggestion(text, names), join_names(names)));
    }
    const ConfigurationNode& offset = node_.at("offset_s");
    const double offset_s = offset.as_double();
    if (!(std::abs(offset_s) <= largest_offset_s)) offset.fail(fmt::format("must be within ±{} s", largest_offset_s));
    fault_.clock_offset = from_seconds(offset_s);
  }

  void read_passing_steel() {
    fault_.from_m = vector_of(node_.at("from_m"));
    fault_.to_m = vector_of(node_.at("to_m"));
    fault_.moment_a_m2 = vector_of(node_.at("moment_a_m2"));
    add_all_magnetometers();
  }

  void read_slip() {
    if (!has_wheels_) node_.fail("the robot has no wheel odometry; add sensors.wheels");
    const ConfigurationNode& fraction = node_.at("fraction");
    fault_.slip = fraction.as_double();
    if (!(fault_.slip >= -1.0 && fault_.slip <= largest_slip && fault_.slip != 0.0)) {
      fraction.fail(fmt::format("must be -1 (blocked wheels) to {:g} and not 0", largest_slip));
    }
  }

  const ConfigurationNode& node_;
  const std::vector<std::string>& magnetometers_;
  bool has_wheels_;
  Fault fault_;
};

}  // namespace

std::vector<Fault> read_faults(const ConfigurationNode& list, const std::vector<std::string>& magnetometers,
                               bool has_wheels) {
  std::vector<Fault> faults;
  for (const ConfigurationNode& node : list.elements()) faults.push_back(Entry(node, magnetometers, has_wheels).read());
  return faults;
}

}  // namespace lodestone::simulation
