#include "tools/plotting/png.h"

#include <opencv2/imgcodecs.hpp>
#include <stdexcept>
#include <vector>

namespace lodestone {

std::string encode_png(const cv::Mat& image) {
  std::vector<unsigned char> bytes;
  // The default level favours speed; reports would be a third larger.
  if (!cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_COMPRESSION, 6}))
    throw std::runtime_error("cannot encode a PNG");
  return {bytes.begin(), bytes.end()};
}

cv::Mat decode_png(const std::string& bytes) {
  if (!bytes.starts_with("\x89PNG")) return {};
  try {
    return cv::imdecode(
        cv::Mat1b(1, static_cast<int>(bytes.size()), reinterpret_cast<unsigned char*>(const_cast<char*>(bytes.data()))),
        cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {  // the header has more pixels than OpenCV accepts
    return {};
  }
}

}  // namespace lodestone
