#pragma once

#include <string>
#include <string_view>

namespace lodestone {

/// Base64 text of bytes (RFC 4648, padded).
std::string base64(std::string_view bytes);

/// Bytes as a URI without network access: "data:image/png;base64,…".
std::string data_uri(std::string_view media_type, std::string_view bytes);

/// Escapes text for HTML and SVG.
std::string escape_html(std::string_view text);

}  // namespace lodestone
