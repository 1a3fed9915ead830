#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

namespace lodestone {

/// The image as the bytes of a PNG file: 8 or 16 bits of grey, BGR or BGRA. The same image gives the same bytes.
/// Throws std::runtime_error if the encoder fails.
std::string encode_png(const cv::Mat& image);

/// The image of a PNG file; empty if the bytes are not a readable PNG.
cv::Mat decode_png(const std::string& bytes);

}  // namespace lodestone
