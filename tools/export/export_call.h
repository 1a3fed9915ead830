#pragma once

#include <string>
#include <vector>

namespace lodestone {

/// The options of `lodestone export`.
struct ExportCall {
  std::string run;
  std::string to;
  std::vector<std::string> estimators;  ///< empty: all of the run
  std::string log;                      ///< empty: no scans
  std::string platform;                 ///< empty: that of the run
  std::string out;                      ///< empty: a name in the run's folder
  bool force = false;                   ///< replace a file that `out` names
};

/// Writes the export and reports it on the terminal. Throws InputError.
void execute(const ExportCall& call);

}  // namespace lodestone
