#include "estimators/calibration/calibration_log.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "core/imu/preintegration.h"

namespace lodestone {

namespace {

constexpr Time kLongestImuGap = from_seconds(0.1);
constexpr Time kLongestPoseGap = from_seconds(0.25);

std::size_t stride_of(const ArrayLog& readings, const CalibrationOptions& options) {
  const auto most = static_cast<std::size_t>(options.max_moments);
  return std::max<std::size_t>(1, (readings.size() + most - 1) / most);
}

CalibrationLog empty_log(const SensorSuite& suite) {
  CalibrationLog log;
  log.magnetometers = suite.magnetometers;
  for (const MagnetometerModel& model : suite.magnetometers) {
    log.centre_m += model.T_imu_mag.position / static_cast<double>(suite.magnetometers.size());
  }
  return log;
}

MomentReading reading_of(const ArrayLog::Reading& reading, std::size_t magnetometer, const MagnetometerModel& model) {
  MomentReading result;
  result.magnetometer = static_cast<int>(magnetometer);
  result.measured_ut = reading.field_ut.cast<double>();
  const double median_variance = reading.samples > 2 ? ArrayLog::median_variance : 1.0;
  result.sigma_ut = model.noise_ut * std::sqrt(median_variance / reading.samples);
  return result;
}

CalibrationMoment moment_of(const ArrayLog& readings, std::size_t index, const SensorSuite& suite) {
  CalibrationMoment moment;
  moment.time = readings.time(index);
  for (std::size_t j = 0; j < suite.magnetometers.size(); ++j) {
    const ArrayLog::Reading& reading = readings.reading(index, j);
    if (reading.samples > 0) moment.readings.push_back(reading_of(reading, j, suite.magnetometers[j]));
  }
  return moment;
}

/// Number of passes of the array through the place of each moment. The map's error is the same in each pass, so all
/// passes together have the information of one. Places are cells of `cell_m`; between two passes the array is in other
/// cells.
class Passes {
 public:
  explicit Passes(double cell_m) : cell_m_(cell_m) {}

  /// The index of the place's cell, in the order of the first visits.
  std::size_t enter(const Vector3& place) {
    const std::size_t cell = cells_.try_emplace(cell_of(place), cells_.size()).first->second;
    passes_.resize(cells_.size(), 0);
    if (cell != last_) ++passes_[cell];
    last_ = cell;
    return cell;
  }

  double of(std::size_t cell) const { return passes_[cell]; }
  std::size_t cells() const { return passes_.size(); }

 private:
  using Cell = std::array<int, 3>;
  Cell cell_of(const Vector3& place) const {
    Cell cell;
    for (int i = 0; i < 3; ++i) cell[static_cast<std::size_t>(i)] = static_cast<int>(std::floor(place[i] / cell_m_));
    return cell;
  }

  double cell_m_;
  std::map<Cell, std::size_t> cells_;
  std::vector<int> passes_;
  std::size_t last_ = std::numeric_limits<std::size_t>::max();
};

/// IMU samples from `begin` to `end`, both included and interpolated; empty if there is a gap.
std::optional<std::vector<ImuSample>> samples_between(const std::vector<ImuSample>& imu, Time begin, Time end) {
  const auto later = [](Time time, const ImuSample& sample) { return time < sample.time; };
  auto after = std::upper_bound(imu.begin(), imu.end(), begin, later);
  std::vector<ImuSample> samples;
  const auto take = [&](Time time, const auto& next) {
    const ImuSample& a = *(next - 1);
    const ImuSample& b = *next;
    if (b.time - a.time > kLongestImuGap) return false;
    const double share = to_seconds(time - a.time) / to_seconds(b.time - a.time);
    samples.push_back({time, a.angular_velocity + share * (b.angular_velocity - a.angular_velocity),
                       a.linear_acceleration + share * (b.linear_acceleration - a.linear_acceleration)});
    return true;
  };
  if (after == imu.begin() || after == imu.end() || !take(begin, after)) return std::nullopt;
  for (; after != imu.end() && after->time < end; ++after) {
    if (after->time - (after - 1)->time > kLongestImuGap) return std::nullopt;
    samples.push_back(*after);
  }
  if (after == imu.end() || !take(end, after)) return std::nullopt;
  return samples;
}

}  // namespace

CalibrationLog turning_log(const ArrayLog& readings, const std::vector<ImuSample>& imu, const SensorSuite& suite,
                           const CalibrationOptions& options) {
  CalibrationLog log = empty_log(suite);
  const std::size_t stride = stride_of(readings, options);
  for (std::size_t i = 0; i < readings.size(); i += stride) {
    CalibrationMoment moment = moment_of(readings, i, suite);
    if (moment.readings.empty()) continue;
    if (!log.moments.empty()) {
      if (const auto samples = samples_between(imu, log.moments.back().time, moment.time)) {
        const Preintegration turn(*samples, Vector3::Zero(), Vector3::Zero(), suite.imu);
        moment.follows = true;
        moment.turn = turn.corrected(Vector3::Zero(), Vector3::Zero(), turn.axes()).rotation;
        moment.turn_by_bias = turn.rotation_by_gyroscope_bias();
        moment.turn_sigma = std::sqrt(turn.covariance().diagonal().head<3>().mean());
      } else {
        ++log.without_motion;
      }
    }
    log.moments.push_back(std::move(moment));
  }
  return log;
}

CalibrationLog mapped_log(const ArrayLog& readings, const Trajectory& trajectory, const MagneticMap& map,
                          const SensorSuite& suite, const CalibrationOptions& options) {
  CalibrationLog log = empty_log(suite);
  log.mapped = true;
  const double turn_sigma = options.rotation_sigma_deg * std::numbers::pi / 180.0;
  const std::size_t stride = stride_of(readings, options);
  std::optional<Pose> last;
  Passes passes(2.0 * options.map_correlation_m);
  for (std::size_t i = 0; i < readings.size(); i += stride) {
    CalibrationMoment moment = moment_of(readings, i, suite);
    const std::optional<Pose> T_map_imu = interpolate(trajectory, moment.time, kLongestPoseGap);
    if (!T_map_imu) {
      if (!moment.readings.empty()) ++log.without_motion;
      continue;
    }
    double variance = 0.0;
    const auto off_map = [&](MomentReading& reading) {
      const Vector3 place =
          *T_map_imu * suite.magnetometers[static_cast<std::size_t>(reading.magnetometer)].T_imu_mag.position;
      const std::optional<FieldValue> field = map.query(place, FieldInterpolation::bicubic);
      if (!field) return true;
      reading.known_ut = T_map_imu->rotation.conjugate() * field->field_ut;
      variance += std::pow(std::max(field->sigma_ut, options.map_sigma_floor_ut), 2) +
                  std::pow(options.position_sigma_m, 2) * field->gradient.squaredNorm() / 3.0 +
                  std::pow(turn_sigma, 2) * field->field_ut.squaredNorm() * 2.0 / 3.0;
      return false;
    };
    log.off_map += static_cast<std::size_t>(std::erase_if(moment.readings, off_map));
    if (moment.readings.empty()) continue;
    moment.map_sigma_ut = std::sqrt(variance / static_cast<double>(moment.readings.size()));
    if (last) {
      moment.follows = true;
      moment.turn = (last->rotation.conjugate() * T_map_imu->rotation).normalized();
      moment.moved_m = (*T_map_imu * log.centre_m - *last * log.centre_m).norm();
    }
    last = T_map_imu;
    moment.T_map_centre = {T_map_imu->rotation, *T_map_imu * log.centre_m};
    moment.place = passes.enter(moment.T_map_centre.position);
    log.moments.push_back(std::move(moment));
  }
  log.places = passes.cells();
  for (CalibrationMoment& moment : log.moments) {
    moment.passes = passes.of(moment.place);
    moment.map_sigma_ut *= std::sqrt(moment.passes);
  }
  return log;
}

}  // namespace lodestone
