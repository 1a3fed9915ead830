#include "tools/check/check_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "frontends/configuration/options.h"
#include "frontends/configuration/text_file.h"
#include "tools/table.h"

namespace lodestone {

namespace {

double rate_of(const TopicInfo& topic) {
  const double duration_s = to_seconds(topic.end - topic.begin);
  return topic.messages > 1 && duration_s > 0.0 ? static_cast<double>(topic.messages - 1) / duration_s : std::nan("");
}

/// Reported times are relative to the earliest stamp of all sensors.
Time first_stamp(const LogSample& sample) {
  std::optional<Time> first;
  for (const StreamSample& stream : sample.streams) {
    if (!stream.stamps.empty() && stream.stamps.front() != 0 && (!first || stream.stamps.front() < *first))
      first = stream.stamps.front();
  }
  return first.value_or(sample.begin);
}

/// The platform key of the sensor with this topic, and the number of other sensors with it.
std::string used_as(const LogSample& sample, const TopicInfo& topic) {
  std::string key;
  int more = 0;
  for (const StreamSample& stream : sample.streams) {
    if (stream.topic != topic.name || !stream.info) continue;
    if (key.empty()) {
      key = stream.key;
    } else {
      ++more;
    }
  }
  return more == 0 ? key : fmt::format("{} and {} more", key, more);
}

}  // namespace

std::string summary_of(const Findings& findings) {
  std::string text;
  for (const Severity severity : {Severity::error, Severity::warning, Severity::note}) {
    const auto count =
        std::count_if(findings.begin(), findings.end(), [&](const Finding& one) { return one.severity == severity; });
    text += fmt::format("{}{} {}{}", text.empty() ? "" : ", ", count, options_detail::write_value(severity),
                        count == 1 ? "" : "s");
  }
  return text;
}

std::string check_text(const CheckResult& result) {
  const LogSample& sample = result.sample;
  Table table({"topic", "type", "messages", "per second", "platform"});
  for (const TopicInfo& topic : sample.topics) {
    table.add(
        {topic.name, topic.type, std::to_string(topic.messages), fixed(rate_of(topic), 1), used_as(sample, topic)});
  }
  std::string text = table.to_string() + "\n";
  if (sample.end > sample.begin) {
    text += fmt::format("{}: the first {:.1f} s of {:.1f} s\n", sample.path, to_seconds(sample.end - sample.begin),
                        sample.log_duration_s);
  }
  const Time zero = first_stamp(sample);
  for (const Finding& finding : result.findings) {
    const std::string when = finding.time ? fmt::format(" at {:.2f} s", to_seconds(*finding.time - zero)) : "";
    text += fmt::format("{:<8} {}{}: {}\n", options_detail::write_value(finding.severity), finding.kind, when,
                        finding.seen);
    if (!finding.change.empty()) text += fmt::format("         -> {}\n", finding.change);
  }
  return text + summary_of(result.findings) + "\n";
}

void write_check_json(const std::filesystem::path& path, const CheckResult& result) {
  using Json = nlohmann::ordered_json;
  const LogSample& sample = result.sample;
  const Time zero = first_stamp(sample);
  Json json;
  json["log"] = sample.path;
  json["checked_s"] = to_seconds(sample.end - sample.begin);
  json["log_s"] = sample.log_duration_s;
  json["summary"] = summary_of(result.findings);
  json["topics"] = Json::array();
  for (const TopicInfo& topic : sample.topics) {
    Json one{{"topic", topic.name},
             {"type", topic.type},
             {"messages", topic.messages},
             {"platform", used_as(sample, topic)}};
    const double rate = rate_of(topic);
    one["rate_hz"] = std::isfinite(rate) ? Json(rate) : Json(nullptr);
    json["topics"].push_back(one);
  }
  json["findings"] = Json::array();
  for (const Finding& finding : result.findings) {
    json["findings"].push_back({{"severity", options_detail::write_value(finding.severity)},
                                {"kind", finding.kind},
                                {"seen", finding.seen},
                                {"change", finding.change},
                                {"time_s", finding.time ? Json(to_seconds(*finding.time - zero)) : Json(nullptr)}});
  }
  // Names in a damaged log may be invalid UTF-8.
  write_text_file(path, json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

}  // namespace lodestone
