#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/plotting/plan_raster.h"
#include "tools/plotting/run_folder.h"

/// Figures on the floor plan: small multiples to one scale of metres where they share a site, with colour bars.
namespace lodestone::figures {

struct DifferencePanel {
  std::string title;
  PlanRaster difference_ut;    ///< |ΔB|
  std::vector<Vector3> track;  ///< drawn over it; may be empty
};

/// Differences of magnetic maps from a reference: a panel a map, all in one scale of colours, each with its largest
/// value.
void draw_map_differences(const std::filesystem::path& path, const std::vector<DifferencePanel>& panels);

struct ResidualPanel {
  std::string title;  ///< e.g. the method
  ResidualTrack track;
};

/// |measured − map| along trajectories, a panel a trajectory one above the other, over |ΔB| of two maps as background.
/// Both have their own scale of colours, each one bar.
void draw_residuals_over_difference(const std::filesystem::path& path, const PlanRaster& difference_ut,
                                    const std::vector<ResidualPanel>& panels);

struct WorldTrack {
  std::string name;
  std::vector<Vector3> position;
};

struct WorldPanel {
  std::string title;
  PlanRaster strength_ut;          ///< |B|
  std::vector<WorldTrack> tracks;  ///< one a sequence
};

/// Every world's drives over its magnetic map: a panel a world, each with its own scale of metres and of colours.
void draw_worlds(const std::filesystem::path& path, const std::vector<WorldPanel>& panels);

}  // namespace lodestone::figures
