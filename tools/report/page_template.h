#pragma once

#include <string_view>

namespace lodestone {

/// The page with its styles and scripts in it, made from tools/report/page at build time. "@TITLE@" and "@DATA@" stand
/// where the report's own text goes.
extern const std::string_view kPageTemplate;

}  // namespace lodestone
