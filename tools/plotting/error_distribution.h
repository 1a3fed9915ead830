#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace lodestone::figures {

/// The errors of one method, over as many logs as the caller puts together.
struct MethodErrors {
  std::string method;
  std::vector<double> error_m;
  std::size_t expected = 0;  ///< scans that there should have been: what a lost run did not reach counts as beyond
                             ///< every error; 0 where none is missing
};

struct DistributionPanel {
  std::string title;  ///< e.g. the world
  std::vector<MethodErrors> methods;
};

/// The share of scans within an error, over that error (logarithmic), a panel a case, with one legend for all.
void draw_error_distributions(const std::filesystem::path& path, const std::vector<DistributionPanel>& panels);

}  // namespace lodestone::figures
