#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace lodestone {

/// True if `folder` has reproduce.json, the result of `lodestone reproduce`.
bool is_reproduce_folder(const std::filesystem::path& folder);

/// The page's data of an experiment: tables, embedded figures, and one seed of each sequence's runs. The number of
/// points keeps the page below about 15 MB. Missing files are listed under `missing`. Throws InputError with file and
/// key if reproduce.json is malformed.
nlohmann::ordered_json read_reproduce(const std::filesystem::path& folder);

}  // namespace lodestone
