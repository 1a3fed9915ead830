#include "tools/simulate/faults.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/random_stream.h"
#include "tools/simulate/magnetic_field.h"

namespace lodestone::simulation {
namespace {

bool concerns(const Fault& fault, int magnetometer) {
  return std::find(fault.magnetometers.begin(), fault.magnetometers.end(), magnetometer) != fault.magnetometers.end();
}

/// State of a fault for one magnetometer.
struct Memory {
  explicit Memory(const RandomStream& stream) : random(stream) {}
  RandomStream random;
  std::optional<Vector3> stuck_ut;
  Vector3 walk_ut = Vector3::Zero();
  std::optional<double> last_s;  // of the previous reading during the fault
};

Vector3 drift(const Fault& fault, double seconds, Memory& memory) {
  const double lasted_s = std::clamp(seconds, fault.begin_s, fault.end_s) - fault.begin_s;
  if (fault.random_walk_ut_sqrt_s > 0.0 && lasted_s > 0.0) {
    const double step_s = lasted_s - memory.last_s.value_or(0.0);
    if (step_s > 0.0) memory.walk_ut += fault.random_walk_ut_sqrt_s * std::sqrt(step_s) * memory.random.normal3();
    memory.last_s = lasted_s;
  }
  return lasted_s * fault.rate_ut_s + memory.walk_ut;
}

/// A reading is a spike with probability rate · interval, where interval is the time since the previous reading.
Vector3 spike(const Fault& fault, double seconds, Memory& memory) {
  const double interval_s = memory.last_s ? seconds - *memory.last_s : 0.0;
  memory.last_s = seconds;
  if (memory.random.uniform() >= fault.rate_per_s * interval_s) return Vector3::Zero();
  return fault.size_ut * memory.random.normal3().normalized();
}

/// Field of the moving steel at a magnetometer with pose `T_map_mag`, in the magnetometer's axes.
Vector3 passing_field_ut(const Fault& fault, double seconds, const Pose& T_map_mag) {
  const double share = (seconds - fault.begin_s) / (fault.end_s - fault.begin_s);
  FieldSource dipole;
  dipole.position = fault.from_m + share * (fault.to_m - fault.from_m);
  dipole.moment = fault.moment_a_m2;
  return T_map_mag.rotation.conjugate() * source_field_ut(dipole, T_map_mag.position);
}

}  // namespace

struct FaultInjector::Implementation {
  Implementation(std::vector<Fault> faults_in, Time start_in, std::uint64_t seed_in, MagnetometerPose where_in)
      : faults(std::move(faults_in)), start(start_in), seed(seed_in), where(std::move(where_in)) {
    for (const Fault& fault : faults) {
      if (fault.clock_offset < 0) earliest_offset += fault.clock_offset;
    }
  }

  bool lasts(const Fault& fault, double seconds) const { return seconds >= fault.begin_s && seconds < fault.end_s; }
  double seconds_of(Time time) const { return to_seconds(time - start); }

  Memory& memory(std::size_t fault, int magnetometer) {
    const auto key = std::make_pair(fault, magnetometer);
    auto found = memories.find(key);
    if (found == memories.end()) {
      // One stream per fault and magnetometer: faults do not change each other's random numbers.
      const auto index = static_cast<std::uint64_t>(fault) << 32U | static_cast<std::uint32_t>(magnetometer);
      found = memories.emplace(key, Memory(RandomStream(seed, "faults", index))).first;
    }
    return found->second;
  }

  /// The overloads return false if the measurement is not recorded.
  bool apply_faults(MagneticSample& sample) {
    const double seconds = seconds_of(sample.time);
    Time shift = 0;
    for (std::size_t i = 0; i < faults.size(); ++i) {
      const Fault& fault = faults[i];
      if (!concerns(fault, sample.magnetometer)) continue;
      if (fault.kind == FaultKind::bias_drift) {
        sample.field_ut += drift(fault, seconds, memory(i, sample.magnetometer));
        continue;
      }
      if (!lasts(fault, seconds)) continue;
      switch (fault.kind) {
        case FaultKind::hard_iron:
          sample.field_ut += fault.offset_ut;
          break;
        case FaultKind::soft_iron:
        case FaultKind::misalignment:
          sample.field_ut = fault.matrix * sample.field_ut;
          break;
        case FaultKind::dead:
          return false;
        case FaultKind::stuck: {
          std::optional<Vector3>& held = memory(i, sample.magnetometer).stuck_ut;
          if (!held) held = sample.field_ut;
          sample.field_ut = *held;
          break;
        }
        case FaultKind::saturated:
          sample.field_ut = sample.field_ut.cwiseMax(-fault.limit_ut).cwiseMin(fault.limit_ut);
          break;
        case FaultKind::spikes:
          sample.field_ut += spike(fault, seconds, memory(i, sample.magnetometer));
          break;
        case FaultKind::clock_offset:
          shift += fault.clock_offset;
          break;
        case FaultKind::passing_steel:
          sample.field_ut += passing_field_ut(fault, seconds, where(sample.magnetometer, seconds));
          break;
        default:
          break;
      }
    }
    sample.time += shift;
    return true;
  }

  bool apply_faults(ImuSample& sample) {
    const double seconds = seconds_of(sample.time);
    Time shift = 0;
    for (const Fault& fault : faults) {
      if (!lasts(fault, seconds)) continue;
      if (fault.kind == FaultKind::imu_gap) return false;
      if (fault.kind == FaultKind::imu_bias_jump) {
        sample.angular_velocity += fault.gyroscope_rad_s;
        sample.linear_acceleration += fault.accelerometer_m_s2;
      }
      if (fault.imu_clock) shift += fault.clock_offset;
    }
    sample.time += shift;
    return true;
  }

  bool apply_faults(WheelSample& sample) {
    const double seconds = seconds_of(sample.time);
    for (const Fault& fault : faults) {
      if (fault.kind != FaultKind::slip || !lasts(fault, seconds)) continue;
      sample.forward_velocity_m_s *= 1.0 + fault.slip;
      sample.lateral_velocity_m_s *= 1.0 + fault.slip;
      sample.yaw_rate_rad_s *= 1.0 + fault.slip;
    }
    return true;
  }

  bool apply_faults(LidarScan& scan) {
    const double seconds = seconds_of(scan.end);
    Time shift = 0;
    for (const Fault& fault : faults) {
      if (!lasts(fault, seconds)) continue;
      if (fault.kind == FaultKind::lidar_outage) {
        if (!fault.empty_scans) return false;
        scan.points.clear();
      }
      if (fault.lidar_clock) shift += fault.clock_offset;
    }
    scan.start += shift;
    scan.end += shift;
    return true;
  }

  std::vector<Fault> faults;
  Time start;
  std::uint64_t seed;
  MagnetometerPose where;
  Time earliest_offset = 0;  // the largest backward shift of a stamp (≤ 0)
  std::map<std::pair<std::size_t, int>, Memory> memories;
  std::multimap<Time, Measurement> waiting;  // by stamp, then by arrival
  Time reached = std::numeric_limits<Time>::min() / 2;
  bool ended = false;
};

FaultInjector::FaultInjector(std::vector<Fault> faults, Time start, std::uint64_t seed, MagnetometerPose where)
    : implementation_(std::make_unique<Implementation>(std::move(faults), start, seed, std::move(where))) {}

FaultInjector::~FaultInjector() = default;

void FaultInjector::push(Measurement&& measurement) {
  Implementation& self = *implementation_;
  self.reached = completion_time(measurement);
  if (!std::visit([&](auto& each) { return self.apply_faults(each); }, measurement)) return;
  const Time stamp = completion_time(measurement);
  self.waiting.emplace(stamp, std::move(measurement));
}

void FaultInjector::end() {
  implementation_->ended = true;
}

bool FaultInjector::pop(Measurement& measurement) {
  Implementation& self = *implementation_;
  // Later measurements may be stamped as early as `reached` + `earliest_offset`; at equal stamps, arrival order
  // decides.
  if (self.waiting.empty() || (!self.ended && self.waiting.begin()->first > self.reached + self.earliest_offset))
    return false;
  measurement = std::move(self.waiting.begin()->second);
  self.waiting.erase(self.waiting.begin());
  return true;
}

}  // namespace lodestone::simulation
