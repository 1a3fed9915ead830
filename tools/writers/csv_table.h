#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/geometry/so3.h"
#include "core/time.h"

namespace lodestone {

/// A CSV file of a run folder: a header row, then rows with the same number of values. Lines with '#' are comments.
class CsvTable {
 public:
  /// Reads the file. Throws InputError with file and line if the file is missing or a row has another length.
  explicit CsvTable(const std::filesystem::path& path);

  std::size_t rows() const { return cells_.size(); }
  bool has(const std::string& column) const;
  const std::vector<std::string>& columns() const { return header_; }

  /// A column by name. Throw InputError with file and line if the column is missing or a value cannot be parsed.
  std::vector<double> numbers(const std::string& column) const;
  std::vector<std::string> texts(const std::string& column) const;
  /// The columns BEFORExAFTER, BEFOREyAFTER and BEFOREzAFTER.
  std::vector<Vector3> vectors(const std::string& before, const std::string& after) const;
  std::vector<Time> stamps(const std::string& column) const;  ///< decimal seconds, exact

 private:
  std::size_t index_of(const std::string& column) const;

  std::string path_;
  std::vector<std::string> header_;
  std::vector<std::vector<std::string>> cells_;
  std::vector<int> lines_;  ///< line number of each row
};

}  // namespace lodestone
