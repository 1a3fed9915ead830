#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace lodestone {

/// Whether `folder` is what `lodestone reproduce` leaves: it has reproduce.json.
bool is_reproduce_folder(const std::filesystem::path& folder);

/// Everything that the page shows of an experiment: its tables as they stand, its figures embedded, and of each
/// sequence the run of one seed, with as many points as keep the page below about 15 MB. What is named but missing on
/// disk is listed under `missing`. Throws InputError, naming the file and key, where reproduce.json is malformed.
nlohmann::ordered_json read_reproduce(const std::filesystem::path& folder);

}  // namespace lodestone
