#include "tools/writers/csv_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/number_text.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/csv_text.h"

namespace lodestone {

CsvTable::CsvTable(const std::filesystem::path& path) : path_(path.string()) {
  std::ifstream file(path);
  if (!file) throw InputError(fmt::format("{}: no such file; expected a file of a run folder", path_));
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty() || line.front() == '#') continue;
    const std::vector<std::string_view> parts = split_cells(line);
    std::vector<std::string> cells(parts.begin(), parts.end());
    if (header_.empty()) {
      header_ = std::move(cells);
      continue;
    }
    if (cells.size() != header_.size()) {
      throw InputError(fmt::format("{}:{}: expected {} values as in the header row, found {}", path_, number,
                                   header_.size(), cells.size()));
    }
    cells_.push_back(std::move(cells));
    lines_.push_back(number);
  }
  if (header_.empty()) throw InputError(fmt::format("{}: empty; expected a header row", path_));
}

bool CsvTable::has(const std::string& column) const {
  return std::find(header_.begin(), header_.end(), column) != header_.end();
}

std::size_t CsvTable::index_of(const std::string& column) const {
  const auto found = std::find(header_.begin(), header_.end(), column);
  if (found == header_.end()) {
    throw InputError(fmt::format("{}: expected a column '{}' in the header row, found {}; repeat the run", path_,
                                 column, join_names(header_)));
  }
  return static_cast<std::size_t>(found - header_.begin());
}

std::vector<double> CsvTable::numbers(const std::string& column) const {
  const std::size_t index = index_of(column);
  std::vector<double> values;
  values.reserve(cells_.size());
  for (std::size_t row = 0; row < cells_.size(); ++row) {
    const std::string& text = cells_[row][index];
    double value = 0.0;
    if (!parse_number(text, value)) {
      throw InputError(fmt::format("{}:{}: {}: expected a number, found '{}'", path_, lines_[row], column, text));
    }
    values.push_back(value);
  }
  return values;
}

std::vector<std::string> CsvTable::texts(const std::string& column) const {
  const std::size_t index = index_of(column);
  std::vector<std::string> values;
  values.reserve(cells_.size());
  for (const std::vector<std::string>& cells : cells_) values.push_back(cells[index]);
  return values;
}

std::vector<Vector3> CsvTable::vectors(const std::string& before, const std::string& after) const {
  std::vector<Vector3> values(rows(), Vector3::Zero());
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> column = numbers(before + "xyz"[axis] + after);
    for (std::size_t row = 0; row < rows(); ++row) values[row][axis] = column[row];
  }
  return values;
}

std::vector<Time> CsvTable::stamps(const std::string& column) const {
  const std::size_t index = index_of(column);
  std::vector<Time> values;
  values.reserve(cells_.size());
  for (std::size_t row = 0; row < cells_.size(); ++row) {
    Time time = 0;
    if (!parse_stamp(cells_[row][index], time)) {
      throw InputError(
          fmt::format("{}:{}: {}: expected seconds, found '{}'", path_, lines_[row], column, cells_[row][index]));
    }
    values.push_back(time);
  }
  return values;
}

}  // namespace lodestone
