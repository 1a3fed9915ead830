// Localizes a log and writes the trajectory: localize LOG PLATFORM CLOUD "x y z qx qy qz qw" OUT.tum [MAGNETIC]
#include <cmath>
#include <cstdio>
#include <string>

#include "core/error.h"
#include "frontends/configuration/options.h"
#include "frontends/configuration/trajectory_file.h"
#include "localization/initial_pose.h"
#include "localization/localization.h"

namespace {

int localize_log(const char* log, const char* platform, const lodestone::MapFiles& maps, const char* initial_pose,
                 const char* out) {
  // The options of --set and --config. Every option has a default.
  lodestone::RunOptions options;
  lodestone::load_options(lodestone::load_configuration({}, {"initial.position_sigma_m=0.1"}), options);
  const lodestone::Site site = lodestone::load_site(platform, options, maps);

  lodestone::LocalizationTask task;
  task.estimator = "smoother";
  task.initial_pose = lodestone::parse_initial_pose(initial_pose);
  lodestone::EstimateCollector estimates;
  const lodestone::LocalizationResult result = lodestone::localize(log, site, task, estimates);

  lodestone::Trajectory trajectory;
  for (const lodestone::Estimate& estimate : estimates.best_estimates) {
    if (estimate.health == lodestone::Health::lost) continue;
    trajectory.push_back({estimate.time, estimate.state.T_map_imu});
  }
  lodestone::write_tum(out, trajectory);
  std::printf("%lld scans by %s: %zu poses in %s\n", static_cast<long long>(result.scans), result.solver.c_str(),
              trajectory.size(), out);
  for (const auto& [kind, warning] : result.warnings.entries()) {
    std::printf("%s (%lld x): %s\n", kind.c_str(), static_cast<long long>(warning.count), warning.first_detail.c_str());
  }
  if (result.failure) throw lodestone::InputError(*result.failure);
  if (estimates.best_estimates.empty()) return 1;
  const lodestone::Estimate& last = estimates.best_estimates.back();
  const lodestone::Vector3& position = last.state.T_map_imu.position;
  std::printf("at the end: %.3f %.3f %.3f m, sigma %.3f m\n", position.x(), position.y(), position.z(),
              std::sqrt(last.covariance.bottomRightCorner<3, 3>().trace()));
  return 0;
}

}  // namespace

int main(int argument_count, char** arguments) {
  if (argument_count != 6 && argument_count != 7) {
    std::fputs("localize LOG PLATFORM CLOUD \"x y z qx qy qz qw\" OUT.tum [MAGNETIC]\n", stderr);
    return 2;
  }
  try {
    const lodestone::MapFiles maps{arguments[3], argument_count == 7 ? arguments[6] : ""};
    return localize_log(arguments[1], arguments[2], maps, arguments[4], arguments[5]);
  } catch (const lodestone::InputError& error) {
    std::fprintf(stderr, "localize: %s\n", error.what());
    return 2;
  }
}
