#include <pybind11/stl.h>

#include "bindings/bindings.h"
#include "bindings/interrupts.h"
#include "bindings/measurements.h"
#include "bindings/warning_list.h"
#include "core/mapping/magnetic_map_builder.h"
#include "core/thread_limit.h"
#include "frontends/configuration/options.h"
#include "frontends/synchronizer/bag_source.h"
#include "frontends/synchronizer/survey.h"
#include "localization/measurement_list.h"

namespace lodestone::python {

namespace {

constexpr SensorChoice magnetometers_only{.lidar = false, .imu = false, .magnetometers = true, .wheels = false};

/// Arrays of a survey: position_m (N, 3), field_ut (N, 3), noise_ut (N,), stamp_ns (N,), readings without a pose,
/// magnetometer (N,), quaternion_xyzw (N, 4).
py::tuple survey_arrays(const FieldSurvey& survey) {
  const auto& all = survey.observations;
  return py::make_tuple(
      array_of<double>(all, 3, [](const FieldObservation& one, double* out) { write_vector(one.position, out); }),
      array_of<double>(all, 3, [](const FieldObservation& one, double* out) { write_vector(one.field_ut, out); }),
      array_of<double>(all, 1, [](const FieldObservation& one, double* out) { *out = one.noise_ut; }),
      array_of<std::int64_t>(all, 1, [](const FieldObservation& one, auto* out) { *out = one.time; }),
      survey.without_pose,
      array_of<std::int64_t>(all, 1, [](const FieldObservation& one, auto* out) { *out = one.magnetometer; }),
      array_of<double>(all, 4, [](const FieldObservation& one, double* out) {
        for (int i = 0; i < 4; ++i) out[i] = one.R_map_mag.coeffs()(i);
      }));
}

/// `magnetometer` and `quaternion_xyzw` may be None.
FieldSurvey survey_of(const py::object& position_m, const py::object& field_ut, const py::object& noise_ut,
                      const py::object& stamp_ns, const py::object& magnetometer, const py::object& quaternion_xyzw) {
  const Array<double> positions = table_argument<double>(position_m, "position_m", 3);
  const Array<double> field = table_argument<double>(field_ut, "field_ut", 3);
  const Array<double> noise = column_argument<double>(noise_ut, "noise_ut");
  const Array<std::int64_t> stamps = integers_argument(stamp_ns, "stamp_ns");
  require_rows(positions, "position_m", stamps.shape(0));
  require_rows(field, "field_ut", stamps.shape(0));
  require_rows(noise, "noise_ut", stamps.shape(0));
  FieldSurvey survey;
  survey.observations.reserve(static_cast<std::size_t>(stamps.shape(0)));
  for (py::ssize_t i = 0; i < stamps.shape(0); ++i) {
    survey.observations.push_back({vector_at(positions, i), vector_at(field, i), noise.at(i), stamps.at(i)});
  }
  if (magnetometer.is_none() || quaternion_xyzw.is_none()) return survey;
  const Array<std::int64_t> numbers = integers_argument(magnetometer, "magnetometer");
  const Array<double> quaternions = table_argument<double>(quaternion_xyzw, "quaternion_xyzw", 4);
  require_rows(numbers, "magnetometer", stamps.shape(0));
  require_rows(quaternions, "quaternion_xyzw", stamps.shape(0));
  for (py::ssize_t i = 0; i < stamps.shape(0); ++i) {
    FieldObservation& one = survey.observations[static_cast<std::size_t>(i)];
    one.magnetometer = static_cast<int>(numbers.at(i));
    one.R_map_mag.coeffs() = Eigen::Map<const Eigen::Vector4d>(quaternions.data(i, 0));
  }
  return survey;
}

FieldSurvey read_with(MeasurementSource& source, const Trajectory& trajectory, const Platform& platform,
                      double max_gap_s) {
  Interrupts interrupts;
  return read_survey(source, trajectory, platform.suite, from_seconds(max_gap_s), [&](Time) { interrupts.check(); });
}

py::tuple survey_of_log(const std::string& path, const Platform& platform, const py::object& stamp_ns,
                        const py::object& position_m, const py::object& quaternion_xyzw, double max_gap_s) {
  const Trajectory trajectory = trajectory_argument(stamp_ns, position_m, quaternion_xyzw);
  WarningLog warnings;
  FieldSurvey survey;
  {
    const py::gil_scoped_release unlocked;
    BagSource source(path, platform, warnings, magnetometers_only, LogPause::is_bridged);
    survey = read_with(source, trajectory, platform, max_gap_s);
  }
  return py::make_tuple(survey_arrays(survey), list_of(warnings));
}

py::tuple survey_of_measurements(const Measurements& measurements, const py::object& stamp_ns,
                                 const py::object& position_m, const py::object& quaternion_xyzw, double max_gap_s) {
  const Trajectory trajectory = trajectory_argument(stamp_ns, position_m, quaternion_xyzw);
  std::vector<Measurement> readings;
  for (const MagneticSample* one : measurements.all<MagneticSample>()) readings.emplace_back(*one);
  FieldSurvey survey;
  {
    const py::gil_scoped_release unlocked;
    MeasurementList list(std::move(readings), measurements.platform().suite);
    survey = read_with(list, trajectory, measurements.platform(), max_gap_s);
  }
  return py::make_tuple(survey_arrays(survey), py::list());
}

py::object score_dict(const std::optional<HeldOutScore>& score) {
  if (!score) return py::none();
  py::dict result;
  result["cells"] = score->cells;
  result["refused"] = score->refused;
  result["rms_ut"] = array_of(score->rms_ut);
  result["normalized_rms"] = array_of(score->normalized_rms);
  return result;
}

/// `surveys`: (position_m, field_ut, noise_ut, stamp_ns, magnetometer, quaternion_xyzw) of each drive.
py::dict build_field_map(const py::list& surveys, const std::vector<std::string>& settings,
                         const std::vector<std::string>& configurations, int threads) {
  FieldSurvey all;
  for (const py::handle& one : surveys) {
    const auto arrays = one.cast<py::tuple>();
    append_drive(all, survey_of(arrays[0], arrays[1], arrays[2], arrays[3], arrays[4], arrays[5]));
  }
  std::optional<MagneticMapResult> result;
  std::optional<HeldOutScore> score;
  MagneticMapOptions options;
  {
    const py::gil_scoped_release unlocked;
    load_options(load_configuration(configurations, settings), options);
    const ThreadLimit limit(threads);
    result = build_magnetic_map(all.observations, options);
    score = score_held_out_blocks(all.observations, *result, options);
  }
  py::dict values;
  values["magnetic_map"] = std::make_shared<MagneticMap>(result->map);
  values["cells"] = result->cells;
  values["nodes"] = result->nodes;
  values["median_sigma_ut"] = result->median_sigma_ut;
  values["high_sigma_ut"] = result->high_sigma_ut;
  values["drive_sigma_ut"] = array_of(result->fit.drive.sigma_ut);
  values["drive_position_sigma_m"] = result->fit.drive.position_sigma_m;
  values["offsets_ut"] = array_of<double>(result->errors.offsets_ut, 3,
                                          [](const Vector3& offset, double* out) { write_vector(offset, out); });
  values["clock_s"] = result->errors.clock_s;
  values["held_out"] = score_dict(score);
  return values;
}

}  // namespace

void bind_field_surveys(py::module_& module) {
  module.def("survey_of_log", &survey_of_log, py::arg("path"), py::arg("platform"), py::arg("stamp_ns"),
             py::arg("position_m"), py::arg("quaternion_xyzw"), py::arg("max_gap_s"));
  module.def("survey_of_measurements", &survey_of_measurements, py::arg("measurements"), py::arg("stamp_ns"),
             py::arg("position_m"), py::arg("quaternion_xyzw"), py::arg("max_gap_s"));
  module.def("build_magnetic_map", &build_field_map, py::arg("surveys"), py::arg("settings"), py::arg("configurations"),
             py::arg("threads"));
  module.def(
      "list_map_options", []() { return list_options(MagneticMapOptions{}); },
      "All options of build_magnetic_map: one line for each, with default, type and meaning.");
}

}  // namespace lodestone::python
