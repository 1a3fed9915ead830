#include "tools/writers/covariance_file.h"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <optional>

#include "core/error.h"
#include "frontends/configuration/number_text.h"
#include "frontends/configuration/trajectory_file.h"

namespace lodestone {

namespace {

constexpr std::array<const char*, 6> kTangentNames{"phi_x", "phi_y", "phi_z", "p_x", "p_y", "p_z"};
constexpr int kUpperEntries = 21;

std::optional<StampedCovariance> parse_row(std::string_view line) {
  StampedCovariance result;
  int row = 0;
  int column = 0;
  for (int field = 0; field <= kUpperEntries; ++field) {
    const std::size_t comma = line.find(',');
    if ((comma == std::string_view::npos) != (field == kUpperEntries)) return std::nullopt;
    const std::string_view text = line.substr(0, comma);
    line.remove_prefix(comma == std::string_view::npos ? line.size() : comma + 1);
    if (field == 0) {
      if (!parse_stamp(text, result.time)) return std::nullopt;
      continue;
    }
    double value = 0.0;
    if (!parse_number(text, value)) return std::nullopt;
    result.covariance(row, column) = result.covariance(column, row) = value;
    if (++column == 6) column = ++row;
  }
  return result;
}

}  // namespace

std::string covariance_header() {
  std::string text = "t_s";
  for (std::size_t row = 0; row < 6; ++row) {
    for (std::size_t column = row; column < 6; ++column)
      text += fmt::format(",{}.{}", kTangentNames[row], kTangentNames[column]);
  }
  return text + "\n";
}

std::string covariance_row(Time time, const Matrix6& covariance) {
  std::string text = format_stamp(time);
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) text += fmt::format(",{:.9g}", covariance(row, column));
  }
  return text + "\n";
}

std::vector<StampedCovariance> read_covariances(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file)
    throw InputError(fmt::format("{}: no such file; --covariance requires the covariance.csv of a run", path.string()));
  std::vector<StampedCovariance> result;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line.front() == '#' || line.starts_with("t_s")) continue;
    const auto entry = parse_row(line);
    if (!entry) {
      throw InputError(fmt::format("{}:{}: expected t_s and the 21 upper entries of a 6x6 covariance, comma-separated",
                                   path.string(), number));
    }
    result.push_back(*entry);
  }
  if (result.empty())
    throw InputError(fmt::format("{}: has no covariance; use the covariance.csv of a complete run", path.string()));
  return result;
}

}  // namespace lodestone
