#include "frontends/readers/ros1/bag_writer.h"

#include <rosbag/bag.h>

#include <cstdio>
#include <filesystem>

#include "frontends/readers/ros1/serialization.h"

namespace lodestone::ros1 {
namespace {

rosbag::CompressionType rosbag_compression(Compression compression) {
  switch (compression) {
    case Compression::lz4:
      return rosbag::compression::LZ4;
    case Compression::bz2:
      return rosbag::compression::BZ2;
    case Compression::none:
      break;
  }
  return rosbag::compression::Uncompressed;
}

}  // namespace

struct BagWriter::Implementation {
  std::string path;
  std::string aside;
  rosbag::Bag bag;

  [[noreturn]] void fail(const std::exception& error) const {
    throw BagError(path + ": cannot write the bag: " + error.what());
  }

  template <class Message>
  void write(const std::string& topic, Time record_time, const Message& message) {
    try {
      bag.write(topic, to_ros(record_time), message);
    } catch (const std::exception& error) {
      fail(error);
    }
  }
};

BagWriter::BagWriter(const std::string& path, Compression compression)
    : implementation_(std::make_unique<Implementation>()) {
  implementation_->path = path;
  implementation_->aside = path + ".part";
  try {
    implementation_->bag.open(implementation_->aside, rosbag::bagmode::Write);
    implementation_->bag.setCompression(rosbag_compression(compression));
  } catch (const std::exception& error) {
    implementation_->fail(error);
  }
}

BagWriter::~BagWriter() {
  if (!implementation_->bag.isOpen()) return;
  try {
    implementation_->bag.close();
  } catch (const std::exception&) {
    // The file is given up anyway.
  }
  std::remove(implementation_->aside.c_str());
}

void BagWriter::write(const std::string& topic, Time record_time, const PointCloudMessage& message) {
  implementation_->write(topic, record_time, message);
}

void BagWriter::write(const std::string& topic, Time record_time, const LivoxMessage& message) {
  implementation_->write(topic, record_time, message);
}

void BagWriter::write(const std::string& topic, Time record_time, const ImuMessage& message) {
  implementation_->write(topic, record_time, message);
}

void BagWriter::write(const std::string& topic, Time record_time, const MagneticFieldMessage& message) {
  implementation_->write(topic, record_time, message);
}

void BagWriter::close() {
  try {
    implementation_->bag.close();
    std::filesystem::rename(implementation_->aside, implementation_->path);
  } catch (const std::exception& error) {
    implementation_->fail(error);
  }
}

}  // namespace lodestone::ros1
