#include "tools/check/check_drive.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/evaluation/statistics.h"
#include "estimators/factory.h"
#include "localization/automatic_initialization.h"
#include "tools/check/acceleration_checks.h"
#include "tools/check/field_checks.h"
#include "tools/progress.h"
#include "tools/writers/estimate_record.h"

namespace lodestone {

namespace {

constexpr double kGoodShare = 0.4;  // share of a scan's points with a correspondence

/// The bundles of the first `seconds` of the log.
std::function<bool(ScanBundle&)> bundles_of(const CheckDrive& drive, double seconds, WarningLog& warnings) {
  OpenedLog log = open_bundles(drive.log, drive.site, warnings);
  return [next = std::move(log.next), end = log.begin + from_seconds(seconds)](ScanBundle& bundle) {
    return next(bundle) && bundle.scan.end <= end;
  };
}

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

std::optional<Pose> CheckDrive::find_start(Findings& findings) const {
  WarningLog ignored, warnings;
  const auto next = bundles_of(*this, seconds, ignored);
  try {
    const FoundInitialPose found =
        find_initial_pose(log, estimator_input(site, {}, nullptr), next, warnings, site.files.origin_m);
    findings.push_back({Severity::note, "start.found", found.description, "check that it is the right place"});
    return found.start.T_map_imu;
  } catch (const InputError& error) {
    findings.push_back(error_finding("start.not_found", error));
    return std::nullopt;
  }
}

std::optional<PlaceOnMap> CheckDrive::find_anywhere() const {
  WarningLog ignored;
  const auto next = bundles_of(*this, std::min(seconds, site.options.search.data_s), ignored);
  std::vector<ScanBundle> bundles;
  for (ScanBundle bundle; next(bundle);) bundles.push_back(bundle);
  if (bundles.empty()) return std::nullopt;
  try {
    const FoundStart found = StartFinder(estimator_input(site, {}, nullptr)).find(bundles);
    if (found.best.empty()) return std::nullopt;
    const StartHypothesis& best = found.best.front();
    return PlaceOnMap{best.T_map_imu, best.lidar.share, found.sure};
  } catch (const InputError&) {
    return std::nullopt;  // the map has no floor
  }
}

Findings CheckDrive::check(const Pose& start, const LogSample& sample, const Findings& before) const {
  WarningLog ignored, warnings;
  const auto next = bundles_of(*this, seconds, ignored);
  EstimateRecord record;
  const Platform& platform = site.platform;
  ArrayLog readings(platform.suite.magnetometers.size());
  const auto estimator = make_estimator("smoother", estimator_input(site, start, &warnings));
  for (ScanBundle bundle; next(bundle);) {
    estimator->process_in_place(bundle, record);
    readings.add(bundle.magnetic);
    throw_if_interrupted();
  }
  estimator->finish(record);
  Findings findings = check_record(record);
  if (record.best().size() < 3) return findings;
  if (site.planes != nullptr) append(findings, check_acceleration_along(record.best(), sample, platform));
  if (site.field != nullptr) {
    const FieldComparison comparison = comparison_with(*site.field, site.options.magnetic.interpolation, readings,
                                                       platform.suite, record.best(), record.covariances());
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
