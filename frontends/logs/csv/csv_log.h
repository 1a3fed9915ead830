#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/warnings.h"
#include "frontends/messages/message_source.h"

namespace lodestone {

/// A folder of CSV and PCD files as a log. Every file, and every folder of clouds, is a topic:
///
///   imu.csv              topic /imu              time_s, gyroscope_{x,y,z}_rad_s, accelerometer_{x,y,z}_m_s2
///   magnetometer_0.csv   topic /magnetometer_0   time_s, field_{x,y,z}_ut
///   points/TIME.pcd      topic /points           one cloud per file, stamped TIME (seconds)
///
/// and a/b.csv is /a/b, even if a is a link to a folder. The first line of a CSV file names its columns in any order;
/// other columns are ignored. time_ns (integer) may replace time_s. Messages have the layout of ROS 1, the field in
/// tesla, so that the platform file is the same as for a bag. The record time is the stamp.
class CsvLog : public MessageSource {
 public:
  /// Throws InputError if a CSV file has neither set of columns, a number cannot be read (with its line), or there are
  /// no files. An incomplete last line is ignored: log.cut_off in `warnings`, which must outlive this.
  CsvLog(const std::string& folder, WarningLog& warnings);
  ~CsvLog() override;

  /// True if the folder has a CSV file or a folder of clouds.
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
    /// Goes to the next message and sets its time; false at the end.
    virtual bool advance(Time& time) = 0;
    /// The bytes of the current message; valid until the next call.
    virtual const std::vector<std::uint8_t>& message() = 0;
  };

 private:
  struct Head;
  std::string folder_;
  std::vector<TopicInfo> topics_;
  std::vector<std::unique_ptr<Stream>> streams_;  ///< one per topic
  std::vector<Head> heads_;                       ///< next messages of the chosen streams
  std::size_t given_ = 0;                         ///< index of the last returned head, plus one
};

/// The streams of a folder: one per CSV file and one per folder of clouds.
std::unique_ptr<CsvLog::Stream> open_csv_stream(const std::string& path, const std::string& topic);
std::unique_ptr<CsvLog::Stream> open_cloud_stream(const std::string& folder, const std::string& topic);

}  // namespace lodestone
