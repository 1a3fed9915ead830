#pragma once

#include <string>
#include <string_view>

namespace lodestone {

/// Base64 text of bytes (RFC 4648, padded).
std::string base64(std::string_view bytes);

}  // namespace lodestone
