#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/plotting/plan_raster.h"
#include "tools/plotting/run_folder.h"

/// Figures on the floor plan: small multiples with colour bars, in a common scale if they show one site.
namespace lodestone::figures {

struct DifferencePanel {
  std::string title;
  PlanRaster difference_ut;    ///< |ΔB|
  std::vector<Vector3> track;  ///< drawn on top; may be empty
};

/// Differences of magnetic maps from a reference: one panel per map, with a common colour scale, each with its largest
/// value.
void draw_map_differences(const std::filesystem::path& path, const std::vector<DifferencePanel>& panels);

struct ResidualPanel {
  std::string title;  ///< e.g. the method
  ResidualTrack track;
};

/// |measured − map| along trajectories, one panel per trajectory, on |ΔB| of two maps as background. Each quantity has
/// one colour bar.
void draw_residuals_over_difference(const std::filesystem::path& path, const PlanRaster& difference_ut,
                                    const std::vector<ResidualPanel>& panels);

struct WorldTrack {
  std::string name;
  std::vector<Vector3> position;
};

struct WorldPanel {
  std::string title;
  PlanRaster strength_ut;          ///< |B|
  std::vector<WorldTrack> tracks;  ///< one per sequence
};

/// Every world's drives on its magnetic map: one panel per world, each with its own scale and colours.
void draw_worlds(const std::filesystem::path& path, const std::vector<WorldPanel>& panels);

}  // namespace lodestone::figures
