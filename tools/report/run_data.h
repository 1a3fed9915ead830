#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace lodestone {

/// How much of a run goes into a page; a page of many runs can spend less on each.
struct DetailLimits {
  std::size_t points_a_series = 2000;
  std::size_t field_values = 1'000'000;
  std::size_t cloud_points = 150'000;
};

/// Whether `folder` is what `lodestone run` leaves: it has summary.json with estimators.
bool is_run_folder(const std::filesystem::path& folder);

/// Everything that the page shows of a run, for tools/report/page/source/run.js: inputs, figures, series on one time
/// axis, distributions, overview of the maps, stale places, configuration. Throws InputError, naming the file, where
/// the folder is none of a run or a file in it is unusable.
nlohmann::ordered_json read_run(const std::filesystem::path& folder, const DetailLimits& limits);

}  // namespace lodestone
