#include <fmt/format.h>

#include <fstream>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/number_text.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/csv_text.h"
#include "frontends/logs/csv/csv_log.h"
#include "frontends/messages/message_writing.h"

namespace lodestone {
namespace {

using Names = std::vector<std::string>;

const Names imu_columns{"gyroscope_x_rad_s",    "gyroscope_y_rad_s",    "gyroscope_z_rad_s",
                        "accelerometer_x_m_s2", "accelerometer_y_m_s2", "accelerometer_z_m_s2"};
const Names field_columns{"field_x_ut", "field_y_ut", "field_z_ut"};

/// The CSV file of one IMU or one magnetometer.
class CsvStream : public CsvLog::Stream {
 public:
  CsvStream(const std::string& path, const std::string& topic) : path_(path), topic_(topic) { read_header(); }

  TopicInfo inspect(WarningLog& warnings) override {
    TopicInfo info;
    info.name = topic_;
    info.type = is_imu_ ? "sensor_msgs/Imu" : "sensor_msgs/MagneticField";
    warnings_ = &warnings;
    for (Time time = 0; advance(time);) add_messages(info, time, time, 1);
    warnings_ = nullptr;  // warn only once
    return info;
  }

  void rewind() override { read_header(); }

  bool advance(Time& time) override {
    while (std::getline(file_, line_)) {
      ++number_;
      const std::string_view text = trimmed(line_);
      if (text.empty() || text.front() == '#') continue;
      if (file_.eof()) {
        // A last line without newline may be cut within a number, and would still be readable.
        if (warnings_ == nullptr) return false;
        warnings_->add(
            "log.cut_off",
            fmt::format("{}:{}: the last line does not end with a newline and may be cut off; it is ignored; "
                        "if the line is complete, add a newline",
                        path_, number_),
            time_);
        return false;
      }
      const std::string wrong = parse(text);
      if (!wrong.empty()) throw InputError(fmt::format("{}:{}: {}", path_, number_, wrong));
      time = time_;
      return true;
    }
    return false;
  }

  const std::vector<std::uint8_t>& message() override {
    Ros1WireWriter writer;
    const auto& v = values_;
    if (is_imu_) {
      writing::write(writer, ros1::ImuMessage{time_, "", {v[0], v[1], v[2]}, {v[3], v[4], v[5]}});
    } else {
      writing::write(writer, ros1::MagneticFieldMessage{time_, "", {v[0] / 1e6, v[1] / 1e6, v[2] / 1e6}});
    }
    return bytes_ = writer.take();
  }

 private:
  void read_header() {
    file_.close();
    file_.clear();
    file_.open(path_, std::ios::binary);
    number_ = 0;
    if (!file_) throw InputError(path_ + ": cannot be opened for reading; check its permissions");
    do {
      ++number_;
      if (!std::getline(file_, line_))
        throw InputError(path_ + ": the file is empty; expected a header line with the columns");
    } while (trimmed(line_).empty());
    std::string_view text = trimmed(line_);
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // byte-order mark of some spreadsheets
    if (text.starts_with('#')) text = trimmed(text.substr(1));
    separator_ = separator_of(text);
    const std::vector<std::string_view> found = split_cells(text, separator_);
    const auto place_of = [&](std::string_view name) {
      const auto at = std::find(found.begin(), found.end(), name);
      return at == found.end() ? -1 : static_cast<int>(at - found.begin());
    };
    is_imu_ = place_of(imu_columns.front()) >= 0;
    columns_.clear();
    nanoseconds_ = place_of("time_s") < 0;
    columns_.push_back(place_of(nanoseconds_ ? "time_ns" : "time_s"));
    const Names& names = is_imu_ ? imu_columns : field_columns;
    for (const std::string& name : names) columns_.push_back(place_of(name));
    if (std::find(columns_.begin(), columns_.end(), -1) == columns_.end()) return;
    throw InputError(fmt::format(
        "{}:{}: found the columns {}; expected time_s (or time_ns) and either {}, or {}; rename the columns, or "
        "remove the file from the folder",
        path_, number_, join_names(Names(found.begin(), found.end())), join_names(field_columns),
        join_names(imu_columns)));
  }

  /// Sets time and values. Returns the error of the line, or an empty text.
  std::string parse(std::string_view text) {
    const std::vector<std::string_view> parts = split_cells(text, separator_);
    const auto part = [&](std::size_t i) {
      const auto column = static_cast<std::size_t>(columns_[i]);
      return column < parts.size() ? parts[column] : std::string_view();
    };
    const std::string_view stamp = part(0);
    Time time = 0;
    if (nanoseconds_) {
      if (!parse_number(stamp, time)) time = -1;
    } else if (!parse_stamp(stamp, time)) {
      time = -1;
    }
    constexpr Time last = Time{0xFFFFFFFF} * 1'000'000'000;
    if (time < 0 || time > last) return fmt::format("'{}' is not a time from 0 to 2^32 s", stamp);
    for (std::size_t i = 1; i < columns_.size(); ++i) {
      const std::string_view value = part(i);
      if (!parse_number(value, values_[i - 1])) {
        return fmt::format("'{}' is not a number, in column {}", value, columns_[i] + 1);
      }
    }
    time_ = time;
    return {};
  }

  std::string path_, topic_;
  std::ifstream file_;
  std::string line_;
  int number_ = 0;  ///< line number
  char separator_ = ',';
  bool is_imu_ = false, nanoseconds_ = false;
  std::vector<int> columns_;  ///< column indices of time and values
  Time time_ = 0;
  std::array<double, 6> values_{};
  std::vector<std::uint8_t> bytes_;
  WarningLog* warnings_ = nullptr;
};

}  // namespace

std::unique_ptr<CsvLog::Stream> open_csv_stream(const std::string& path, const std::string& topic) {
  return std::make_unique<CsvStream>(path, topic);
}

}  // namespace lodestone
