#pragma once

#include <string_view>

namespace lodestone {

/// The page with its styles and scripts, generated from tools/report/page. "@TITLE@" and "@DATA@" are placeholders.
extern const std::string_view kPageTemplate;

}  // namespace lodestone
