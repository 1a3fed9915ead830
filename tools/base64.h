#pragma once

#include <string>
#include <string_view>

namespace lodestone {

/// Bytes as letters (RFC 4648, padded).
std::string base64(std::string_view bytes);

}  // namespace lodestone
