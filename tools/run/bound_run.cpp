#include "tools/run/bound_run.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/progress.h"

namespace lodestone {

namespace {

struct Predicted {
  double position_m2 = 0.0;
  double heading_rad2 = 0.0;
};

Predicted predicted(const Pose& pose, const Matrix6& covariance) {
  // The map's z axis in the body frame.
  const Vector3 up = pose.rotation.conjugate() * Vector3::UnitZ();
  return {covariance.bottomRightCorner<3, 3>().trace(), up.dot(covariance.topLeftCorner<3, 3>() * up)};
}

}  // namespace

const Bound::Stage* Bound::find(const std::string& name) const {
  for (const Stage& stage : stages) {
    if (stage.name == name) return &stage;
  }
  return nullptr;
}

Bound run_bound(const std::function<OpenedLog()>& open,
                const std::function<std::unique_ptr<Estimator>(const ScanBundle&)>& make_estimator,
                const Trajectory& truth, const std::filesystem::path& file) {
  const OpenedLog log = open();
  EstimateRecord record;
  std::unique_ptr<Estimator> estimator;
  {
    Progress progress("bound", log.begin, log.end);
    ScanBundle bundle;
    while (log.next(bundle)) {
      if (!estimator) estimator = make_estimator(bundle);
      estimator->process_in_place(bundle, record);
      progress.advance(bundle.scan.end);
    }
  }
  if (!estimator) throw InputError("the log has no scan between its first and last IMU sample; the bound requires one");
  estimator->finish(record);

  const std::pair<const char*, const EstimateRecord::Poses*> stages[] = {
      {"causal", &record.causal_poses()}, {"smoothed", &record.smoothed_poses()}, {"batch", &record.best_poses()}};
  Bound bound;
  std::string text = "t_s";
  for (const auto& [name, poses] : stages) text += fmt::format(",{0}_position_sigma_m,{0}_heading_sigma_deg", name);
  text += "\n";
  std::vector<Predicted> sums(std::size(stages));
  int count = 0;
  for (std::size_t k = 0; k < record.best().size(); ++k) {
    const StampedPose& stamped = record.best()[k];
    if (!interpolate(truth, stamped.time, std::numeric_limits<Time>::max())) continue;
    ++count;
    text += format_stamp(stamped.time);
    for (std::size_t i = 0; i < std::size(stages); ++i) {
      const Predicted one = predicted(stamped.pose, stages[i].second->covariances[k]);
      sums[i].position_m2 += one.position_m2;
      sums[i].heading_rad2 += one.heading_rad2;
      text += fmt::format(",{:.6g},{:.6g}", std::sqrt(one.position_m2),
                          std::sqrt(one.heading_rad2) * 180.0 / std::numbers::pi);
    }
    text += "\n";
  }
  write_text_file(file, text);
  for (std::size_t i = 0; i < std::size(stages) && count > 0; ++i) {
    bound.stages.push_back({stages[i].first, std::sqrt(sums[i].position_m2 / count),
                            std::sqrt(sums[i].heading_rad2 / count) * 180.0 / std::numbers::pi});
  }
  return bound;
}

}  // namespace lodestone
