#include "tools/evaluate/comparison.h"

#include <fmt/format.h>

#include <map>

#include "core/angles.h"
#include "core/error.h"
#include "core/evaluation/errors.h"
#include "frontends/configuration/kitti_trajectory.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/progress.h"
#include "tools/writers/covariance_file.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

std::vector<double> in_degrees(std::vector<double> radians) {
  for (double& value : radians) value *= degrees_per_radian;
  return radians;
}

std::string stamps_of(const Trajectory& trajectory) {
  return format_stamp(trajectory.front().time) + " to " + format_stamp(trajectory.back().time);
}

Trajectory read_compared(const ComparisonCall& call, const std::string& path) {
  Trajectory trajectory =
      !call.times.empty() && is_kitti_file(path) ? read_kitti(path, call.times) : read_trajectory(path);
  throw_if_interrupted();
  return trajectory;
}

PosePairs associate(const ComparisonCall& call, const Trajectory& estimate, const Trajectory& truth) {
  const PosePairs pairs = call.interpolate ? associate_interpolated(estimate, truth)
                                           : associate_nearest(estimate, truth, from_seconds(call.max_difference_s));
  if (pairs.empty()) {
    throw InputError(fmt::format(
        "{} and {}: no stamps match: they span {} s and {} s; check that both use one clock{}", call.estimate,
        call.truth, stamps_of(estimate), stamps_of(truth),
        call.interpolate ? fmt::format(", and that the ground truth has a pose every {} s", kLongestInterpolation_s)
                         : fmt::format(", or widen --max-difference (now {} s)", call.max_difference_s)));
  }
  return pairs;
}

/// Throws InputError if the trajectories are farther apart than any site: their coordinates differ.
void check_coordinates(const ComparisonCall& call, const PosePair& first) {
  const double apart_m = (first.estimate.position - first.truth.position).norm();
  if (apart_m < kSiteReach_m) return;
  throw InputError(
      fmt::format("{} and {}: the first poses are {:.0f} km apart: one of them is georeferenced; shift one "
                  "with `lodestone shift`, or use --align",
                  call.estimate, call.truth, apart_m / 1000.0));
}

RelationErrors measure(const std::string& name, const ComparisonCall& call, const PosePairs& pairs) {
  if (name == "translation") return {name, "m", translation_errors(pairs)};
  if (name == "angle") return {name, "deg", in_degrees(angle_errors(pairs))};
  if (name == "heading") return {name, "deg", in_degrees(heading_errors(pairs))};
  const bool metres = call.delta_unit == "metres";
  const auto segments = metres ? segments_by_distance(pairs, call.delta)
                               : segments_by_count(pairs.size(), static_cast<std::size_t>(call.delta), call.all_pairs);
  const auto errors = relative_errors(pairs, segments);
  const std::string title = fmt::format("{} ({:g} {})", name, call.delta,
                                        metres              ? "m"
                                        : call.delta == 1.0 ? "frame"
                                                            : "frames");
  return name == "rpe" ? RelationErrors{title, "m", translations_of(errors)}
                       : RelationErrors{title, "deg", in_degrees(angles_of(errors))};
}

Consistency measure_consistency(const ComparisonCall& call, const PosePairs& pairs, const Trajectory& estimate) {
  std::map<Time, Matrix6> by_time;
  for (const StampedCovariance& entry : read_covariances(call.covariance)) by_time[entry.time] = entry.covariance;
  PosePairs covered;
  std::vector<Matrix6> covariances;
  for (const PosePair& pair : pairs) {
    const auto found = by_time.find(estimate[pair.estimate_index].time);
    if (found == by_time.end()) continue;
    covered.push_back(pair);
    covariances.push_back(found->second);
  }
  if (covered.empty()) {
    throw InputError(fmt::format("{}: no row has the stamp of a pose of {}; use files of the same run", call.covariance,
                                 call.estimate));
  }
  return evaluate_consistency(covered, covariances);
}

void write_errors(const std::string& path, const PosePairs& pairs) {
  const auto translation = translation_errors(pairs);
  const auto angle = in_degrees(angle_errors(pairs));
  const auto heading = in_degrees(heading_errors(pairs));
  std::string text = "t_s,translation_m,angle_deg,heading_deg\n";
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    text += fmt::format("{},{:.9g},{:.9g},{:.9g}\n", format_stamp(pairs[i].time), translation[i], angle[i], heading[i]);
  }
  make_folder_of(path);
  write_text_file(path, text);
}

}  // namespace

const std::vector<std::string>& relation_names() {
  static const std::vector<std::string> names{"translation", "angle", "heading", "rpe", "rpe-angle"};
  return names;
}

Comparison compare(const ComparisonCall& call) {
  Comparison result;
  result.alignment = enumerator_of<Alignment>("--align", call.align);
  const bool whole = call.delta_unit == "metres" || call.delta == static_cast<double>(static_cast<long>(call.delta));
  if (!(call.delta > 0.0) || !whole) {
    throw InputError(fmt::format("--delta: expected {}, found {}",
                                 call.delta_unit == "metres" ? "a length above 0" : "a whole number of frames above 0",
                                 call.delta));
  }
  if (!(call.max_difference_s >= 0.0)) {
    throw InputError(fmt::format("--max-difference: expected seconds, at least 0, found {}", call.max_difference_s));
  }
  if (!call.covariance.empty() && result.alignment != Alignment::none) {
    throw InputError("--covariance: NEES requires poses without alignment; omit --align");
  }

  const Trajectory estimate = read_compared(call, call.estimate);
  const Trajectory truth = read_compared(call, call.truth);
  if (!call.times.empty() && !is_kitti_file(call.estimate) && !is_kitti_file(call.truth)) {
    throw InputError(
        fmt::format("--times: neither {} nor {} is in KITTI's format (12 numbers in each line); omit --times",
                    call.estimate, call.truth));
  }
  const PosePairs matched = associate(call, estimate, truth);
  if (result.alignment == Alignment::none) check_coordinates(call, matched.front());
  const auto similarity = find_alignment(matched, result.alignment);
  if (!similarity) {
    throw InputError(
        fmt::format("{}: the {} matched poses are on one line, so the rotation is undetermined; use "
                    "--align origin or none",
                    call.estimate, matched.size()));
  }
  const PosePairs pairs = align(*similarity, matched);
  result.estimate_poses = estimate.size();
  result.truth_poses = truth.size();
  result.pairs = pairs.size();
  result.similarity = *similarity;
  for (const std::string& name : call.relations.empty() ? relation_names() : call.relations) {
    throw_if_interrupted();
    RelationErrors relation = measure(name, call, pairs);
    if (!relation.errors.empty()) {
      result.relations.push_back(std::move(relation));
    } else if (!call.relations.empty()) {  // the table of all relations omits it
      throw InputError(fmt::format("{}: no segment of {} {} in {} matched poses; decrease --delta", call.estimate,
                                   call.delta, call.delta_unit, pairs.size()));
    }
  }
  if (!call.covariance.empty()) result.consistency = measure_consistency(call, pairs, estimate);
  if (!call.errors.empty()) write_errors(call.errors, pairs);
  return result;
}

}  // namespace lodestone
