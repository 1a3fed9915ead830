// Output of a run's figures: JSON for scripts, tables for the terminal.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "frontends/configuration/options.h"
#include "frontends/configuration/trajectory_file.h"
#include "tools/run/bound_run.h"
#include "tools/run/run_summary.h"
#include "tools/table.h"

namespace lodestone {

namespace {

using Json = nlohmann::ordered_json;

/// JSON has no NaN; null instead.
Json number(double value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}
Json number(const std::optional<double>& value) {
  return value ? number(*value) : Json(nullptr);
}

Json json_of(const RunSummary& summary) {
  Json json;
  json["estimator"] = summary.estimator;
  if (!summary.solver.empty()) json["solver"] = summary.solver;
  json["scans"] = summary.scans;
  json["duration_s"] = number(summary.duration_s);
  json["wall_s"] = number(summary.wall_s);
  json["refine_s"] = number(summary.refine_s);
  json["work_s"] = Json::object();
  for (std::size_t i = 0; i < kWorkNames.size(); ++i) {
    if (summary.work_s[i] > 0.0) json["work_s"][kWorkNames[i]] = number(summary.work_s[i]);
  }
  json["real_time_factor"] = number(summary.real_time_factor());
  json["peak_rss_mb"] = number(summary.peak_rss_mb);
  json["status"] = options_detail::write_value(summary.status);
  json["lost"] = Json::array();
  for (const LostInterval& interval : summary.lost) {
    json["lost"].push_back({{"from_s", format_stamp(interval.from)},
                            {"to_s", format_stamp(interval.to)},
                            {"regained", interval.regained}});
  }
  json["uncertain_scans"] = summary.uncertain_scans;
  json["degenerate_scans"] = summary.degenerate_scans;
  json["magnetic_rejected"] = summary.magnetic_rejected;
  if (summary.lidar_nis) json["lidar_nis"] = number(summary.lidar_nis);
  if (summary.magnetic_nis) json["magnetic_nis"] = number(summary.magnetic_nis);
  if (summary.clock_sigma_s > 0.0) {
    json["magnetometer_clock_offset_s"] = number(summary.clock_offset_s);
    json["magnetometer_clock_offset_sigma_s"] = number(summary.clock_sigma_s);
  }
  json["warnings"] = Json::object();
  for (const auto& [kind, entry] : summary.warnings.entries()) {
    json["warnings"][kind] = {
        {"count", entry.count}, {"first", entry.first_detail}, {"at_s", format_stamp(entry.first_time)}};
  }
  if (summary.truth) {
    json["ate_m"] = number(summary.truth->ate_m);
    json["ate_se3_m"] = number(summary.truth->ate_se3_m);
    json["max_error_m"] = number(summary.truth->max_error_m);
    json["heading_rmse_deg"] = number(summary.truth->heading_rmse_deg);
    json["nees_pose"] = number(summary.truth->nees_pose);
    json["success"] = summary.truth->success;
  }
  for (const StageFigures& stage : summary.stages) {
    Json& figures = json["stages"][stage.name];
    figures["ate_m"] = number(stage.ate_m);
    figures["max_error_m"] = number(stage.max_error_m);
    figures["largest_jump_m"] = number(stage.largest_jump_m);
    figures["heading_rmse_deg"] = number(stage.heading_rmse_deg);
    figures["share_within_100mm"] = number(stage.share_within_100mm);
    figures["share_within_1m"] = number(stage.share_within_1m);
    if (stage.ate_over_bound) figures["ate_over_bound"] = number(*stage.ate_over_bound);
    if (!stage.consistency) continue;
    const Consistency& consistency = *stage.consistency;
    figures["nees_pose"] = number(consistency.nees);
    figures["nees_rotation"] = number(consistency.nees_rotation);
    figures["nees_position"] = number(consistency.nees_position);
    figures["nees_low"] = number(consistency.nees_low);
    figures["nees_high"] = number(consistency.nees_high);
    for (const double value : consistency.nees_axis) figures["nees_axis"].push_back(number(value));
    figures["share_within_95"] = number(consistency.share_within_95);
  }
  if (summary.calibration) {
    json["calibration"] = {{"parameters", summary.calibration->parameters},
                           {"nees", number(summary.calibration->nees)},
                           {"nees_lidar", number(summary.calibration->nees_lidar)},
                           {"prior_nees", number(summary.calibration->prior_nees)}};
  }
  if (summary.stale_map) {
    const StaleMap& stale = *summary.stale_map;
    const double largest_ut = stale.places.empty() ? 0.0 : stale.places.front().largest_difference_ut;
    json["stale_map"] = {{"places", stale.cells.size()},  // visited cells
                         {"stale", stale.stale_cells()},  // stale cells
                         {"stale_places", stale.places.size()},
                         {"largest_difference_ut", number(largest_ut)},
                         {"false_alarm_probability", stale.options.false_alarm_probability},
                         {"expected_false_alarms", stale.expected_false_alarms()}};
  }
  return json;
}

/// The worst status is the status of the call.
RunStatus overall(const std::vector<RunSummary>& runs) {
  RunStatus status = RunStatus::done;
  for (const RunSummary& run : runs) status = std::max(status, run.status);
  return status;
}

Json text_or_null(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

Json json_of(const CallRecord& record) {
  const RunCall& call = record.call;
  Json json;
  json["log"] = text_or_null(call.log);
  json["platform"] = text_or_null(call.platform);
  json["cloud"] = text_or_null(call.cloud);
  json["magnetic"] = text_or_null(call.magnetic);
  json["origin_m"] = {call.origin_m.x(), call.origin_m.y(), call.origin_m.z()};
  json["truth"] = text_or_null(call.truth);
  json["calibration_truth"] = text_or_null(call.calibration_truth);
  json["initial_pose"] = text_or_null(call.initial_pose);
  json["initial_pose_from"] = text_or_null(call.initial_pose_from);
  json["estimators"] = call.estimators;
  json["max_range_m"] = number(record.max_range_m);
  json["refine"] = record.refines ? "batch" : "none";
  json["bound"] = call.bound;
  json["config"] = call.configurations;
  json["set"] = call.settings;
  json["check_seconds"] = number(call.check_seconds);
  return json;
}

/// "lost", "lost, regained 2 x": what a status alone does not show.
std::string status_text(const RunSummary& run) {
  std::ptrdiff_t regained =
      std::count_if(run.lost.begin(), run.lost.end(), [](const LostInterval& one) { return one.regained; });
  if (regained == 0) return options_detail::write_value(run.status);
  return fmt::format(
      "{}regained {} x",
      run.status == RunStatus::regained ? "" : fmt::format("{}, ", options_detail::write_value(run.status)), regained);
}

std::string optional_fixed(const std::optional<double>& value, int digits) {
  return fixed(value.value_or(std::nan("")), digits);
}

}  // namespace

std::string to_json(const RunSummary& summary) {
  return json_of(summary).dump(2) + "\n";
}

std::string to_json(const std::vector<std::pair<std::string, std::string>>& inputs, const CallRecord& call,
                    const std::vector<RunSummary>& runs, const std::optional<Bound>& bound) {
  Json json;
  for (const auto& [name, value] : inputs) json[name] = text_or_null(value);
  json["call"] = json_of(call);
  json["status"] = options_detail::write_value(overall(runs));
  if (bound) {
    for (const Bound::Stage& stage : bound->stages) {
      json["bound"][stage.name] = {{"position_m", number(stage.position_m)},
                                   {"heading_deg", number(stage.heading_deg)}};
    }
  }
  json["estimators"] = Json::object();
  for (const RunSummary& run : runs) json["estimators"][run.estimator] = json_of(run);
  return json.dump(2) + "\n";
}

std::string ab_table(const std::vector<RunSummary>& runs) {
  bool with_truth = false;
  for (const RunSummary& run : runs) with_truth = with_truth || run.truth.has_value();
  std::vector<std::string> header{"estimator", "status", "scans", "uncertain"};
  if (with_truth) {
    for (const char* name : {"ATE m", "ATE SE3 m", "max m", "heading °", "NEES", "success"}) header.emplace_back(name);
  }
  for (const char* name : {"degenerate", "mag. rejected", "x real time", "peak MB"}) header.emplace_back(name);
  Table table(header);
  for (const RunSummary& run : runs) {
    // The causal estimate is a row of its own below the refined one.
    const bool refined = run.stages.size() == 3;
    std::vector<std::string> row{refined ? run.estimator + " (batch)" : run.estimator, status_text(run),
                                 std::to_string(run.scans), std::to_string(run.uncertain_scans)};
    if (with_truth) {
      const TruthFigures figures = run.truth.value_or(TruthFigures{});
      row.insert(row.end(), {fixed(figures.ate_m, 4), optional_fixed(figures.ate_se3_m, 4),
                             fixed(figures.max_error_m, 3), fixed(figures.heading_rmse_deg, 3),
                             optional_fixed(figures.nees_pose, 2), figures.success ? "yes" : "no"});
    }
    row.insert(row.end(), {run.saw_lidar ? std::to_string(run.degenerate_scans) : "-",
                           run.saw_field ? std::to_string(run.magnetic_rejected) : "-",
                           fixed(run.real_time_factor(), 1), fixed(run.peak_rss_mb, 0)});
    table.add(row);
    for (std::size_t i = 0; refined && i + 1 < run.stages.size(); ++i) {
      const StageFigures& stage = run.stages[i];
      std::vector<std::string> below{"  " + stage.name,
                                     "",
                                     "",
                                     "",
                                     fixed(stage.ate_m, 4),
                                     "",
                                     fixed(stage.max_error_m, 3),
                                     fixed(stage.heading_rmse_deg, 3),
                                     stage.consistency ? fixed(stage.consistency->nees, 2) : "-"};
      below.resize(header.size());
      table.add(below);
    }
  }
  return table.to_string();
}

std::string warnings_text(const std::vector<RunSummary>& runs) {
  // Warnings of the front end occur in every run of the same log: one line per kind, with differing counts by run.
  std::map<std::string, std::map<std::int64_t, std::vector<std::string>>> counts;
  std::map<std::string, std::string> details;
  for (const RunSummary& run : runs) {
    for (const auto& [kind, entry] : run.warnings.entries()) {
      counts[kind][entry.count].push_back(run.estimator);
      details.try_emplace(kind, entry.first_detail);
    }
  }
  std::string text;
  for (const auto& [kind, by_count] : counts) {
    std::string times;
    for (const auto& [count, names] : by_count) {
      times += fmt::format("{}{} x", times.empty() ? "" : ", ", count);
      if (names.size() == runs.size()) continue;
      for (std::size_t i = 0; i < names.size(); ++i) times += (i == 0 ? " in " : ", ") + names[i];
    }
    text += fmt::format("  {} ({}): {}\n", kind, times, details[kind]);
  }
  return text.empty() ? text : "Warnings:\n" + text;
}

std::string bound_text(const Bound& bound, const std::vector<RunSummary>& runs) {
  std::vector<std::string> header{"ATE / bound"};
  std::vector<std::string> limit{"bound, m"};
  for (const Bound::Stage& stage : bound.stages) {
    header.push_back(stage.name);
    limit.push_back(fixed(stage.position_m, 4));
  }
  Table table(header);
  table.add(limit);
  for (const RunSummary& run : runs) {
    std::vector<std::string> row{run.estimator};
    for (const Bound::Stage& limit_of : bound.stages) {
      row.emplace_back("-");
      for (const StageFigures& stage : run.stages) {
        if (stage.name == limit_of.name && stage.ate_over_bound) row.back() = fixed(*stage.ate_over_bound, 2);
      }
    }
    table.add(row);
  }
  return table.to_string();
}

}  // namespace lodestone
