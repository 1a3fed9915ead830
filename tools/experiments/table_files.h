#pragma once

#include <filesystem>

#include "tools/experiments/tables.h"

namespace lodestone::reproduce {

/// A pipe table with its title above and its note below; '|' in cells is escaped.
std::string to_markdown(const ResultTable& table);

/// Header and rows; cells with commas, quotes or line ends are quoted (RFC 4180).
std::string to_csv(const ResultTable& table);

/// A `table` with a plain `tabular` that compiles in any document class without packages; special characters are
/// escaped.
std::string to_latex(const ResultTable& table);

/// Writes NAME.md, NAME.csv and NAME.tex into `folder`, which must exist.
void write_table(const std::filesystem::path& folder, const ResultTable& table);

}  // namespace lodestone::reproduce
