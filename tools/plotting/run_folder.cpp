#include "tools/plotting/run_folder.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/writers/csv_table.h"
#include "tools/writers/error_file.h"

namespace lodestone::figures {

namespace {

std::vector<double> seconds_since(const std::vector<Time>& times, Time begin) {
  std::vector<double> seconds;
  seconds.reserve(times.size());
  for (const Time time : times) seconds.push_back(to_seconds(time - begin));
  return seconds;
}

}  // namespace

Time begin_of(const std::filesystem::path& folder) {
  const std::vector<Time> times = CsvTable(folder / "diagnostics.csv").stamps("t_s");
  if (times.empty())
    throw InputError(fmt::format("{}: there is no scan; use the folder of a run with estimates",
                                 (folder / "diagnostics.csv").string()));
  return times.front();
}

ErrorSeries read_error_series(const std::filesystem::path& folder, Time begin) {
  ErrorSeries series;
  series.method = folder.filename().string();
  for (const ErrorRow& row : read_errors(folder / "errors.csv")) {
    series.time_s.push_back(to_seconds(row.time - begin));
    series.error_m.push_back(row.norm_m);
  }
  return series;
}

std::vector<TimeInterval> read_degenerate_stretches(const std::filesystem::path& folder, Time begin) {
  constexpr double kJoin_s = 1.0, kLeast_s = 0.5;
  const CsvTable table(folder / "diagnostics.csv");
  const std::vector<double> time = seconds_since(table.stamps("t_s"), begin);
  const std::vector<double> directions = table.numbers("degenerate_directions");
  std::vector<TimeInterval> intervals;
  for (std::size_t i = 0; i < time.size(); ++i) {
    if (!(directions[i] > 0.0)) continue;
    const double from = i > 0 ? time[i - 1] : time[i];  // a scan ends at its stamp
    if (!intervals.empty() && from - intervals.back().second <= kJoin_s) {
      intervals.back().second = time[i];
    } else {
      intervals.emplace_back(from, time[i]);
    }
  }
  std::erase_if(intervals, [](const TimeInterval& one) { return one.second - one.first < kLeast_s; });
  return intervals;
}

ResidualTrack read_residuals(const std::filesystem::path& folder, Time begin) {
  const CsvTable table(folder / "field_residuals.csv");
  ResidualTrack track;
  track.time_s = seconds_since(table.stamps("t_s"), begin);
  track.difference_ut = table.numbers("mean_difference_ut");
  track.position = table.vectors("", "_m");
  return track;
}

std::vector<Vector3> read_track(const std::filesystem::path& folder) {
  std::vector<Vector3> track;
  for (const StampedPose& pose : read_tum((folder / "trajectory.tum").string())) track.push_back(pose.pose.position);
  return track;
}

}  // namespace lodestone::figures
