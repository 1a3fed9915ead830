#include "frontends/synchronizer/survey.h"

#include <algorithm>

namespace lodestone {

FieldSurvey read_survey(MeasurementSource& source, const Trajectory& trajectory, const SensorSuite& suite, Time max_gap,
                        const std::function<void(Time)>& progress) {
  FieldSurvey survey;
  Measurement measurement;
  while (source.next(measurement)) {
    if (progress) progress(completion_time(measurement));
    const auto* sample = std::get_if<MagneticSample>(&measurement);
    if (sample == nullptr) continue;
    const std::optional<Pose> T_map_imu = interpolate(trajectory, sample->time, max_gap);
    if (!T_map_imu) {
      ++survey.without_pose;
      continue;
    }
    const MagnetometerModel& model = suite.magnetometers.at(static_cast<std::size_t>(sample->magnetometer));
    const Pose T_map_mag = *T_map_imu * model.T_imu_mag;
    survey.observations.push_back({T_map_mag.position, T_map_mag.rotation * sample->field_ut, model.noise_ut,
                                   sample->time, sample->magnetometer, T_map_mag.rotation});
  }
  return survey;
}

void append_drive(FieldSurvey& survey, FieldSurvey drive) {
  constexpr Time kPause = from_seconds(1.0);
  survey.without_pose += drive.without_pose;
  std::vector<FieldObservation>& all = survey.observations;
  if (!all.empty() && !drive.observations.empty()) {
    const auto earlier = [](const FieldObservation& a, const FieldObservation& b) { return a.time < b.time; };
    const auto [first, last] = std::minmax_element(all.begin(), all.end(), earlier);
    const auto [begin, end] = std::minmax_element(drive.observations.begin(), drive.observations.end(), earlier);
    if (begin->time <= last->time && end->time >= first->time) {
      const Time shift = last->time + kPause - begin->time;
      for (FieldObservation& observation : drive.observations) observation.time += shift;
    }
  }
  all.insert(all.end(), drive.observations.begin(), drive.observations.end());
}

}  // namespace lodestone
