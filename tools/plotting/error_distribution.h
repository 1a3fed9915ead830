#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace lodestone::figures {

/// The errors of one method over one or several logs.
struct MethodErrors {
  std::string method;
  std::vector<double> error_m;
  std::size_t expected = 0;  ///< expected number of scans; missing scans of a lost run count as larger than every
                             ///< error; 0: none is missing
};

struct DistributionPanel {
  std::string title;  ///< e.g. the world
  std::vector<MethodErrors> methods;
};

/// Cumulative distribution of the error (logarithmic axis), one panel per case, with a common legend.
void draw_error_distributions(const std::filesystem::path& path, const std::vector<DistributionPanel>& panels);

}  // namespace lodestone::figures
