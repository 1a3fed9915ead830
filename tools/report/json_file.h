#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>

namespace lodestone {

/// The file's JSON, keys in its order. Throws InputError, naming the file, where it is missing or no JSON.
nlohmann::ordered_json read_json(const std::filesystem::path& path);

/// Calls `use`, which takes values out of the JSON of `path`. Throws InputError, naming the file, where one is of
/// another kind than `use` asks for.
nlohmann::ordered_json values_of(const std::filesystem::path& path, const std::function<nlohmann::ordered_json()>& use);

}  // namespace lodestone
