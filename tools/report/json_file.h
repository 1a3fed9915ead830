#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>

namespace lodestone {

/// The file's JSON with its order of keys. Throws InputError with the file's name if it is missing or not JSON.
nlohmann::ordered_json read_json(const std::filesystem::path& path);

/// Calls `use`, which extracts values from the JSON of `path`. Throws InputError with the file's name if a value has
/// another type than `use` requires.
nlohmann::ordered_json values_of(const std::filesystem::path& path, const std::function<nlohmann::ordered_json()>& use);

}  // namespace lodestone
