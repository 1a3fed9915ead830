#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace lodestone {

/// The file's JSON, keys in its order. Throws InputError, naming the file, where it is missing or no JSON.
nlohmann::ordered_json read_json(const std::filesystem::path& path);

}  // namespace lodestone
