#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/evaluation/statistics.h"
#include "frontends/configuration/platform_lidars.h"
#include "tools/check/sensor_checks.h"

namespace lodestone {
namespace {

constexpr double rate_tolerance = 0.1;      // relative to the nominal rate
constexpr double sensor_gap_periods = 5.0;  // a lost packet or two are no gap
constexpr double scan_gap_periods = 1.7;    // every scan counts
constexpr double silent_s = 0.5;            // at the begin or end of the sample, plus two periods
constexpr double leap_s = 10.0;
constexpr double foreign_clock_s = 1.0;  // offset from the recorder's clock; a note

/// Checks the stamps of one sensor.
class StreamCheck {
 public:
  StreamCheck(const LogSample& sample, const StreamSample& stream, const Platform& platform)
      : sample_(sample), stream_(stream), platform_(platform), part_(part_of(stream.sensor)) {}

  Findings run() {
    if (!stream_.info || stream_.stamps.empty()) {
      if (stream_.info) silence(sample_.begin, sample_.end, "throughout");
      return findings_;
    }
    if (zero_stamps()) return findings_;
    check_order();
    check_rate();
    check_gaps();
    check_silence();
    check_recorder_clock();
    return findings_;
  }

 private:
  void add(Severity severity, const std::string& what, const std::string& seen, const std::string& change,
           std::optional<Time> time = std::nullopt) {
    findings_.push_back({severity, part_ + "." + what, stream_.topic + ": " + seen, change, time});
  }

  std::string file() const { return platform_.file_name(); }

  /// Zero for magnetometers and wheels: the platform file has no rate for them.
  double nominal_s() const {
    if (stream_.sensor == Sensor::imu) return 1.0 / platform_.suite.imu.rate_hz;
    return stream_.sensor == Sensor::lidar ? model_of(platform_, stream_.index).scan_period_s : 0.0;
  }

  bool zero_stamps() {
    const auto zeros = std::count(stream_.stamps.begin(), stream_.stamps.end(), Time{0});
    if (zeros == 0) return false;
    add(Severity::error, "stamp_zero",
        fmt::format("{} of {} messages have no stamp (0 s)", zeros, stream_.stamps.size()),
        "record the sensor's time in the messages' headers");
    return true;
  }

  /// Sets `intervals_`: differences of neighbouring stamps, if they increase.
  void check_order() {
    int back = 0, repeated = 0, leaps = 0;
    double furthest_s = 0.0;
    Time first = 0;
    Time last = stream_.stamps.front();
    for (std::size_t i = 1; i < stream_.stamps.size(); ++i) {
      const double step_s = to_seconds(stream_.stamps[i] - last);
      const double recorded_s = to_seconds(stream_.record_times[i] - stream_.record_times[i - 1]);
      if (step_s <= 0.0 || std::abs(step_s - recorded_s) > leap_s) {
        if (back + repeated + leaps == 0) first = stream_.stamps[i];
        (step_s == 0.0 ? repeated : step_s < 0.0 ? back : leaps) += 1;
        furthest_s = std::max(furthest_s, std::abs(step_s));
        if (step_s <= 0.0) continue;
      } else {
        intervals_.push_back(step_s);
        before_.push_back(last);
      }
      last = stream_.stamps[i];
    }
    if (back + repeated + leaps == 0) return;
    add(Severity::warning, "stamp_order",
        fmt::format("{} stamps go back, {} repeat, {} jump by more than {:g} s; the largest step is {:.3f} s; these "
                    "messages are "
                    "dropped",
                    back, repeated, leaps, leap_s, furthest_s),
        "use one steady clock for the driver's stamps", first);
  }

  void check_rate() {
    period_s_ = summarize(intervals_).median;
    const double nominal = nominal_s();
    if (nominal <= 0.0 || period_s_ <= 0.0 || intervals_.size() < 5) return;
    if (std::abs(period_s_ / nominal - 1.0) < rate_tolerance) return;
    const bool imu = stream_.sensor == Sensor::imu;
    add(Severity::warning, imu ? "rate" : "period",
        imu ? fmt::format("{:.1f} samples per second; the platform file has {:g}", 1.0 / period_s_, 1.0 / nominal)
            : fmt::format("one scan every {:.4f} s; the platform file has {:g} s", period_s_, nominal),
        imu ? fmt::format("imu.rate_hz: {:.1f} in {}", 1.0 / period_s_, file())
            : fmt::format("{}.scan_period_s: {:.4g} in {}", lidar_key(stream_.index), period_s_, file()),
        stream_.stamps.front());
  }

  void check_gaps() {
    const double periods = stream_.sensor == Sensor::lidar ? scan_gap_periods : sensor_gap_periods;
    int count = 0;
    double longest_s = 0.0, total_s = 0.0;
    Time first = 0;
    for (std::size_t i = 0; i < intervals_.size(); ++i) {
      if (intervals_[i] <= periods * period_s_) continue;
      if (count++ == 0) first = before_[i];
      longest_s = std::max(longest_s, intervals_[i]);
      total_s += intervals_[i];
    }
    if (count == 0) return;
    const bool lidar = stream_.sensor == Sensor::lidar;
    add(Severity::warning, lidar ? "outage" : "gap",
        fmt::format("{} gap{} without a {}, {:.3f} s in total, the longest {:.3f} s; expected one every {:.4g} s",
                    count, count == 1 ? "" : "s", lidar ? "scan" : "sample", total_s, longest_s, period_s_),
        "check the recorder and the driver's buffers for lost messages", first);
  }

  void silence(Time from, Time until, const char* where) {
    add(Severity::warning, "silent", fmt::format("no message {} ({:.2f} s)", where, to_seconds(until - from)),
        stream_.sensor == Sensor::magnetometer
            ? fmt::format("check the sensor, or remove magnetometers[{}] from {}", stream_.index, file())
        : stream_.sensor == Sensor::wheels
            ? fmt::format("check the driver, or remove the section wheels from {}", file())
            : "check the sensor and its driver",
        from);
  }

  /// Uses record times, because stamps may be of another clock.
  void check_silence() {
    const Time least = from_seconds(std::max(silent_s, 2.0 * period_s_));
    if (stream_.record_times.front() - sample_.begin > least)
      silence(sample_.begin, stream_.record_times.front(), "at the begin");
    if (sample_.end - stream_.record_times.back() > least)
      silence(stream_.record_times.back(), sample_.end, "at the end");
  }

  void check_recorder_clock() {
    std::vector<double> lags;
    for (std::size_t i = 0; i < stream_.stamps.size(); ++i) {
      lags.push_back(to_seconds(stream_.record_times[i] - stream_.stamps[i]));
    }
    const double lag_s = summarize(lags).median;
    if (std::abs(lag_s) < foreign_clock_s) return;
    add(Severity::note, "clock",
        fmt::format("stamps are {:.3f} s {} the recorder's clock", std::abs(lag_s), lag_s > 0.0 ? "behind" : "before"),
        "", stream_.stamps.front());
  }

  const LogSample& sample_;
  const StreamSample& stream_;
  const Platform& platform_;
  std::string part_;
  std::vector<double> intervals_;
  std::vector<Time> before_;  ///< stamp at the begin of each interval
  double period_s_ = 0.0;
  Findings findings_;
};

/// Sensors with unrelated clocks, which a run refuses.
Findings check_common_clock(const LogSample& sample) {
  Findings findings;
  const StreamSample* reference = nullptr;
  for (const StreamSample& stream : sample.streams) {
    if (stream.stamps.empty() || stream.stamps.front() == 0) continue;
    if (reference == nullptr) {
      reference = &stream;
      continue;
    }
    const double apart_s = to_seconds(stream.stamps.front() - reference->stamps.front());
    if (std::abs(apart_s) <= sample.log_duration_s + 1.0) continue;
    findings.push_back(
        {Severity::error, "clock.foreign",
         fmt::format("the first stamps of {} and {} differ by {:.3f} s, in a log of {:.3f} s: two clocks", stream.topic,
                     reference->topic, apart_s, sample.log_duration_s),
         "use one clock for both (PTP, or the host's time on arrival)", stream.stamps.front()});
  }
  return findings;
}

Findings check_values(const LogSample& sample) {
  Findings findings;
  for (const StreamSample& stream : sample.streams) {
    if (stream.not_finite == 0) continue;
    findings.push_back({Severity::warning, std::string(part_of(stream.sensor)) + ".not_finite",
                        fmt::format("{}: {} of {} messages have non-finite values", stream.topic, stream.not_finite,
                                    stream.stamps.size()),
                        "check the driver; these messages are discarded"});
  }
  return findings;
}

}  // namespace

Findings check_stamps(const LogSample& sample, const Platform& platform) {
  Findings findings = check_common_clock(sample);
  for (const StreamSample& stream : sample.streams) append(findings, StreamCheck(sample, stream, platform).run());
  append(findings, check_values(sample));
  return findings;
}

}  // namespace lodestone
