#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/geometry/trajectory.h"
#include "estimators/estimator.h"

namespace lodestone::testing {

/// Pose and velocity at `time`, which lies on the trajectory.
inline NavState state_on(const Trajectory& truth, Time time) {
  constexpr Time kStep = 10'000'000;
  const auto place = [&](Time at) { return interpolate(truth, at, 20'000'000).value(); };
  NavState state;
  state.T_map_imu = place(time);
  state.velocity = (state.T_map_imu.position - place(time - kStep).position) / to_seconds(kStep);
  return state;
}

/// Loses its state with the first scan.
class LosesItsState final : public Estimator {
 public:
  void process(const ScanBundle& bundle, EstimateSink& sink) override {
    Estimate estimate;
    estimate.time = bundle.scan.end;
    estimate.state.T_map_imu.position.setConstant(std::numeric_limits<double>::quiet_NaN());
    sink.causal(estimate);
    sink.best(estimate);
  }
  void finish(EstimateSink& /*sink*/) override {}
};

/// In a room that looks the same from both ends, says that the robot is at the other one, 0.15 m beside where the
/// scan fits best. With the default weight, most readings contradict it.
class AtTheOtherEnd final : public Estimator {
 public:
  explicit AtTheOtherEnd(const Trajectory& truth, double sigma_m = 0.01, double magnetic_weight = 0.1)
      : truth_(truth), sigma_m_(sigma_m), magnetic_weight_(magnetic_weight) {}
  void process(const ScanBundle& bundle, EstimateSink& sink) override {
    Estimate estimate;
    estimate.time = bundle.scan.end;
    const Pose half_turn{Quaternion(Eigen::AngleAxisd(M_PI, Vector3::UnitZ())), {0.15, 0.0, 0.0}};
    estimate.state = state_on(truth_, estimate.time);
    estimate.state.T_map_imu = half_turn * estimate.state.T_map_imu;
    estimate.state.velocity = (half_turn.rotation * estimate.state.velocity).eval();
    estimate.covariance = sigma_m_ * sigma_m_ * Matrix6::Identity();
    estimate.diagnostics.correspondences = 500;
    estimate.diagnostics.magnetic_samples = 8;
    estimate.diagnostics.magnetic_weight = magnetic_weight_;
    sink.causal(estimate);
    sink.best(estimate);
  }
  void finish(EstimateSink& /*sink*/) override {}

 private:
  const Trajectory& truth_;
  double sigma_m_;
  double magnetic_weight_;
};

/// Sure of a place 0.5 m beside the truth, from the third second on, until it is moved.
class BesideTheTruth final : public Estimator {
 public:
  BesideTheTruth(const Trajectory& truth, bool moves) : truth_(truth), moves_(moves) {}
  void process(const ScanBundle& bundle, EstimateSink& sink) override {
    if (begin_ == 0) begin_ = bundle.scan.end;
    Estimate estimate;
    estimate.time = bundle.scan.end;
    estimate.state = state_on(truth_, estimate.time);
    if (estimate.time > begin_ + 3'000'000'000 && !moved_) estimate.state.T_map_imu.position += Vector3(0.4, 0.3, 0.0);
    estimate.covariance = 1e-4 * Matrix6::Identity();
    estimate.diagnostics.correspondences = 500;
    sink.causal(estimate);
    sink.best(estimate);
  }
  bool move(const Pose& T_new_old) override {
    EXPECT_LT((T_new_old.inverse().position - Vector3(0.4, 0.3, 0.0)).norm(), 0.2);  // its rotation has a lever arm
    moved_ = moves_;
    return moves_;
  }
  void finish(EstimateSink& /*sink*/) override {}

 private:
  const Trajectory& truth_;
  bool moves_;
  bool moved_ = false;
  Time begin_ = 0;
};

}  // namespace lodestone::testing
