#include "tools/writers/estimate_files.h"

#include <fmt/format.h>

#include "core/work_times.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/writers/covariance_file.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

std::string trajectory_header() {
  return fmt::format("# {}\n", kTrajectoryColumns);
}

std::string diagnostics_header() {
  std::string text = "t_s,health,health_reason,points,correspondences,inlier_share,lidar_rmse_m,lidar_nis";
  for (int i = 1; i <= 6; ++i) text += fmt::format(",direction_{}_sigma_m", i);
  for (int i = 1; i <= 6; ++i) text += fmt::format(",direction_{}_weight", i);
  return text +
         ",degenerate_directions,unobserved_directions,magnetic_samples,magnetic_rejected,magnetic_off_map,"
         "magnetic_weight,magnetic_shrink,magnetic_residual_ut,magnetic_nis,magnetic_set_aside,place_share,decoy_share,"
         "field_odds,clock_offset_s,clock_sigma_s,wheel_weight,wheel_slip,iterations,step_ms\n";
}

/// A number, or nan if nothing was measured: zero would look like a very good value.
std::string figure(bool measured, double value) {
  return measured ? fmt::format(",{:.6g}", value) : ",nan";
}

std::string diagnostics_row(const Estimate& estimate) {
  using options_detail::write_value;
  const Diagnostics& d = estimate.diagnostics;
  const bool analysed = (d.direction_sigma_m.array() != 0.0).any();
  const bool field = d.magnetic_samples > 0;
  const bool clock = d.clock_sigma_s > 0.0;
  std::string text = fmt::format("{},{},{},{},{}", format_stamp(estimate.time), write_value(estimate.health),
                                 write_value(estimate.reason), d.points, d.correspondences);
  text += figure(d.points > 0, d.inlier_share) + figure(d.correspondences > 0, d.lidar_rmse_m);
  text += figure(d.lidar_nis > 0.0, d.lidar_nis);
  for (int i = 0; i < 6; ++i) text += figure(analysed, d.direction_sigma_m(i));
  for (int i = 0; i < 6; ++i) text += figure(analysed, d.direction_weight(i));
  text += fmt::format(",{},{},{},{},{}", d.degenerate_directions, d.unobserved_directions, d.magnetic_samples,
                      d.magnetic_rejected, d.magnetic_off_map);
  text += figure(field, d.magnetic_weight) + figure(field, d.magnetic_shrink) + figure(field, d.magnetic_residual_ut);
  text += figure(d.magnetic_nis > 0.0, d.magnetic_nis) + fmt::format(",{}", d.magnetic_set_aside);
  text += figure(d.place_points > 0, d.place_share) + figure(d.place_points > 0, d.decoy_share);
  text += figure(d.field_odds != 0.0, d.field_odds);
  text += figure(clock, d.clock_offset_s) + figure(clock, d.clock_sigma_s);
  text += figure(d.wheel_weight >= 0.0, d.wheel_weight) + figure(d.wheel_weight >= 0.0, d.wheel_slip);
  return text + fmt::format(",{},{:.6g}\n", d.iterations, d.step_ms);
}

}  // namespace

EstimateFiles::EstimateFiles(const std::filesystem::path& folder)
    : folder_(made_folder(folder)),
      trajectory_(folder / "trajectory.tum"),
      causal_(folder / "causal.tum"),
      covariance_(folder / "covariance.csv"),
      diagnostics_(folder / "diagnostics.csv") {
  trajectory_.write(trajectory_header());
  causal_.write(trajectory_header());
  covariance_.write(covariance_header());
  diagnostics_.write(diagnostics_header());
}

void EstimateFiles::causal(const Estimate& estimate) {
  const WorkTimer timer(Work::write);
  if (estimate.health != Health::lost) {
    causal_.write(format_tum({estimate.time, estimate.state.T_map_imu}) + "\n");
  }
  diagnostics_.write(diagnostics_row(estimate));
}

void EstimateFiles::best(const Estimate& estimate) {
  const WorkTimer timer(Work::write);
  if (!lost_.add(estimate)) return;
  trajectory_.write(format_tum({estimate.time, estimate.state.T_map_imu}) + "\n");
  covariance_.write(covariance_row(estimate.time, estimate.covariance));
}

void EstimateFiles::smoothed(const Estimate& estimate) {
  const WorkTimer timer(Work::write);
  if (estimate.health == Health::lost) return;
  if (smoothed_ == nullptr) {
    smoothed_ = std::make_unique<OutputFile>(folder_ / "smoothed.tum");
    smoothed_->write(trajectory_header());
  }
  smoothed_->write(format_tum({estimate.time, estimate.state.T_map_imu}) + "\n");
}

void EstimateFiles::finish(const std::string& mark) {
  for (const LostInterval& interval : lost_.all()) {
    trajectory_.write(fmt::format("# lost from {} to {}\n", format_stamp(interval.from), format_stamp(interval.to)));
  }
  for (OutputFile* file : {&trajectory_, &causal_, smoothed_.get()}) {
    if (file != nullptr && !mark.empty()) file->write("# " + mark + "\n");
  }
  for (OutputFile* file : {&trajectory_, &causal_, smoothed_.get(), &covariance_, &diagnostics_}) {
    if (file != nullptr) file->commit();
  }
}

}  // namespace lodestone
