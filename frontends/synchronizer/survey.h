#pragma once

#include <functional>

#include "core/geometry/trajectory.h"
#include "core/mapping/field_survey.h"
#include "core/measurement_source.h"
#include "core/sensor_suite.h"

namespace lodestone {

/// Observations of a survey, as input of the field regression.
struct FieldSurvey {
  std::vector<FieldObservation> observations;  ///< in order of the log
  std::int64_t without_pose = 0;               ///< discarded readings outside the trajectory or in one of its gaps
};

/// Rotates every magnetometer reading of `source` to the map frame, B_map = R R_IMj B_j, with the position p + R ℓ_j,
/// by the trajectory (T_map_imu) interpolated at the reading's time. If the neighbouring poses are more than `max_gap`
/// (ns) apart, the reading is discarded and counted. `progress` is called with each measurement's time.
FieldSurvey read_survey(MeasurementSource& source, const Trajectory& trajectory, const SensorSuite& suite, Time max_gap,
                        const std::function<void(Time)>& progress = {});

/// Appends another drive to a survey, so that both form one. If the times of the drives overlap (two robots, or a clock
/// that starts at zero), those of the appended drive are moved behind the others: held-out blocks are stretches of way
/// in order of time.
void append_drive(FieldSurvey& survey, FieldSurvey drive);

}  // namespace lodestone
