#include "tools/check/initial_pose_checks.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "core/angles.h"
#include "core/lidar/plane_map.h"
#include "estimators/initialization/scan_registration.h"
#include "estimators/initialization/start_scan.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/check/imu_checks.h"
#include "tools/check/vector_series.h"

namespace lodestone {
namespace {

constexpr double good_share = 0.6;  // below, another place may fit better; edges and furniture never fit
constexpr double low_share = 0.38;
constexpr double poor_share = 0.28;
constexpr double clearly_better = 0.15;  // smallest difference of shares between T_imu_lidar and its inverse
constexpr double cost_ratio = 0.5;
constexpr double clearly_lower = 0.9;  // largest relative cost at which a fit farther away is preferred
constexpr double search_step_m = 0.35;
constexpr int search_places = 5;  // per side of the search grid
constexpr double near_m = 0.25;   // a larger error of the initial pose spoils the first scans
constexpr double near_deg = 2.0;
constexpr double same_share = 0.05;  // fits within this difference are equally good
constexpr double exact_m = 0.08;     // an initial pose with a smaller error is right
constexpr double exact_deg = 0.7;
constexpr double tilt_deg = 2.5;         // at rest; includes the accelerometer's bias
constexpr double moving_tilt_deg = 6.0;  // driving off; 2.5 m/s within the interval are 3 degrees
constexpr double floor_tilt_deg = 2.0;
constexpr double gravity_span_s = 5.0;  // if the robot does not rest at the begin
constexpr double rest_within_s = 2.0;
constexpr double rest_motion_m = 0.02;  // odometry at rest; 2.5 degrees of acceleration move half a second by 0.05 m

struct Up {
  Vector3 direction;  ///< imu frame
  bool at_rest = false;
};

/// Whether the scans observe standstill throughout the span. The IMU alone does not distinguish rest from steady
/// acceleration.
bool scans_rest(const ScanOdometry& odometry, const RestSpan& span) {
  if (odometry.first_degenerate && *odometry.first_degenerate <= span.end) return false;
  const StampedPose* first = nullptr;
  int scans = 0;
  for (const StampedPose& pose : odometry.poses) {
    if (pose.time < span.begin || pose.time > span.end) continue;
    if (first == nullptr) first = &pose;
    if ((pose.pose.position - first->pose.position).norm() > rest_motion_m) return false;
    ++scans;
  }
  return scans > 1;
}

/// The direction opposite to gravity at the first sample.
Up up_at_begin(const LogSample& sample, const ScanOdometry& odometry) {
  const Time begin = sample.imu.front().time;
  const std::optional<RestSpan> rest = calmest_span(sample.imu);
  if (rest && rest->at_rest && to_seconds(rest->begin - begin) < rest_within_s)
    return {rest->linear_acceleration.normalized(), scans_rest(odometry, *rest)};
  std::size_t count = 0;
  while (count < sample.imu.size() && to_seconds(sample.imu[count].time - begin) < gravity_span_s) ++count;
  return {mean_up(std::span(sample.imu).first(count)), false};
}

/// Registration of the first scan to the map with one T_imu_lidar.
struct Fit {
  ScanAgreement registered;
  Pose T_map_imu;
  double moved_m = 0.0;
  double turned_deg = 0.0;
};

class InitialPoseCheck {
 public:
  explicit InitialPoseCheck(const InitialPoseInputs& inputs)
      : inputs_(inputs), map_(inputs.map.around(inputs.start.position)), file_(inputs.platform.file_name()) {}

  Findings run() {
    const Pose& T_imu_lidar = inputs_.platform.suite.lidar.T_imu_lidar;
    const Fit given = fit_with(T_imu_lidar);
    const Fit inverse = fit_with(T_imu_lidar.inverse());
    const bool inverse_fits = inverse.registered.share > poor_share &&
                              (inverse.registered.share > given.registered.share + clearly_better ||
                               inverse.registered.cost < cost_ratio * given.registered.cost) &&
                              inverse.moved_m < 1.5 * near_m;
    if (inverse_fits) {
      add(Severity::error, "extrinsic.inverse",
          fmt::format("{:.0f} % of the first scan are on the map with the given T_imu_lidar, {:.0f} % with its inverse",
                      100.0 * given.registered.share, 100.0 * inverse.registered.share),
          "invert lidar.T_imu_lidar in " + file_ + " (T_imu_lidar transforms points from lidar to imu)");
      return findings_;
    }
    if (given.registered.share < good_share && fits_elsewhere(given)) return findings_;
    if (given.registered.share < low_share) {
      add(given.registered.share < poor_share ? Severity::error : Severity::warning, "start.no_overlap",
          overlap_text(given) + (inputs_.find_anywhere ? ", and no clearly better place was found" : ""),
          "check site, unit (metres) and axes (z up) of --cloud, --initial-pose, or lidar.T_imu_lidar in " + file_);
    } else {
      add(Severity::note, "start.overlap",
          fmt::format("{:.0f} % of the first scan are on the map, {:.2f} m and {:.1f} deg from the initial pose",
                      100.0 * given.registered.share, given.moved_m, given.turned_deg),
          "");
      if ((given.moved_m > near_m || given.turned_deg > near_deg) && fits_at_initial_pose(inverse, given)) {
        // A wrong initial pose could cause the same offset by chance. Therefore a warning, not an error.
        add(Severity::warning, "extrinsic.inverse",
            fmt::format(
                "the scan fits {:.2f} m and {:.1f} deg from the initial pose with the given T_imu_lidar, {:.2f} m and "
                "{:.1f} deg with its inverse",
                given.moved_m, given.turned_deg, inverse.moved_m, inverse.turned_deg),
            fmt::format("invert lidar.T_imu_lidar in {} (T_imu_lidar transforms points from lidar to imu); if it is "
                        "right, set --initial-pose \"{}\"",
                        file_, pose_text(given.T_map_imu, inputs_.origin_m)));
      } else if (given.moved_m > near_m || given.turned_deg > near_deg) {
        add(Severity::warning, "start.off",
            fmt::format("the scan fits {:.2f} m and {:.1f} deg from the initial pose", given.moved_m, given.turned_deg),
            fmt::format("set --initial-pose \"{}\"; if the initial pose is right, correct the translation of "
                        "lidar.T_imu_lidar in {}",
                        pose_text(given.T_map_imu, inputs_.origin_m), file_));
      }
    }
    if (given.registered.share > poor_share) check_level(given.T_map_imu);
    return findings_;
  }

 private:
  void add(Severity severity, const std::string& kind, const std::string& seen, const std::string& change) {
    findings_.push_back({severity, kind, seen, change, inputs_.odometry.poses.front().time});
  }

  Fit fit_with(const Pose& T_imu_lidar) const {
    LidarModel lidar = inputs_.platform.suite.lidar;
    lidar.T_imu_lidar = T_imu_lidar;
    // A single scan from an inaccurate pose requires wider gates than an estimator that knows its pose.
    AssociationOptions association;
    association.map_error_repeats = 30.0;
    association.surface_roughness_m = 0.005;
    std::vector<Eigen::Vector3f> points;
    for (const Eigen::Vector3f& point : inputs_.odometry.first_scan) {
      points.push_back((T_imu_lidar * point.cast<double>()).cast<float>());
    }
    Fit fit;
    fit.T_map_imu = inputs_.start;
    fit.registered = agreement(points, inputs_.start, *map_);
    // Association works up to a third of a metre; an initial pose may be worse.
    // The initial pose first, then a grid around it.
    for (int i = 0; i < search_places * search_places; ++i) {
      const int place = (i + search_places * search_places / 2) % (search_places * search_places);
      Pose from = inputs_.start;
      from.position += search_step_m * Vector3(place % search_places - search_places / 2,
                                               place / search_places - search_places / 2, 0.0);
      const Pose pose = register_scan(points, from, *map_, lidar, association).T_map_imu;
      const ScanAgreement found = agreement(points, pose, *map_);
      if (found.cost > (i == 0 ? 1.0 : clearly_lower) * fit.registered.cost) continue;
      fit.T_map_imu = pose;
      fit.registered = found;
    }
    const Vector6 step = fit.T_map_imu.boxminus(inputs_.start);
    fit.turned_deg = step.head<3>().norm() * degrees_per_radian;
    fit.moved_m = step.tail<3>().norm();
    return fit;
  }

  static bool fits_at_initial_pose(const Fit& fit, const Fit& other) {
    return fit.registered.share > other.registered.share - same_share && fit.moved_m < exact_m &&
           fit.turned_deg < exact_deg;
  }

  std::string overlap_text(const Fit& given) const {
    const Vector3 at = inputs_.start.position + inputs_.origin_m;
    return fmt::format("only {:.0f} % of the first scan are on the map at the initial pose ({:.2f} {:.2f} {:.2f})",
                       100.0 * given.registered.share, at.x(), at.y(), at.z());
  }

  /// True if the scan fits clearly better at another place.
  bool fits_elsewhere(const Fit& given) {
    const std::optional<PlaceOnMap> place = inputs_.find_anywhere ? inputs_.find_anywhere() : std::nullopt;
    if (!place || place->share < given.registered.share + clearly_better || place->share < low_share) return false;
    const Vector6 step = place->T_map_imu.boxminus(inputs_.start);
    add(Severity::error, "start.wrong",
        fmt::format("{}; {:.0f} % are on the map {:.2f} m and {:.1f} deg away{}", overlap_text(given),
                    100.0 * place->share, step.tail<3>().norm(), step.head<3>().norm() * degrees_per_radian,
                    place->sure ? "" : ", and possibly at other places"),
        fmt::format("set --initial-pose \"{}\"; if the initial pose is right, check the map's frame",
                    pose_text(place->T_map_imu, inputs_.origin_m)));
    return true;
  }

  void check_level(const Pose& T_map_imu) {
    if (inputs_.sample.imu.empty()) return;
    const Up up = up_at_begin(inputs_.sample, inputs_.odometry);
    const double tilt = degrees_per_radian * angle_between_rad(T_map_imu.rotation * up.direction, Vector3::UnitZ());
    if (tilt > 90.0) {
      add(Severity::error, "imu.upside_down", fmt::format("gravity points up ({:.0f} deg from the map's -z)", tilt),
          "at rest, the accelerometer must read +g upwards; check the IMU's axes and lidar.T_imu_lidar");
    } else if (tilt > (up.at_rest ? tilt_deg : moving_tilt_deg)) {
      add(Severity::error, "start.tilt",
          fmt::format("with the scan on the map, gravity differs by {:.1f} deg from the map's vertical", tilt),
          "level the map of --cloud, or correct the rotation of lidar.T_imu_lidar in " + file_);
    }
  }

  const InitialPoseInputs& inputs_;
  std::shared_ptr<const PlaneMap> map_;
  std::string file_;
  Findings findings_;
};

}  // namespace

Findings check_initial_pose(const InitialPoseInputs& inputs) {
  if (inputs.odometry.first_scan.empty()) return {};
  return InitialPoseCheck(inputs).run();
}

Findings check_floor(const LogSample& sample, const Platform& platform, const ScanOdometry& odometry) {
  if (sample.imu.empty() || odometry.first_scan.empty()) return {};
  const Vector3 up = up_at_begin(sample, odometry).direction;
  const Quaternion& R_imu_lidar = platform.suite.lidar.T_imu_lidar.rotation;
  struct Floor {
    int points = 0;
    double tilt_deg = 180.0;
  };
  std::array<Floor, 2> floors;
  const std::array<Quaternion, 2> turns{R_imu_lidar, R_imu_lidar.conjugate()};
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const Vector3 up_lidar = turns[i].conjugate() * up;
    const auto ground = find_ground(odometry.first_scan, up_lidar);
    if (ground) floors[i] = {ground->points, degrees_per_radian * angle_between_rad(ground->normal, up_lidar)};
  }
  const auto& [given, inverse] = floors;
  const bool inverse_is_level = inverse.points > 0 && inverse.tilt_deg < 0.5 * floor_tilt_deg;
  const bool given_is_level = given.points > inverse.points / 3 && given.tilt_deg < floor_tilt_deg;
  if (given_is_level || !inverse_is_level) return {};
  return {
      {Severity::error, "extrinsic.inverse",
       fmt::format(
           "the floor in the first scan is {} with the given T_imu_lidar, and {:.1f} deg from level ({} points) with "
           "its inverse",
           given.points > 0 ? fmt::format("{:.1f} deg from level ({} points)", given.tilt_deg, given.points)
                            : "not found",
           inverse.tilt_deg, inverse.points),
       "invert lidar.T_imu_lidar in " + platform.file_name(), odometry.poses.front().time}};
}

}  // namespace lodestone
