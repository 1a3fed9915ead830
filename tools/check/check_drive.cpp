#include "tools/check/check_drive.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/evaluation/statistics.h"
#include "frontends/synchronizer/bag_source.h"
#include "frontends/synchronizer/synchronizer.h"
#include "localization/automatic_initialization.h"
#include "tools/check/acceleration_checks.h"
#include "tools/check/field_checks.h"
#include "tools/progress.h"
#include "tools/writers/estimate_record.h"

namespace lodestone {

namespace {

constexpr double kGoodShare = 0.4;  // share of a scan's points with a correspondence

/// The bundles of the checked part of the log.
class Bundles {
 public:
  Bundles(const CheckDrive& drive, double seconds)
      : sensors_{drive.planes != nullptr, true, drive.field != nullptr},
        source_(drive.log, drive.platform, warnings_, sensors_),
        synchronizer_(source_, drive.platform.suite, warnings_, sensors_),
        end_(source_.begin_time() + from_seconds(seconds)) {}

  bool next(ScanBundle& bundle) { return synchronizer_.next(bundle) && bundle.scan.end <= end_; }

 private:
  WarningLog warnings_;
  SensorChoice sensors_;
  BagSource source_;
  Synchronizer synchronizer_;
  Time end_;
};

std::set<std::size_t> broken_magnetometers(const Findings& findings) {
  std::set<std::size_t> broken;
  for (const Finding& one : findings) {
    if (one.magnetometer && (one.kind == "magnetometer.stuck" || one.kind == "magnetometer.limit"))
      broken.insert(*one.magnetometer);
  }
  return broken;
}

Findings check_record(const EstimateRecord& record) {
  Findings findings;
  std::vector<double> shares;
  for (const EstimateRecord::Step& step : record.steps()) {
    if (step.health == Health::lost) {
      findings.push_back({Severity::error, "drive.lost", "the smoother loses track here",
                          "check initial pose, extrinsics, maps and noise; see the other findings", step.time});
      break;
    }
    if (step.diagnostics.points > 0) shares.push_back(step.diagnostics.inlier_share);
  }
  if (shares.empty()) return findings;
  const double share = summarize(shares).median;
  findings.push_back(
      {share < kGoodShare ? Severity::warning : Severity::note, "drive.overlap",
       fmt::format("along the drive, {:.0f} % of a scan's points have a plane on the map (median)", 100.0 * share),
       share < kGoodShare ? "check that --cloud is up to date; check lidar.T_imu_lidar" : "",
       record.steps().front().time});
  return findings;
}

}  // namespace

EstimatorInput CheckDrive::input(const Pose& start, WarningLog* warnings) const {
  return {platform.suite, planes, field, start, Vector3::Zero(), options, warnings, nullptr, {}};
}

std::optional<Pose> CheckDrive::find_start(Findings& findings) const {
  Bundles bundles(*this, seconds);
  WarningLog warnings;
  try {
    const FoundInitialPose found = find_initial_pose(
        log, input({}, nullptr), [&](ScanBundle& bundle) { return bundles.next(bundle); }, warnings, origin_m);
    findings.push_back({Severity::note, "start.found", found.description, "check that it is the right place"});
    return found.start.T_map_imu;
  } catch (const InputError& error) {
    findings.push_back(error_finding("start.not_found", error));
    return std::nullopt;
  }
}

std::optional<PlaceOnMap> CheckDrive::find_anywhere() const {
  Bundles source(*this, std::min(seconds, options.search.data_s));
  std::vector<ScanBundle> bundles;
  for (ScanBundle bundle; source.next(bundle);) bundles.push_back(bundle);
  if (bundles.empty()) return std::nullopt;
  try {
    const FoundStart found = StartFinder(input({}, nullptr)).find(bundles);
    if (found.best.empty()) return std::nullopt;
    const StartHypothesis& best = found.best.front();
    return PlaceOnMap{best.T_map_imu, best.lidar.share, found.sure};
  } catch (const InputError&) {
    return std::nullopt;  // the map has no floor
  }
}

Findings CheckDrive::check(const Pose& start, const LogSample& sample, const Findings& before) const {
  WarningLog warnings;
  Bundles bundles(*this, seconds);
  EstimateRecord record;
  ArrayLog readings(platform.suite.magnetometers.size());
  const auto estimator = make_estimator("smoother", input(start, &warnings));
  for (ScanBundle bundle; bundles.next(bundle);) {
    estimator->process_in_place(bundle, record);
    readings.add(bundle.magnetic);
    throw_if_interrupted();
  }
  estimator->finish(record);
  Findings findings = check_record(record);
  if (record.best().size() < 3) return findings;
  if (planes != nullptr) append(findings, check_acceleration_along(record.best(), sample, platform));
  if (field != nullptr) {
    FieldComparison comparison{readings, platform.suite, record.best(), record.covariances(), {}, {}};
    comparison.map = [&](const Vector3& position) { return field->query(position, options.magnetic.interpolation); };
    const std::vector<double>& heights = field->grid().heights_m;
    if (heights.size() == 1) comparison.only_height_m = heights.front();
    append(findings, check_field_along(comparison, platform, broken_magnetometers(before)));
  }
  for (const auto& [kind, entry] : warnings.entries()) {
    if (kind.rfind("magnetometer.", 0) == 0) continue;  // already reported
    findings.push_back(
        {Severity::note, kind, fmt::format("{} ({} x)", entry.first_detail, entry.count), "", entry.first_time});
  }
  return findings;
}

}  // namespace lodestone
