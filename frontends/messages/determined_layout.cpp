#include "frontends/messages/point_cloud_decoder.h"

namespace lodestone {

std::optional<LidarMessageLayout> PointCloudDecoder::determined_layout() const {
  if (!reading_is_final_) return std::nullopt;
  LidarMessageLayout layout = layout_;
  layout.intensity_field = livox_ ? "" : fields_.intensity.name;
  layout.ring_field = livox_ ? "" : fields_.ring.name;
  layout.time_field.clear();
  layout.time_unit.reset();
  layout.time_zero.reset();
  if (livox_ || is_deskewed()) return layout;
  layout.time_field = time_.name.substr(0, time_.name.find(" + "));  // either field names a pair
  layout.time_unit = reading_->unit;
  layout.time_zero = reading_->zero;
  return layout;
}

}  // namespace lodestone
