#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/time.h"

namespace lodestone {

/// A CSV file of a run folder: a header row, then rows of as many values. Lines that begin with '#' are comments.
class CsvTable {
 public:
  /// Reads the file. Throws InputError, naming file and line, where it is missing or a row has another length.
  explicit CsvTable(const std::filesystem::path& path);

  std::size_t rows() const { return cells_.size(); }
  bool has(const std::string& column) const;
  const std::vector<std::string>& columns() const { return header_; }

  /// A column by name. Throw InputError, naming file and line, where it is missing or a value does not parse.
  std::vector<double> numbers(const std::string& column) const;
  std::vector<std::string> texts(const std::string& column) const;
  std::vector<Time> stamps(const std::string& column) const;  ///< decimal seconds, exact

 private:
  std::size_t index_of(const std::string& column) const;

  std::string path_;
  std::vector<std::string> header_;
  std::vector<std::vector<std::string>> cells_;
  std::vector<int> lines_;  ///< of each row in the file
};

}  // namespace lodestone
