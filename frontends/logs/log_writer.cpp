#include "frontends/logs/log_writer.h"

#include "frontends/logs/ros1/bag_writer.h"

namespace lodestone {

bool can_pack(LogFormat format, Codec codec) {
  if (codec == Codec::none) return true;
  switch (format) {
    case LogFormat::rosbag:
      return codec == Codec::lz4 || codec == Codec::bz2;
    case LogFormat::mcap:
      return codec == Codec::lz4 || codec == Codec::zstd;
    case LogFormat::db3:
      break;
  }
  return codec == Codec::zstd;
}

std::unique_ptr<LogWriter> make_log_writer(const std::string& path, LogFormat format, Codec codec) {
  if (!can_pack(format, codec))
    throw std::invalid_argument("make_log_writer: the format does not support this compression");
  if (format == LogFormat::rosbag) return std::make_unique<ros1::BagWriter>(path, codec);
  return format == LogFormat::mcap ? make_mcap_writer(path, codec) : make_sqlite_writer(path, codec);
}

}  // namespace lodestone
