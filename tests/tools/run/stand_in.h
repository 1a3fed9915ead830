#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "core/geometry/so3.h"
#include "tests/tools/program_runner.h"
#include "tools/run/estimator_run.h"

namespace lodestone {

inline constexpr int kScans = 100;

inline Pose true_pose(Time time) {
  const double t = to_seconds(time);
  return {so3::exp({0.0, 0.0, 0.1 * t}), {t, std::sin(t), 0.02 * t}};
}

inline Trajectory true_path() {
  Trajectory truth;
  for (Time time = 0; time <= from_seconds(0.1 * (kScans + 1)); time += from_seconds(0.005))
    truth.push_back({time, true_pose(time)});
  return truth;
}

/// Ground truth plus `offset`; returns its best estimates two scans late, like a smoother.
class StandIn : public Estimator {
 public:
  Vector3 offset = Vector3::Zero();
  Vector3 jump = Vector3::Zero();  // from the middle of the log on
  Health last_health = Health::good;
  std::pair<int, int> lost = {0, 0};  // first and last of the lost scans, counted from 1; 0: none

  void process(const ScanBundle& bundle, EstimateSink& sink) override {
    Estimate estimate;
    estimate.time = bundle.scan.end;
    estimate.state.T_map_imu = true_pose(estimate.time);
    estimate.state.T_map_imu.position += offset;
    if (2 * count_ >= kScans) estimate.state.T_map_imu.position += jump;
    estimate.covariance = 0.01 * Matrix6::Identity();
    estimate.diagnostics.degenerate_directions = count_ % 4 == 0 ? 1 : 0;
    estimate.diagnostics.magnetic_rejected = 2;
    estimate.health = ++count_ == kScans ? last_health : Health::good;
    if (count_ >= lost.first && count_ <= lost.second) {
      estimate.health = Health::lost;
      estimate.reason = HealthReason::field_off_map;
    }
    sink.causal(estimate);
    window_.push_back(estimate);
    if (window_.size() > 2) {
      sink.best(window_.front());
      window_.erase(window_.begin());
    }
  }

  void finish(EstimateSink& sink) override {
    for (const Estimate& estimate : window_) sink.best(estimate);
    window_.clear();
  }

 private:
  int count_ = 0;
  std::vector<Estimate> window_;
};

class EstimatorRunTest : public testing::Test {
 protected:
  EstimatorRun run_with(const StandIn& stand_in) {
    EstimatorRun run;
    run.name = "stand-in";
    run.folder = folder_ / "stand-in";
    run.truth = &truth_;
    run.open = []() {
      return OpenedLog{0, from_seconds(0.1 * kScans), [scan = 0](ScanBundle& bundle) mutable {
                         if (scan == kScans) return false;
                         bundle.scan.start = from_seconds(0.1 * scan);
                         bundle.scan.end = from_seconds(0.1 * ++scan);
                         return true;
                       }};
    };
    run.make_estimator = [stand_in](const ScanBundle&) { return std::make_unique<StandIn>(stand_in); };
    return run;
  }

  /// The same log; calls `before` ahead of every bundle.
  static std::function<OpenedLog()> opened_with(const EstimatorRun& run, std::function<void(int)> before) {
    return [open = run.open, before]() {
      OpenedLog log = open();
      log.next = [next = log.next, before, count = 0](ScanBundle& bundle) mutable {
        before(++count);
        return next(bundle);
      };
      return log;
    };
  }

  nlohmann::json summary() const { return nlohmann::json::parse(content_of(folder_ / "stand-in/summary.json")); }

  TemporaryFolder folder_;
  Trajectory truth_ = true_path();
};

}  // namespace lodestone
