#include "tools/check/start_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/angles.h"
#include "core/lidar/plane_map.h"
#include "estimators/initialization/scan_registration.h"
#include "estimators/initialization/start_scan.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/check/imu_checks.h"

namespace lodestone {
namespace {

constexpr double good_share = 0.6;  // below, another place may fit better: edges and furniture fit nowhere
constexpr double low_share = 0.38;
constexpr double poor_share = 0.28;
constexpr double clearly_better = 0.15;  // share by which one T_imu_lidar must beat the other
constexpr double cost_ratio = 0.5;
constexpr double clearly_lower = 0.9;  // cost of a fit further off, for it to win
constexpr double search_step_m = 0.35;
constexpr int search_places = 5;  // a side
constexpr double near_m = 0.25;   // a start further off spoils the first scans
constexpr double near_deg = 2.0;
constexpr double same_share = 0.05;  // two fits so near to each other are as good
constexpr double exact_m = 0.08;     // a start so near is the right one
constexpr double exact_deg = 0.7;
constexpr double tilt_deg = 2.5;         // of a robot at rest: the accelerometer's bias is within
constexpr double moving_tilt_deg = 6.0;  // of one that drives off: 2.5 m/s within the span are 3 degrees
constexpr double floor_tilt_deg = 2.0;
constexpr double gravity_span_s = 5.0;  // of a robot that does not rest at the begin
constexpr double rest_within_s = 2.0;

struct Up {
  Vector3 direction;  ///< imu frame
  bool at_rest = false;
};

/// Against gravity, at the first sample.
Up up_at_begin(const LogSample& sample) {
  const Time begin = sample.imu.front().time;
  const std::optional<RestSpan> rest = calmest_span(sample.imu);
  if (rest && rest->at_rest && to_seconds(rest->begin - begin) < rest_within_s)
    return {rest->linear_acceleration.normalized(), true};
  std::size_t count = 0;
  while (count < sample.imu.size() && to_seconds(sample.imu[count].time - begin) < gravity_span_s) ++count;
  return {mean_up(std::span(sample.imu).first(count)), false};
}

double tilt_between_deg(const Vector3& a, const Vector3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * degrees_per_radian;
}

/// The first scan on the map with one T_imu_lidar.
struct Fit {
  ScanAgreement registered;
  Pose T_map_imu;
  double moved_m = 0.0;
  double turned_deg = 0.0;
};

class StartCheck {
 public:
  explicit StartCheck(const StartMaterial& material)
      : material_(material), map_(material.map.around(material.start.position)), file_(material.platform.file_name()) {}

  Findings run() {
    const Pose& T_imu_lidar = material_.platform.suite.lidar.T_imu_lidar;
    const Fit given = fit_with(T_imu_lidar);
    const Fit inverse = fit_with(T_imu_lidar.inverse());
    const bool inverse_fits = inverse.registered.share > poor_share &&
                              (inverse.registered.share > given.registered.share + clearly_better ||
                               inverse.registered.cost < cost_ratio * given.registered.cost) &&
                              inverse.moved_m < 1.5 * near_m;
    if (inverse_fits) {
      add(Severity::error, "extrinsic.inverse",
          fmt::format("{:.0f} % of the first scan lie on the map with T_imu_lidar as given, {:.0f} % with its inverse",
                      100.0 * given.registered.share, 100.0 * inverse.registered.share),
          "invert lidar.T_imu_lidar in " + file_ + " (T_imu_lidar takes points of the LiDAR to the IMU)");
      return findings_;
    }
    if (given.registered.share < good_share && elsewhere(given)) return findings_;
    if (given.registered.share < low_share) {
      add(given.registered.share < poor_share ? Severity::error : Severity::warning, "start.no_overlap",
          seen_of(given) + (material_.find_anywhere ? ", and no place was found where clearly more do" : ""),
          "--cloud: the map of this site and its frame (metres, z up), --initial-pose, or lidar.T_imu_lidar in " +
              file_);
    } else {
      add(Severity::note, "start.overlap",
          fmt::format("{:.0f} % of the first scan lie on the map, {:.2f} m and {:.1f} deg from the given start",
                      100.0 * given.registered.share, given.moved_m, given.turned_deg),
          "");
      if ((given.moved_m > near_m || given.turned_deg > near_deg) && fits_at_start(inverse, given)) {
        // Where the start is exactly so far off by chance, it is the start: no error.
        add(Severity::warning, "extrinsic.inverse",
            fmt::format(
                "the scan fits {:.2f} m and {:.1f} deg from the given start with T_imu_lidar as given, {:.2f} m and "
                "{:.1f} deg from it with its inverse",
                given.moved_m, given.turned_deg, inverse.moved_m, inverse.turned_deg),
            fmt::format(
                "invert lidar.T_imu_lidar in {} (T_imu_lidar takes points of the LiDAR to the IMU); or, should it be "
                "right, --initial-pose \"{}\"",
                file_, pose_text(given.T_map_imu)));
      } else if (given.moved_m > near_m || given.turned_deg > near_deg) {
        add(Severity::warning, "start.off",
            fmt::format("the scan fits {:.2f} m and {:.1f} deg from the given start", given.moved_m, given.turned_deg),
            fmt::format(
                "--initial-pose \"{}\"; or, should the start be right, the translation of lidar.T_imu_lidar in {}",
                pose_text(given.T_map_imu), file_));
      }
    }
    if (given.registered.share > poor_share) upright(given.T_map_imu);
    return findings_;
  }

 private:
  void add(Severity severity, const std::string& kind, const std::string& seen, const std::string& change) {
    findings_.push_back({severity, kind, seen, change, material_.odometry.poses.front().time});
  }

  Fit fit_with(const Pose& T_imu_lidar) const {
    LidarModel lidar = material_.platform.suite.lidar;
    lidar.T_imu_lidar = T_imu_lidar;
    // One scan alone, from a poor start: wider gates than an estimate wants that knows its pose.
    AssociationOptions association;
    association.map_error_repeats = 30.0;
    association.surface_roughness_m = 0.005;
    std::vector<Eigen::Vector3f> points;
    for (const Eigen::Vector3f& point : material_.odometry.first_scan) {
      points.push_back((T_imu_lidar * point.cast<double>()).cast<float>());
    }
    Fit fit;
    fit.T_map_imu = material_.start;
    fit.registered = agreement(points, material_.start, *map_);
    // A scan finds its planes from a third of a metre off; a start is wrong by more now and then.
    // The start itself first, then round it.
    for (int i = 0; i < search_places * search_places; ++i) {
      const int place = (i + search_places * search_places / 2) % (search_places * search_places);
      Pose from = material_.start;
      from.position += search_step_m * Vector3(place % search_places - search_places / 2,
                                               place / search_places - search_places / 2, 0.0);
      const Pose pose = register_scan(points, from, *map_, lidar, association).T_map_imu;
      const ScanAgreement found = agreement(points, pose, *map_);
      if (found.cost > (i == 0 ? 1.0 : clearly_lower) * fit.registered.cost) continue;
      fit.T_map_imu = pose;
      fit.registered = found;
    }
    const Vector6 step = fit.T_map_imu.boxminus(material_.start);
    fit.turned_deg = step.head<3>().norm() * degrees_per_radian;
    fit.moved_m = step.tail<3>().norm();
    return fit;
  }

  static bool fits_at_start(const Fit& fit, const Fit& other) {
    return fit.registered.share > other.registered.share - same_share && fit.moved_m < exact_m &&
           fit.turned_deg < exact_deg;
  }

  std::string seen_of(const Fit& given) const {
    return fmt::format("only {:.0f} % of the first scan lie on the map at the given start ({:.2f} {:.2f} {:.2f})",
                       100.0 * given.registered.share, material_.start.position.x(), material_.start.position.y(),
                       material_.start.position.z());
  }

  /// Whether the scan fits clearly better at another place.
  bool elsewhere(const Fit& given) {
    const std::optional<PlaceOnMap> place = material_.find_anywhere ? material_.find_anywhere() : std::nullopt;
    if (!place || place->share < given.registered.share + clearly_better || place->share < low_share) return false;
    const Vector6 step = place->T_map_imu.boxminus(material_.start);
    add(Severity::error, "start.wrong",
        fmt::format("{}; {:.0f} % do {:.2f} m and {:.1f} deg from it{}", seen_of(given), 100.0 * place->share,
                    step.tail<3>().norm(), step.head<3>().norm() * degrees_per_radian,
                    place->sure ? "" : ", and perhaps elsewhere"),
        fmt::format("--initial-pose \"{}\", or the map's frame where the start is right", pose_text(place->T_map_imu)));
    return true;
  }

  void upright(const Pose& T_map_imu) {
    if (material_.sample.imu.empty()) return;
    const Up up = up_at_begin(material_.sample);
    const double tilt = tilt_between_deg(T_map_imu.rotation * up.direction, Vector3::UnitZ());
    if (tilt > 90.0) {
      add(Severity::error, "imu.upside_down", fmt::format("gravity points up ({:.0f} deg from the map's down)", tilt),
          "imu: acceleration must read +g upwards at rest; or the IMU's axes in lidar.T_imu_lidar");
    } else if (tilt > (up.at_rest ? tilt_deg : moving_tilt_deg)) {
      add(Severity::error, "start.tilt",
          fmt::format("where the scan fits the map, gravity stands {:.1f} deg from the map's vertical", tilt),
          "--cloud: a map that is level; or the rotation of lidar.T_imu_lidar in " + file_);
    }
  }

  const StartMaterial& material_;
  std::shared_ptr<const PlaneMap> map_;
  std::string file_;
  Findings findings_;
};

}  // namespace

Findings check_start(const StartMaterial& material) {
  if (material.odometry.first_scan.empty()) return {};
  return StartCheck(material).run();
}

Findings check_floor(const LogSample& sample, const Platform& platform, const ScanOdometry& odometry) {
  if (sample.imu.empty() || odometry.first_scan.empty()) return {};
  const Vector3 up = up_at_begin(sample).direction;
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
    if (ground) floors[i] = {ground->points, tilt_between_deg(ground->normal, up_lidar)};
  }
  const auto& [given, inverse] = floors;
  const bool inverse_is_level = inverse.points > 0 && inverse.tilt_deg < 0.5 * floor_tilt_deg;
  const bool given_is_level = given.points > inverse.points / 3 && given.tilt_deg < floor_tilt_deg;
  if (given_is_level || !inverse_is_level) return {};
  return {
      {Severity::error, "extrinsic.inverse",
       fmt::format(
           "the floor in the first scan is {} with T_imu_lidar as given, and {:.1f} deg from level ({} points) with "
           "its inverse",
           given.points > 0 ? fmt::format("{:.1f} deg from level ({} points)", given.tilt_deg, given.points)
                            : "not found",
           inverse.tilt_deg, inverse.points),
       "invert lidar.T_imu_lidar in " + platform.file_name(), odometry.poses.front().time}};
}

}  // namespace lodestone
