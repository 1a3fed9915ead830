#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/evaluation/statistics.h"
#include "tools/experiments/tables.h"

namespace lodestone::reproduce {

namespace {

/// Result of a criterion for one row of a group.
struct Judgement {
  std::string row;
  bool open = true;  ///< not every seed has run
  bool met = false;
  double value = 0.0;
  double bound = 0.0;
};

Judgement judge(const Criterion& criterion, const Group& group, const std::string& row, const Results& results) {
  Judgement judgement;
  judgement.row = row;
  const SeedValue seeds = seed_value(results, group.name, row, criterion.estimator, criterion.figure,
                                     criterion.statistic, {criterion.over, criterion.over_figure});
  if (!seeds.value || seeds.present < seeds.expected) return judgement;
  judgement.open = false;
  judgement.value = *seeds.value;
  judgement.bound = criterion.limit.value_or(criterion.factor);  // for ratios, the factor is the bound
  if (!criterion.published.empty()) {
    const PublishedValue* published = group.published.find(row, criterion.published);
    // If the published method is lost, or nothing is published, every result that is not lost meets the criterion.
    judgement.bound = published != nullptr && published->value ? criterion.factor * *published->value : HUGE_VAL;
  }
  judgement.met = criterion.kind == CriterionKind::at_least ? judgement.value >= judgement.bound
                                                            : judgement.value <= judgement.bound;
  // If track is lost, the error covers only the stretch before the loss.
  if (seeds.lost > 0 && criterion.figure != "success") judgement.met = false;
  return judgement;
}

/// The row closest to its bound, or farthest beyond it, by the ratio of value and bound.
const Judgement& most_critical(const std::vector<Judgement>& judgements, CriterionKind kind) {
  const auto share = [kind](const Judgement& one) {
    const double ratio = std::isinf(one.bound) ? 0.0 : one.value / one.bound;
    return kind == CriterionKind::at_least ? -ratio : ratio;
  };
  return *std::max_element(judgements.begin(), judgements.end(),
                           [&](const Judgement& a, const Judgement& b) { return share(a) < share(b); });
}

std::vector<std::string> median_row(const Criterion& criterion, const std::vector<Judgement>& closed,
                                    const std::string& ran) {
  std::vector<double> values;
  for (const Judgement& one : closed) values.push_back(one.value);
  const double middle = summarize(values).median;
  const double bound = closed.front().bound;
  return {criterion.title, fmt::format("{} rows", closed.size()),
          fmt::format("median {:.4f}, bound {:.4f}", middle, bound),
          middle > bound ? "missed"
          : ran.empty()  ? "met"
                         : ran};
}

std::vector<std::string> row_of(const Criterion& criterion, const Group& group, const Results& results) {
  const auto meant = [&](const std::string& row) {
    return criterion.only.empty() || std::any_of(criterion.only.begin(), criterion.only.end(),
                                                 [&](const std::string& pattern) { return fits(pattern, {row}); });
  };
  std::vector<Judgement> closed;
  const std::vector<std::string> rows = row_names(group);
  const auto total = static_cast<std::size_t>(std::count_if(rows.begin(), rows.end(), meant));
  for (const std::string& row : results.rows_of(group.name)) {
    if (!meant(row)) continue;
    const Judgement judgement = judge(criterion, group, row, results);
    if (!judgement.open) closed.push_back(judgement);
  }
  const std::size_t wanted = criterion.rows ? static_cast<std::size_t>(*criterion.rows) : total;
  const std::string ran = closed.size() < total ? fmt::format("open: {} of {} rows ran", closed.size(), total) : "";
  if (closed.empty()) return {criterion.title, "", "", ran};
  if (criterion.kind == CriterionKind::spread) {
    const auto [least, most] = std::minmax_element(
        closed.begin(), closed.end(), [](const Judgement& a, const Judgement& b) { return a.value < b.value; });
    const double spread = most->value / least->value - 1.0;
    const bool met = spread <= *criterion.limit;
    const std::string worst = fmt::format("{:.4f} to {:.4f}: {:.1f} %, bound {:.1f} %", least->value, most->value,
                                          100.0 * spread, 100.0 * *criterion.limit);
    return {criterion.title, fmt::format("{} rows", closed.size()), worst, !met ? "missed" : ran.empty() ? "met" : ran};
  }
  if (criterion.kind == CriterionKind::median) return median_row(criterion, closed, ran);
  const auto met = static_cast<std::size_t>(
      std::count_if(closed.begin(), closed.end(), [](const Judgement& judgement) { return judgement.met; }));
  const Judgement& worst = most_critical(closed, criterion.kind);
  const std::string bound = std::isinf(worst.bound) ? "no bound" : fmt::format("bound {:.4f}", worst.bound);
  // The criterion is missed if too many rows miss it, even if other rows are open.
  const bool missed = closed.size() - met > total - std::min(wanted, total);
  return {criterion.title, fmt::format("{} of {}, {} wanted", met, closed.size(), wanted),
          fmt::format("{}: {:.4f}, {}", worst.row, worst.value, bound),
          missed        ? "missed"
          : ran.empty() ? "met"
                        : ran};
}

}  // namespace

ResultTable criteria_table(const Experiment& experiment, const Results& results) {
  ResultTable table{
      "criteria", "Criteria", {"criterion", "rows that meet it", "nearest to its bound", "result"}, {}, ""};
  for (const Criterion& criterion : experiment.criteria) {
    table.rows.push_back(row_of(criterion, *experiment.find_group(criterion.group), results));
  }
  return table;
}

}  // namespace lodestone::reproduce
