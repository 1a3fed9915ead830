#include "estimators/smoother/relocation.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <utility>

#include "core/geometry/pose_distance.h"
#include "estimators/estimate.h"
#include "estimators/smoother/gap_search.h"
#include "estimators/verdict.h"

namespace lodestone {

namespace {

constexpr double kPlaceStep_m = 0.1;                   // far below the distances over which a field or a wall changes
constexpr double kStep_rad = 0.0175;                   // 1°
constexpr double kStartTurn_rad = 7.5 * M_PI / 180.0;  // largest turn of an initial pose: as far as 0.75 m at 6 m
constexpr double kFarthest_m = 6.0;
constexpr double kLostWait_s = 1.0;   // between two searches for it
constexpr double kConfirmed_m = 0.5;  // between the places of two scans, with the IMU's way between them
constexpr double kConfirmed_rad = 0.1;
constexpr int kMostSteps = 7;  // along the second direction and of the heading, which limits the size of the grid

SearchDirection shift(const Vector3& direction, double reach_m) {
  SearchDirection result;
  result.axis.tail<3>() = kPlaceStep_m * direction.normalized();
  result.steps = static_cast<int>(std::ceil(reach_m / kPlaceStep_m));
  return result;
}

/// A rotation about the vertical, which is opposite to gravity.
SearchDirection turn(const NavState& state, double reach_rad) {
  SearchDirection result;
  result.axis.head<3>() = kStep_rad * (state.T_map_imu.rotation.conjugate() * -state.gravity.normalized());
  result.steps = static_cast<int>(std::ceil(reach_rad / kStep_rad));
  return result;
}

}  // namespace

FieldBackground Relocation::background() {
  if (!background_) background_ = field_background(*input_.field);
  return *background_;
}

std::optional<Pose> Relocation::better_start(const Keyframe& keyframe, const NavState& state,
                                             const Matrix6& covariance) {
  const InitialOptions& options = input_.options.initial;
  if (options.search_m <= 0.0) return std::nullopt;
  const PoseSearch search(input_, keyframe, state, [](int) { return Vector3::Zero().eval(); });
  return search.find(state.T_map_imu,
                     {shift(Vector3::UnitX(), options.search_m), shift(Vector3::UnitY(), options.search_m),
                      turn(state, kStartTurn_rad)},
                     covariance, [this] { return background(); });
}

bool Relocation::waits(Time now) const {
  return searched_ && to_seconds(now - *searched_) < kLostWait_s;
}

/// A wrong place that fits one scan by chance does not fit the next one where the robot has moved to.
std::optional<Pose> Relocation::place_after_gap(const Keyframe& keyframe, const NavState& state,
                                                const std::function<Vector3(int)>& bias_ut) {
  if (!unconfirmed_ && waits(keyframe.estimate.time)) return std::nullopt;
  searched_ = keyframe.estimate.time;
  const Matrix6& covariance = keyframe.predicted_covariance;
  const PoseSearch search(input_, keyframe, state, bias_ut);
  const auto found = find_after_gap(search, keyframe.predicted, covariance, input_.options.search.min_probability,
                                    [this] { return background(); });
  const auto before = std::exchange(unconfirmed_, std::nullopt);
  if (!found || position_variance_m2(covariance) < kMostAdrift_m * kMostAdrift_m) return found;
  if (before) {
    const Pose expected = before->T_map_imu * (before->predicted.inverse() * keyframe.predicted);
    if (are_near(*found, expected, kConfirmed_m, kConfirmed_rad)) return found;
  }
  unconfirmed_ = {*found, keyframe.predicted};
  return std::nullopt;
}

std::optional<Pose> Relocation::better_place(const Keyframe& keyframe, const NavState& state,
                                             const std::function<Vector3(int)>& bias_ut) {
  const Matrix6& covariance = keyframe.predicted_covariance;
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(covariance.bottomRightCorner<3, 3>());
  const Vector3 sigma_m = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  unconfirmed_.reset();  // of a gap that is over
  if (!(sigma_m[2] > kKnown_m)) return std::nullopt;
  if (position_variance_m2(covariance) > kLostSigma_m * kLostSigma_m) {
    if (waits(keyframe.estimate.time)) return std::nullopt;
    searched_ = keyframe.estimate.time;
  }
  std::vector<SearchDirection> directions{shift(solver.eigenvectors().col(2), std::min(3.0 * sigma_m[2], kFarthest_m))};
  if (sigma_m[1] > kKnown_m) {
    directions.push_back(shift(solver.eigenvectors().col(1), 3.0 * sigma_m[1]));
    directions.back().steps = std::min(directions.back().steps, 4 * kMostSteps);
  }
  const SearchDirection heading = turn(state, 0.0);
  const Vector3 vertical = heading.axis.head<3>().normalized();
  const double sigma_rad = std::sqrt(vertical.dot(covariance.topLeftCorner<3, 3>() * vertical));
  if (sigma_rad > kStep_rad) {
    directions.push_back(turn(state, 3.0 * sigma_rad));
    directions.back().steps = std::min(directions.back().steps, kMostSteps);
  }
  const PoseSearch search(input_, keyframe, state, bias_ut);
  return search.find(keyframe.predicted, directions, covariance, [this] { return background(); });
}

}  // namespace lodestone
