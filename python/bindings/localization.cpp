#include "localization/localization.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <exception>

#include "bindings/bindings.h"
#include "bindings/estimates.h"
#include "bindings/interrupts.h"
#include "bindings/measurements.h"
#include "bindings/warning_list.h"
#include "frontends/synchronizer/bag_source.h"
#include "localization/initial_pose.h"
#include "localization/measurement_list.h"

namespace lodestone::python {

namespace {

/// None: the map's origin; "auto": a search; "x y z qx qy qz qw" or an array (7,): a pose; a tuple of arrays: a
/// trajectory.
InitialPose initial_pose_of(const py::object& argument) {
  if (argument.is_none()) return MapOrigin{};
  if (py::isinstance<py::str>(argument)) {
    const auto text = argument.cast<std::string>();
    if (text == "auto") return SearchedPose{};
    return parse_initial_pose(text);
  }
  if (py::isinstance<py::tuple>(argument) && py::len(argument) == 3) {
    const auto arrays = argument.cast<py::tuple>();
    return PoseOfTrajectory{trajectory_argument(arrays[0], arrays[1], arrays[2]), "the trajectory of initial_pose"};
  }
  return pose_argument(argument, "initial_pose");
}

/// Whether a callback asks to continue: any result but False of Python or numpy.
bool goes_on(const py::object& result) {
  py::detail::make_caster<bool> boolean;
  return !boolean.load(result, /*convert=*/false) || static_cast<bool>(boolean);
}

/// One call of localize: the interpreter lock is released except in callbacks.
class Run {
 public:
  Run(const Site& site, const std::string& estimator, const py::object& initial_pose, int threads, py::object progress,
      py::object refining)
      : site_(site), progress_(std::move(progress)), refining_(std::move(refining)) {
    task_.estimator = estimator;
    task_.initial_pose = initial_pose_of(initial_pose);
    task_.threads = threads;
    task_.processed = [this](const ScanBundle& bundle) { return continue_log(bundle); };
    task_.refining = [this](double share) { return continue_refinement(share); };
  }

  void localize(MeasurementSource& source) {
    begin_ = source.begin_time();
    end_ = source.end_time();
    result_ = lodestone::localize(source, site_, task_, estimates_);
    // An exception must not pass through the solver, so it is kept until here.
    if (refinement_error_) std::rethrow_exception(refinement_error_);
  }

  /// `reader`: warnings of the log's reader.
  py::dict result(const WarningLog& reader) const {
    WarningLog warnings = result_.warnings;
    for (const auto& [kind, entry] : reader.entries()) {
      warnings.add(kind, entry.first_detail, entry.first_time, entry.count);
      warnings.add(kind, entry.first_detail, entry.last_time, 0);
    }
    py::dict values;
    values["causal"] = arrays_of(estimates_.causal_estimates);
    values["smoothed"] = arrays_of(estimates_.smoothed_estimates);
    values["best"] = arrays_of(estimates_.best_estimates);
    values["diagnostics"] = diagnostics_of(estimates_.causal_estimates);
    values["scans"] = result_.scans;
    values["begin_ns"] = result_.begin;
    values["end_ns"] = result_.end;
    values["stopped"] = result_.stopped;
    values["failure"] = result_.failure ? py::object(py::str(result_.failure->what())) : py::object(py::none());
    values["solver"] = result_.solver;
    values["calibration"] =
        result_.calibration ? py::object(dict_of(*result_.calibration, site_.platform.suite)) : py::object(py::none());
    values["warnings"] = list_of(warnings);
    return values;
  }

 private:
  bool continue_log(const ScanBundle& bundle) {
    const py::gil_scoped_acquire locked;
    Interrupts::throw_if_signalled();
    if (progress_.is_none()) return true;
    const double length = to_seconds(end_ - begin_);
    const double done = length > 0.0 ? std::clamp(to_seconds(bundle.scan.end - begin_) / length, 0.0, 1.0) : 0.0;
    return goes_on(progress_(done, bundle.scan.end));
  }

  bool continue_refinement(double share) {
    const py::gil_scoped_acquire locked;
    try {
      Interrupts::throw_if_signalled();
      return refining_.is_none() || goes_on(refining_(share));
    } catch (...) {
      refinement_error_ = std::current_exception();
      return false;
    }
  }

  const Site& site_;
  py::object progress_;
  py::object refining_;
  LocalizationTask task_;
  EstimateCollector estimates_;
  LocalizationResult result_;
  Time begin_ = 0;
  Time end_ = 0;
  std::exception_ptr refinement_error_;
};

py::dict localize_log(const std::string& log, const std::shared_ptr<Site>& site, const std::string& estimator,
                      const py::object& initial_pose, int threads, py::object progress, py::object refining) {
  Run run(*site, estimator, initial_pose, threads, std::move(progress), std::move(refining));
  WarningLog warnings;
  {
    const py::gil_scoped_release unlocked;
    BagSource source(log, site->platform, warnings, site->sensors);
    run.localize(source);
  }
  return run.result(warnings);
}

py::dict localize_measurements(const Measurements& measurements, const std::shared_ptr<Site>& site,
                               const std::string& estimator, const py::object& initial_pose, int threads,
                               py::object progress, py::object refining) {
  Run run(*site, estimator, initial_pose, threads, std::move(progress), std::move(refining));
  // Copied with the lock held: other threads may add measurements during the run.
  std::vector<Measurement> used = measurements.used_at(*site);
  {
    const py::gil_scoped_release unlocked;
    MeasurementList list(std::move(used), site->platform.suite);
    run.localize(list);
  }
  return run.result({});
}

}  // namespace

void bind_localization(py::module_& module) {
  module.def("localize_log", &localize_log, py::arg("log"), py::arg("site").none(false), py::arg("estimator"),
             py::arg("initial_pose"), py::arg("threads"), py::arg("progress"), py::arg("refining"));
  module.def("localize_measurements", &localize_measurements, py::arg("measurements"), py::arg("site").none(false),
             py::arg("estimator"), py::arg("initial_pose"), py::arg("threads"), py::arg("progress"),
             py::arg("refining"));
  module.def("estimator_names", &estimator_names, "Names of all estimators, the default first.");
}

}  // namespace lodestone::python
