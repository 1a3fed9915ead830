#pragma once

#include <map>
#include <string>

#include "frontends/configuration/platform.h"

namespace lodestone {

/// A platform and a comment for each key that needs one, by its path in the file: "imu.rate_hz",
/// "magnetometers[0].unit".
struct CommentedPlatform {
  Platform platform;
  std::map<std::string, std::string> comments;
};

/// A platform file with the comments at the ends of their lines. Calibration and sigmas of the calibration, for which
/// the defaults count, are not written. load_platform reads the other values back to the same bits.
std::string commented_text(const CommentedPlatform& commented);

}  // namespace lodestone
