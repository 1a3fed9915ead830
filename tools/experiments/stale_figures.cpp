#include "tools/experiments/stale_figures.h"

#include "tools/writers/csv_table.h"

namespace lodestone::reproduce {

namespace {

constexpr double kChangedUt = 10.0;
/// Approximate survey error of a map, µT: smaller differences between two maps of one field are random.
constexpr double kUnchangedUt = 0.3;

double share(std::size_t part, std::size_t whole, double of_none) {
  return whole == 0 ? of_none : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

std::map<std::string, double> stale_figures(const std::filesystem::path& cells, const MagneticMap& field,
                                            const MagneticMap& own) {
  const CsvTable table(cells);
  const std::vector<Vector3> positions = table.vectors("", "_m");
  const std::vector<double> place = table.numbers("place");
  std::size_t changed = 0;
  std::size_t found = 0;
  std::size_t unchanged = 0;
  std::size_t reported = 0;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    const auto used = field.query(positions[i], FieldInterpolation::bicubic);
    const auto today = own.query(positions[i], FieldInterpolation::bicubic);
    if (!used || !today) continue;
    const double change_ut = (used->field_ut - today->field_ut).norm();
    const bool is_reported = place[i] > 0.0;
    if (change_ut > kChangedUt) {
      ++changed;
      found += is_reported ? 1 : 0;
    } else if (change_ut < kUnchangedUt) {
      ++unchanged;
      reported += is_reported ? 1 : 0;
    }
  }
  return {{"changed_cells", static_cast<double>(changed)},
          {"changed_found", share(found, changed, 1.0)},
          {"unchanged_reported", share(reported, unchanged, 0.0)}};
}

bool is_stale_figure(const std::string& name) {
  return name == "changed_cells" || name == "changed_found" || name == "unchanged_reported";
}

}  // namespace lodestone::reproduce
