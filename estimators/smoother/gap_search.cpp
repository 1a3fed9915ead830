#include "estimators/smoother/gap_search.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/angles.h"
#include "core/geometry/pose_distance.h"
#include "core/parallel.h"
#include "estimators/initialization/scan_registration.h"

namespace lodestone {

namespace {

constexpr double kReachSigmas = 3.0;
constexpr double kStartStep_rad = 3.0 * degree;  // about the vertical; tilt is known better
constexpr double kStartSlack = 1.5;              // points count within 0.3 m of their plane
constexpr std::size_t kMostStarts = 400'000;     // a second or two of work; a sigma of about two metres
constexpr std::size_t kRegisteredStarts = 100;   // best starts
constexpr double kOnePlace_m = 0.25;
constexpr double kOneHeading_rad = 3.0 * degree;

struct WeighedPlace {
  Pose T_map_imu;
  double evidence = 0.0;  ///< ln of the posterior, up to a constant
};

/// Starts on a grid over the ellipsoid of the position and the heading.
std::vector<Pose> starts_about(const Pose& about, const Matrix6& covariance) {
  const Eigen::SelfAdjointEigenSolver<Matrix3> position(covariance.bottomRightCorner<3, 3>());
  const Vector3 vertical = about.rotation.conjugate() * Vector3::UnitZ();
  const double turn_rad = std::sqrt(std::max(0.0, vertical.dot(covariance.topLeftCorner<3, 3>() * vertical)));
  const Vector3 sigma_m = position.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  const auto steps = [](double sigma, double step) {
    return static_cast<int>(std::min(std::ceil(kReachSigmas * sigma / step - 0.5), 1.0 * kMostStarts));
  };
  const std::array<int, 4> most{steps(sigma_m[0], kConverges_m), steps(sigma_m[1], kConverges_m),
                                steps(sigma_m[2], kConverges_m), steps(turn_rad, kStartStep_rad)};
  double count = 1.0;
  for (const int each : most) count *= 2.0 * each + 1.0;
  std::vector<Pose> starts;
  if (!(count <= static_cast<double>(kMostStarts))) return starts;
  for (int x = -most[0]; x <= most[0]; ++x) {
    for (int y = -most[1]; y <= most[1]; ++y) {
      for (int z = -most[2]; z <= most[2]; ++z) {
        const Vector3 shift = kConverges_m * Vector3(x, y, z);
        if (shift.cwiseQuotient(sigma_m).norm() > kReachSigmas + 0.5) continue;
        for (int turn = -most[3]; turn <= most[3]; ++turn) {
          Vector6 step;
          step << kStartStep_rad * turn * vertical, position.eigenvectors() * shift;
          starts.push_back(about.boxplus(step));
        }
      }
    }
  }
  return starts;
}

/// The best of `starts` by the share of points that fit, best first.
std::vector<Pose> best_of(const PoseSearch& search, std::vector<Pose> starts) {
  std::vector<double> fits(starts.size());
  parallel_for(std::size_t{0}, starts.size(),
               [&](std::size_t i) { fits[i] = search.rough_fit(starts[i], kStartSlack); });
  std::vector<std::size_t> order(starts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return fits[a] > fits[b]; });
  order.resize(std::min(order.size(), kRegisteredStarts));
  std::vector<Pose> best;
  for (const std::size_t i : order) best.push_back(starts[i]);
  return best;
}

}  // namespace

bool is_adrift(const Keyframe& keyframe) {
  if (keyframe.points.empty()) return false;
  const Eigen::SelfAdjointEigenSolver<Matrix3> position(keyframe.predicted_covariance.bottomRightCorner<3, 3>(),
                                                        Eigen::EigenvaluesOnly);
  return position.eigenvalues()[0] > kKnown_m * kKnown_m;
}

Matrix6 covariance_after_gap() {
  constexpr double kFound_m = 0.1;
  constexpr double kFound_rad = 0.02;
  Vector6 sigma;
  sigma << Vector3::Constant(kFound_rad), Vector3::Constant(kFound_m);
  return sigma.cwiseAbs2().asDiagonal();
}

std::optional<Pose> find_after_gap(const PoseSearch& search, const Pose& about, const Matrix6& covariance,
                                   double min_probability, const std::function<FieldBackground()>& background) {
  const std::vector<Pose> starts = best_of(search, starts_about(about, covariance));
  if (starts.empty()) return std::nullopt;
  const FieldBackground of_map = search.has_readings() ? background() : FieldBackground{};
  const Eigen::LDLT<Matrix6> prior(covariance);
  std::vector<WeighedPlace> places(starts.size());
  parallel_for(std::size_t{0}, starts.size(), [&](std::size_t i) {
    const Pose pose = search.registered(starts[i]);
    const Vector6 moved = pose.boxminus(about);
    places[i] = {pose, search.log_likelihood(pose, of_map) - 0.5 * moved.dot(prior.solve(moved))};
  });
  std::stable_sort(places.begin(), places.end(),
                   [](const WeighedPlace& a, const WeighedPlace& b) { return a.evidence > b.evidence; });
  const WeighedPlace& best = places.front();
  double others = std::exp(search.log_likelihood_off_map(about.rotation, of_map) - best.evidence);
  std::vector<Pose> different{best.T_map_imu};
  for (const WeighedPlace& place : places) {
    const auto same = [&place](const Pose& other) {
      return are_near(place.T_map_imu, other, kOnePlace_m, kOneHeading_rad);
    };
    if (std::any_of(different.begin(), different.end(), same)) continue;
    different.push_back(place.T_map_imu);
    others += std::exp(place.evidence - best.evidence);
  }
  if (!(1.0 / (1.0 + others) > min_probability)) return std::nullopt;
  return best.T_map_imu;
}

void leave_out_scan(Keyframe& keyframe, WarningLog* warnings) {
  keyframe.points.clear();
  if (warnings == nullptr) return;
  const Time time = keyframe.estimate.time;
  warnings->add("smoother.scan_not_used",
                fmt::format("after a gap of scans or IMU, the place of the scan at {:.3f} s was not found; such scans "
                            "are not used",
                            to_seconds(time)),
                time);
}

}  // namespace lodestone
