#include "frontends/readers/logs/open_log.h"

#include "frontends/readers/rosbag/checked_bag.h"

namespace lodestone {

std::unique_ptr<MessageSource> open_log(const std::string& path, WarningLog& warnings) {
  return std::make_unique<CheckedBag>(path);
}

}  // namespace lodestone
