#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "frontends/messages/result_messages.h"

namespace lodestone {

/// Points for a PointCloud2 of float32 fields: x, y, z and further ones.
class PackedCloud {
 public:
  explicit PackedCloud(std::vector<std::string> fields) : fields_(std::move(fields)) {}

  /// The next values. A point has one for each field.
  void add(std::initializer_list<float> values) { values_.insert(values_.end(), values.begin(), values.end()); }
  bool empty() const { return values_.empty(); }

  std::vector<std::uint8_t> message(Time stamp, const std::string& frame) const {
    ros1::PointCloudMessage cloud;
    cloud.stamp = stamp;
    cloud.frame = frame;
    for (const std::string& name : fields_) {
      cloud.fields.push_back(
          {name, static_cast<std::uint32_t>(cloud.fields.size() * sizeof(float)), ros1::PointField::float32});
    }
    cloud.point_step = static_cast<std::uint32_t>(fields_.size() * sizeof(float));
    cloud.width = static_cast<std::uint32_t>(values_.size() / fields_.size());
    cloud.row_step = cloud.point_step * cloud.width;
    cloud.data = reinterpret_cast<const std::uint8_t*>(values_.data());
    cloud.data_size = values_.size() * sizeof(float);
    return cloud_message(cloud);
  }

 private:
  std::vector<std::string> fields_;
  std::vector<float> values_;
};

}  // namespace lodestone
