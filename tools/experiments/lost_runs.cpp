#include "tools/experiments/lost_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/plotting/run_folder.h"
#include "tools/run/run_summary.h"

namespace lodestone::reproduce {

namespace {

constexpr const char* kNever = "-";

/// The first time at which the position is more than 1 m off.
std::string first_error(const std::filesystem::path& folder, Time begin) {
  const figures::ErrorSeries errors = figures::read_error_series(folder, begin);
  const auto first = std::find_if(errors.error_m.begin(), errors.error_m.end(),
                                  [](double error_m) { return !(error_m <= kSuccess_m); });
  if (first == errors.error_m.end()) return kNever;
  return fmt::format("{:.1f}", errors.time_s[static_cast<std::size_t>(first - errors.error_m.begin())]);
}

/// The reason that the warning `run.lost` ends with.
std::string reason(const nlohmann::json& summary) {
  const std::string text = summary.value("/warnings/run.lost/first"_json_pointer, std::string());
  const std::size_t colon = text.find(": ");
  return colon == std::string::npos ? kNever : text.substr(colon + 2);
}

}  // namespace

ResultTable lost_runs_table(const Results& results, const std::filesystem::path& root) {
  ResultTable table{"lost",
                    "Runs that lost the robot",
                    {"run", "estimator", "status", "1 m off from s", "says lost from s", "why"},
                    {},
                    "Seconds since the first scan; -: never."};
  for (std::size_t i = 0; i < results.runs().size(); ++i) {
    const Run& run = results.runs()[i];
    for (const std::string& estimator : run.estimators) {
      const RunFigures* figures = results.find(i, estimator);
      if (value_of(figures, "success").value_or(1.0) == 1.0) continue;
      const std::filesystem::path folder = root / run.folder / estimator;
      const auto summary = nlohmann::json::parse(read_text_file((folder / "summary.json").string()));
      if (value_of(figures, "scans") == 0.0) {
        table.rows.push_back({run.name, estimator, summary.value("status", ""), kNever, kNever, reason(summary)});
        continue;
      }
      const Time begin = figures::begin_of(folder);
      Time lost = begin;
      const bool says = parse_stamp(summary.value("/lost/0/from_s"_json_pointer, std::string()), lost);
      table.rows.push_back({run.name, estimator, summary.value("status", ""), first_error(folder, begin),
                            says ? fmt::format("{:.1f}", to_seconds(lost - begin)) : kNever, reason(summary)});
    }
  }
  return table;
}

}  // namespace lodestone::reproduce
