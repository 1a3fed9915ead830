#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace lodestone {

/// Limits of a run's data in a page. A page of many runs has less for each.
struct DetailLimits {
  std::size_t points_per_series = 2000;
  std::size_t field_values = 1'000'000;
  std::size_t cloud_points = 150'000;
};

/// True if `folder` has summary.json of `lodestone run`.
bool is_run_folder(const std::filesystem::path& folder);

/// The page's data of a run: inputs, figures, series on one time axis, distributions, overview of the maps, stale
/// places, configuration. Throws InputError with the file's name if the folder is not of a run or a file in it is
/// unusable.
nlohmann::ordered_json read_run(const std::filesystem::path& folder, const DetailLimits& limits);

}  // namespace lodestone
