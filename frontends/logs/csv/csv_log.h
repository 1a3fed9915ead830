#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/warnings.h"
#include "frontends/logs/message_source.h"

namespace lodestone {

/// A folder of CSV and PCD files as a log. Every file or folder in it is a topic of its own name:
///
///   imu.csv              topic /imu              time_s, gyroscope_{x,y,z}_rad_s, accelerometer_{x,y,z}_m_s2
///   magnetometer_0.csv   topic /magnetometer_0   time_s, field_{x,y,z}_ut
///   points/TIME.pcd      topic /points           one cloud a file, stamped TIME (seconds)
///
/// and a/b.csv is /a/b, also where a is a link to a folder. A CSV's first line names its columns, in any order, further
/// ones are not looked at; time_ns (integer) may stand for time_s. Messages come as ROS 1's, the field in tesla, so
/// that the platform file says what it says for a bag. The record time is the stamp.
class CsvLog : public MessageSource {
 public:
  /// Throws InputError where a CSV has neither set of columns, a number cannot be read (with its line), or nothing is
  /// there. A last line that was cut off is left out: log.cut_off in `warnings`, which must outlive this.
  CsvLog(const std::string& folder, WarningLog& warnings);
  ~CsvLog() override;

  /// Whether the folder has a CSV, or a folder of clouds.
  static bool is_in(const std::string& folder);

  const std::vector<TopicInfo>& topics() const override { return topics_; }
  void select(const std::vector<std::string>& names) override;
  bool next(RawMessage& message) override;

  /// The messages of one topic in the order of their file.
  class Stream {
   public:
    virtual ~Stream() = default;
    virtual TopicInfo inspect(WarningLog& warnings) = 0;
    virtual void rewind() = 0;
    /// The next one's time; false at the end.
    virtual bool advance(Time& time) = 0;
    /// The bytes of the message that advance() went to; they hold until the next call.
    virtual const std::vector<std::uint8_t>& message() = 0;
  };

 private:
  struct Head;
  std::string folder_;
  std::vector<TopicInfo> topics_;
  std::vector<std::unique_ptr<Stream>> streams_;  ///< of each topic
  std::vector<Head> heads_;                       ///< of the chosen ones
  std::size_t given_ = 0;                         ///< index of the head that was given last, plus one
};

/// The streams of a folder: one a CSV file, one a folder of clouds.
std::unique_ptr<CsvLog::Stream> open_csv_stream(const std::string& path, const std::string& topic);
std::unique_ptr<CsvLog::Stream> open_cloud_stream(const std::string& folder, const std::string& topic);

}  // namespace lodestone
