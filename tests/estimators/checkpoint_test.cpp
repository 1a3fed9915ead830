// An estimator left at any scan, written down and taken up by a new one, goes on with the same bits.
#include <gtest/gtest.h>

#include <sstream>

#include "core/checkpoint/serialization.h"
#include "tests/estimators/drive.h"

namespace lodestone::testing {
namespace {

struct AllEstimates final : EstimateSink {
  std::vector<Estimate> estimates;
  void causal(const Estimate& estimate) override { estimates.push_back(estimate); }
  void best(const Estimate& estimate) override { estimates.push_back(estimate); }
  void smoothed(const Estimate& estimate) override { estimates.push_back(estimate); }
};

/// Without the step's wall time, which no two runs share.
std::string bytes_of(const Estimate& estimate) {
  std::ostringstream stream(std::ios::binary);
  StateWriter writer(stream);
  const NavState& s = estimate.state;
  const Diagnostics& d = estimate.diagnostics;
  writer(estimate.time, s, estimate.covariance, static_cast<int>(estimate.health), d.points, d.correspondences, d.inlier_share,
         d.direction_sigma_m, d.direction_weight, d.degenerate_directions, d.magnetic_samples, d.magnetic_rejected);
  writer(d.magnetic_weight, d.magnetic_shrink, d.magnetic_residual_ut, d.magnetic_nis, d.magnetic_set_aside, d.clock_offset_s,
         d.clock_sigma_s, d.iterations, d.magnetic_off_map, d.lidar_rmse_m, d.lidar_nis);
  return stream.str();
}

struct Case {
  const char* name;
  const char* estimator;
  bool planes;
  bool field;
  void (*change)(RunOptions&);
  std::size_t scans;
};

void PrintTo(const Case& one, std::ostream* stream) { *stream << one.name; }

class Checkpoint : public ::testing::TestWithParam<Case> {};

TEST_P(Checkpoint, GoesOnWithTheSameBits) {
  const Drive& drive = shared_drive();
  EstimatorInput input = drive.input();
  if (!GetParam().planes) input.planes = nullptr;
  if (!GetParam().field) input.field = nullptr;
  GetParam().change(input.options);

  AllEstimates unbroken;
  const auto whole = make_estimator(GetParam().estimator, input);
  for (std::size_t i = 0; i < GetParam().scans; ++i) whole->process(drive.bundles[i], unbroken);
  whole->finish(unbroken);

  AllEstimates resumed;
  std::ostringstream lasting(std::ios::binary);
  auto estimator = make_estimator(GetParam().estimator, input);
  // Left twice in a row, soon after the start, before the window is full, after it, and at the log's end.
  const std::size_t scans = GetParam().scans;
  std::size_t done = 0;
  for (const std::size_t left : {std::size_t{1}, std::size_t{2}, std::size_t{9}, scans - 3, scans}) {
    for (; done < left; ++done) estimator->process(drive.bundles[done], resumed);
    std::ostringstream state(std::ios::binary);
    {
      StateWriter state_writer(state);
      StateWriter lasting_writer(lasting);
      estimator->save(state_writer, lasting_writer);
    }
    estimator = make_estimator(GetParam().estimator, input);
    std::istringstream state_stream(state.str(), std::ios::binary);
    std::istringstream lasting_stream(lasting.str(), std::ios::binary);
    StateReader state_reader(state_stream);
    StateReader lasting_reader(lasting_stream);
    estimator->load(state_reader, lasting_reader);
    for (std::size_t i = 0; i < done; ++i) estimator->recall(drive.bundles[i]);
    EXPECT_EQ(state_stream.peek(), std::istringstream::traits_type::eof());
    EXPECT_EQ(lasting_stream.peek(), std::istringstream::traits_type::eof());
  }
  estimator->finish(resumed);

  ASSERT_EQ(resumed.estimates.size(), unbroken.estimates.size());
  for (std::size_t i = 0; i < resumed.estimates.size(); ++i) {
    ASSERT_TRUE(bytes_of(resumed.estimates[i]) == bytes_of(unbroken.estimates[i])) << "estimate " << i;
  }
}

void as_is(RunOptions&) {}
void batch(RunOptions& options) { options.smoother.refine = Refinement::batch; }
void by_points_without_biases(RunOptions& options) {
  options.smoother.solver.condensed = false;
  options.smoother.solver.magnetometer_bias_states = false;
}
void with_clock_and_epochs(RunOptions& options) {
  options.smoother.solver.magnetometer_clock_sigma_s = 0.01;
  options.smoother.solver.magnetometer_bias_epoch_s = 0.7;
}

INSTANTIATE_TEST_SUITE_P(Checkpoints, Checkpoint,
                         ::testing::Values(Case{"smoother", "smoother", true, true, as_is, 60},
                                           Case{"smoother_batch", "smoother", true, true, batch, 40},
                                           Case{"smoother_points_without_biases", "smoother", true, true,
                                                by_points_without_biases, 30},
                                           Case{"smoother_clock_epochs", "smoother", true, true, with_clock_and_epochs, 45},
                                           Case{"smoother_lidar", "smoother", true, false, as_is, 40},
                                           Case{"smoother_field", "smoother", false, true, as_is, 75},
                                           Case{"magnetic", "magnetic", false, true, as_is, 75},
                                           Case{"magnetic_batch", "magnetic", false, true, batch, 75},
                                           Case{"ieskf", "ieskf", true, true, as_is, 40},
                                           Case{"lidar_inertial", "lidar-inertial", true, true, as_is, 40}),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace lodestone::testing
