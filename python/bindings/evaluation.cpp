#include <pybind11/stl.h>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "core/error.h"
#include "core/evaluation/alignment.h"
#include "core/evaluation/consistency.h"
#include "core/evaluation/errors.h"
#include "core/evaluation/statistics.h"
#include "frontends/configuration/options.h"

namespace lodestone::python {

namespace {

py::array_t<double> array_of_values(const std::vector<double>& values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

PosePairs associate(const Trajectory& estimate, const Trajectory& truth, bool interpolate, double max_difference_s) {
  PosePairs pairs = interpolate ? associate_interpolated(estimate, truth)
                                : associate_nearest(estimate, truth, from_seconds(max_difference_s));
  if (pairs.empty()) {
    throw InputError("no stamps of estimate and truth match; check that both use one clock, or widen max_difference_s");
  }
  return pairs;
}

/// Poses of an estimate and of the ground truth at the same times.
class Pairs {
 public:
  Pairs(const py::tuple& estimate, const py::tuple& truth, const std::string& alignment, bool interpolate,
        double max_difference_s)
      : pairs_(associate(trajectory_argument(estimate[0], estimate[1], estimate[2]),
                         trajectory_argument(truth[0], truth[1], truth[2]), interpolate, max_difference_s)) {
    const auto found = find_alignment(pairs_, enumerator_of<Alignment>("align", alignment));
    if (!found) {
      throw InputError(
          "align: the matched poses are on one line, so the rotation is undetermined; use align='origin' or "
          "'none'");
    }
    similarity_ = *found;
    pairs_ = align(similarity_, std::move(pairs_));
  }

  std::size_t size() const { return pairs_.size(); }
  double scale() const { return similarity_.scale; }
  py::array_t<double> transform() const {
    py::array_t<double> pose(7);
    write_pose({similarity_.rotation, similarity_.translation}, pose.mutable_data());
    return pose;
  }
  py::array_t<std::int64_t> stamps() const {
    return array_of<std::int64_t>(pairs_, 1, [](const PosePair& one, auto* out) { *out = one.time; });
  }
  py::array_t<std::int64_t> indices() const {
    return array_of<std::int64_t>(
        pairs_, 1, [](const PosePair& one, auto* out) { *out = static_cast<std::int64_t>(one.estimate_index); });
  }
  py::array_t<double> translations() const { return array_of_values(translation_errors(pairs_)); }
  py::array_t<double> angles() const { return array_of_values(angle_errors(pairs_)); }
  py::array_t<double> headings() const { return array_of_values(heading_errors(pairs_)); }

  /// Lengths, m, and angles, rad, of the errors of all segments.
  py::tuple relative(double delta, bool metres, bool all_pairs) const {
    const auto segments = metres ? segments_by_distance(pairs_, delta)
                                 : segments_by_count(pairs_.size(), static_cast<std::size_t>(delta), all_pairs);
    const std::vector<Pose> errors = relative_errors(pairs_, segments);
    return py::make_tuple(array_of_values(translations_of(errors)), array_of_values(angles_of(errors)));
  }

  /// `covariance`: (N, 6, 6), of the whole estimate.
  py::dict consistency(const py::object& covariance) const {
    const auto values = Array<double>::ensure(covariance);
    if (!values || values.ndim() != 3 || values.shape(1) != 6 || values.shape(2) != 6) {
      refuse_shape("covariance", "(N, 6, 6)", py::array::ensure(covariance));
    }
    std::vector<Matrix6> covariances;
    for (const PosePair& pair : pairs_) {
      const auto row = static_cast<py::ssize_t>(pair.estimate_index);
      if (row >= values.shape(0)) throw py::value_error("covariance: expected one for each pose of the estimate");
      covariances.push_back(Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(values.data(row, 0, 0)));
    }
    const Consistency found = evaluate_consistency(pairs_, covariances);
    py::dict result;
    result["count"] = found.count;
    result["singular"] = found.singular;
    result["pose"] = found.nees;
    result["rotation"] = found.nees_rotation;
    result["position"] = found.nees_position;
    result["low"] = found.nees_low;
    result["high"] = found.nees_high;
    result["share_within_95"] = found.share_within_95;
    return result;
  }

 private:
  PosePairs pairs_;
  Similarity similarity_;
};

py::dict summary_of(const py::object& errors) {
  const Array<double> array = column_argument<double>(errors, "errors");
  const std::vector<double> values(array.data(), array.data() + array.size());
  const ErrorStatistics statistics = summarize(values);
  py::dict result;
  result["count"] = statistics.count;
  result["rmse"] = statistics.rmse;
  result["mean"] = statistics.mean;
  result["median"] = statistics.median;
  result["95 %"] = values.empty() ? 0.0 : ErrorDistribution(values).quantile(0.95);
  result["max"] = statistics.max;
  result["std"] = statistics.standard_deviation;
  return result;
}

}  // namespace

void bind_evaluation(py::module_& module) {
  py::class_<Pairs>(module, "Pairs")
      .def(py::init<const py::tuple&, const py::tuple&, const std::string&, bool, double>(), py::arg("estimate"),
           py::arg("truth"), py::arg("align"), py::arg("interpolate"), py::arg("max_difference_s"))
      .def("__len__", &Pairs::size)
      .def_property_readonly("scale", &Pairs::scale)
      .def_property_readonly("transform", &Pairs::transform)
      .def_property_readonly("stamp_ns", &Pairs::stamps)
      .def_property_readonly("estimate_index", &Pairs::indices)
      .def("translations", &Pairs::translations)
      .def("angles", &Pairs::angles)
      .def("headings", &Pairs::headings)
      .def("relative", &Pairs::relative, py::arg("delta"), py::arg("metres"), py::arg("all_pairs"))
      .def("consistency", &Pairs::consistency, py::arg("covariance"));
  module.def("summary_of", &summary_of, py::arg("errors"));
}

}  // namespace lodestone::python
