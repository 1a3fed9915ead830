#include "localization/localization.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <utility>

#include "core/thread_limit.h"
#include "core/work_times.h"
#include "frontends/maps/ndt_map.h"
#include "localization/automatic_initialization.h"
#include "localization/initial_pose.h"

namespace lodestone {

namespace {

using NextBundle = std::function<bool(ScanBundle&)>;

/// An initial pose outside the cloud map can only fail.
void check_within_map(const Site& site, const Pose& pose, Time time, WarningLog& warnings) {
  const Vector3& p = pose.position;
  if (site.planes != nullptr) {
    double reach = 0.0;
    for (const LidarModel& lidar : site.platform.suite.lidars()) reach = std::max(reach, lidar.max_range_m);
    const auto map = site.planes->around(p);
    const bool seen = std::any_of(map->planes().begin(), map->planes().end(), [&](const Plane& plane) {
      return (plane.center.cast<double>() - p).squaredNorm() < reach * reach;
    });
    if (!seen) {
      bool has_plane = false;
      site.planes->for_each_voxel(
          [&](const Eigen::Vector3i&, const Plane* plane) { has_plane = has_plane || plane != nullptr; });
      if (!has_plane) {
        throw InputError(fmt::format(
            "{}: no voxel of {:g} m of this map holds a plane; expected metres, and at least six points in most voxels "
            "on a surface; correct the unit, use a denser cloud, or increase lidar.map.voxel_m",
            site.files.cloud, site.planes->voxel_m()));
      }
      throw InputError(fmt::format(
          "{}: this map has no plane within the LiDAR's range of {} m of the initial pose ({:.2f} {:.2f} {:.2f}); "
          "check --initial-pose and the map's frame",
          site.files.cloud, reach, p.x(), p.y(), p.z()));
    }
  }
  if (site.field != nullptr && !site.field->query(p, FieldInterpolation::bilinear)) {
    warnings.add("run.start_off_field",
                 fmt::format("at the initial pose ({:.2f} {:.2f} {:.2f}) there is no field in {}", p.x(), p.y(), p.z(),
                             site.files.magnetic),
                 time);
  }
}

/// Bundles that a search has seen, then the others.
class SeenBundles {
 public:
  explicit SeenBundles(const NextBundle& next) : next_(next) {}

  bool look(ScanBundle& bundle) {
    if (!next_(bundle)) return false;
    seen_.push_back(bundle);
    return true;
  }

  bool next(ScanBundle& bundle) {
    if (seen_.empty()) return next_(bundle);
    bundle = std::move(seen_.front());
    seen_.pop_front();
    return true;
  }

 private:
  const NextBundle& next_;
  std::deque<ScanBundle> seen_;
};

LocalizationResult localize_bundles(const NextBundle& next, const Site& site, const LocalizationTask& given,
                                    EstimateSink& sink, WarningLog& warnings) {
  const ThreadLimit limit(given.threads);
  LocalizationTask task = given;
  SeenBundles bundles(next);
  if (std::holds_alternative<SearchedPose>(task.initial_pose)) {
    task.initial_pose = find_initial_pose(
                            "the log", estimator_input(site, {}, nullptr),
                            [&](ScanBundle& bundle) { return bundles.look(bundle); }, warnings)
                            .start;
  }
  ProcessedBundles processed = process_bundles(
      [&](ScanBundle& bundle) { return bundles.next(bundle); },
      [&](const ScanBundle& first) { return estimator_at_start(site, task, first, warnings); }, sink, task.processed);
  processed.estimator->finish(sink);
  LocalizationResult result{processed.scans,   processed.begin,   processed.end,
                            processed.stopped, processed.failure, processed.estimator->solver(),
                            std::nullopt,      warnings};
  if (const CalibrationEstimate* calibration = processed.estimator->calibration()) result.calibration = *calibration;
  return result;
}

}  // namespace

LocalizationResult localize(const NextBundle& next, const Site& site, const LocalizationTask& task,
                            EstimateSink& sink) {
  WarningLog warnings = site.warnings;
  return localize_bundles(next, site, task, sink, warnings);
}

LocalizationResult localize(MeasurementSource& source, const Site& site, const LocalizationTask& task,
                            EstimateSink& sink) {
  WarningLog warnings = site.warnings;
  return localize_bundles(open_bundles(source, site, warnings).next, site, task, sink, warnings);
}

LocalizationResult localize(const std::string& log, const Site& site, const LocalizationTask& task,
                            EstimateSink& sink) {
  WarningLog warnings = site.warnings;
  return localize_bundles(open_bundles(log, site, warnings).next, site, task, sink, warnings);
}

std::optional<Pose> pose_at_start(const InitialPose& initial_pose, Time start, WarningLog& warnings) {
  if (const Pose* pose = std::get_if<Pose>(&initial_pose)) return *pose;
  if (const auto* found = std::get_if<StartHypothesis>(&initial_pose)) return found->T_map_imu;
  if (const auto* poses = std::get_if<PoseOfTrajectory>(&initial_pose)) {
    return initial_pose_from(poses->trajectory, poses->file, start);
  }
  if (std::holds_alternative<SearchedPose>(initial_pose)) return std::nullopt;
  warnings.add("run.initial_pose",
               "there is no initial pose: the map's origin is used; set --initial-pose or --initial-pose-from", start);
  return Pose{};
}

std::unique_ptr<Estimator> estimator_at_start(const Site& site, const LocalizationTask& task, const ScanBundle& first,
                                              WarningLog& warnings) {
  const std::optional<Pose> start = pose_at_start(task.initial_pose, first.scan.start, warnings);
  if (!start) throw std::invalid_argument("estimator_at_start: the initial pose has not been searched");
  check_within_map(site, *start, first.scan.start, warnings);
  EstimatorInput input = estimator_input(site, *start, &warnings);
  input.refining = task.refining;
  if (needs_scan_matcher(task.estimator) && !site.files.cloud.empty()) {
    input.matcher = load_ndt_map(site.files.cloud, site.options.ndt.registration, site.platform.suite.lidars(),
                                 warnings, site.files.origin_m);
  }
  if (const auto* poses = std::get_if<PoseOfTrajectory>(&task.initial_pose)) {
    input.initial_velocity = initial_velocity_from(poses->trajectory, first.scan.start);
  }
  if (const auto* found = std::get_if<StartHypothesis>(&task.initial_pose)) input = begin_at(*found, std::move(input));
  return make_estimator(task.estimator, input);
}

ProcessedBundles process_bundles(const NextBundle& next,
                                 const std::function<std::unique_ptr<Estimator>(const ScanBundle&)>& make_estimator,
                                 EstimateSink& sink, const std::function<bool(const ScanBundle&)>& processed) {
  ProcessedBundles result;
  const auto read = [&](ScanBundle& bundle) {
    const WorkTimer timer(Work::read);
    return next(bundle);
  };
  try {
    for (ScanBundle bundle; !result.stopped && read(bundle);) {
      if (result.estimator == nullptr) {
        result.estimator = make_estimator(bundle);
        result.begin = bundle.scan.start;
      }
      result.estimator->process_in_place(bundle, sink);
      ++result.scans;
      result.end = bundle.scan.end;
      result.stopped = processed && !processed(bundle);
    }
  } catch (const InputError& error) {
    if (result.estimator == nullptr) throw;
    result.failure = error;
  }
  if (result.estimator == nullptr) {
    throw InputError("the log has no scan between its first and last IMU sample; an estimate requires one");
  }
  return result;
}

}  // namespace lodestone
