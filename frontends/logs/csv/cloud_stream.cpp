#include <pcl/PCLPointCloud2.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>

#include <algorithm>
#include <filesystem>

#include "core/error.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/logs/csv/csv_log.h"
#include "frontends/maps/pcd_check.h"
#include "frontends/messages/message_writing.h"

namespace lodestone {
namespace {

namespace fs = std::filesystem;

struct CloudFile {
  Time time = 0;
  std::string path;
};

/// A folder with one cloud per file.
class CloudStream : public CsvLog::Stream {
 public:
  CloudStream(const std::string& folder, const std::string& topic) : topic_(topic) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      std::error_code broken;  // a broken or circular link
      if (!entry.is_regular_file(broken) || entry.path().extension() != ".pcd") continue;
      CloudFile file{0, entry.path().string()};
      constexpr Time last = Time{0xFFFFFFFF} * 1'000'000'000;
      if (!parse_stamp(entry.path().stem().string(), file.time) || file.time < 0 || file.time > last) {
        throw InputError(
            file.path +
            ": expected the cloud's time in seconds as its name, e.g. 1700000000.123456789.pcd; rename the file");
      }
      files_.push_back(std::move(file));
    }
    std::sort(files_.begin(), files_.end(), [](const CloudFile& a, const CloudFile& b) {
      return a.time != b.time ? a.time < b.time : a.path < b.path;
    });
  }

  TopicInfo inspect(WarningLog&) override {
    TopicInfo info;
    info.name = topic_;
    info.type = "sensor_msgs/PointCloud2";
    for (const CloudFile& file : files_) add_messages(info, file.time, file.time, 1);
    return info;
  }
  void rewind() override { next_ = 0; }
  bool advance(Time& time) override {
    if (next_ >= files_.size()) return false;
    time = files_[next_++].time;
    return true;
  }

  const std::vector<std::uint8_t>& message() override {
    const CloudFile& file = files_[next_ - 1];
    const pcl::PCLPointCloud2 cloud = load(file.path);
    ros1::PointCloudMessage message;
    message.stamp = file.time;
    message.height = cloud.height;
    message.width = cloud.width;
    for (const pcl::PCLPointField& field : cloud.fields) {
      message.fields.push_back({field.name, field.offset, field.datatype, field.count});
    }
    message.point_step = cloud.point_step;
    message.row_step = cloud.row_step;
    message.dense = cloud.is_dense != 0;
    message.data = cloud.data.data();
    message.data_size = cloud.data.size();
    Ros1WireWriter writer;
    writing::write(writer, message);
    return bytes_ = writer.take();
  }

 private:
  static pcl::PCLPointCloud2 load(const std::string& path) {
    check_pcd(path, std::uint64_t{1} << 30, "remove it from the folder");
    pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // errors are reported by InputError
    pcl::PCLPointCloud2 cloud;
    int result = -1;
    try {
      result = pcl::PCDReader().read(path, cloud);
    } catch (const std::exception&) {
      // reported below
    }
    if (result < 0 || cloud.data.size() != std::size_t{cloud.width} * cloud.height * cloud.point_step) {
      throw InputError(path + ": is not a PCD file, or is cut off or damaged; remove it from the folder");
    }
    return cloud;
  }

  std::string topic_;
  std::vector<CloudFile> files_;
  std::size_t next_ = 0;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace

std::unique_ptr<CsvLog::Stream> open_cloud_stream(const std::string& folder, const std::string& topic) {
  return std::make_unique<CloudStream>(folder, topic);
}

}  // namespace lodestone
