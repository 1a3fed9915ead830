#include "tools/report/json_file.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/error.h"
#include "frontends/configuration/text_file.h"

namespace lodestone {

nlohmann::ordered_json read_json(const std::filesystem::path& path) {
  const std::string text = read_text_file(path.string());
  try {
    return nlohmann::ordered_json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    throw InputError(
        fmt::format("{}: expected JSON, found a mistake at byte {}; write the file again", path.string(), error.byte));
  } catch (const nlohmann::json::exception& error) {  // a number beyond all numbers
    throw InputError(fmt::format("{}: expected JSON, found what cannot be read ({}); write the file again",
                                 path.string(), error.what()));
  }
}

nlohmann::ordered_json values_of(const std::filesystem::path& path,
                                 const std::function<nlohmann::ordered_json()>& use) {
  try {
    return use();
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("{}: it has other values than Lodestone writes ({}); write the file again",
                                 path.string(), error.what()));
  }
}

}  // namespace lodestone
