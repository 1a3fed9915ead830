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
        fmt::format("{}: expected JSON, found an error at byte {}; create the file again", path.string(), error.byte));
  } catch (const nlohmann::json::exception& error) {  // a number out of range
    throw InputError(fmt::format("{}: expected JSON, found an unreadable value ({}); create the file again",
                                 path.string(), error.what()));
  }
}

nlohmann::ordered_json values_of(const std::filesystem::path& path,
                                 const std::function<nlohmann::ordered_json()>& use) {
  try {
    return use();
  } catch (const nlohmann::json::exception& error) {
    throw InputError(fmt::format("{}: the values differ from those that Lodestone writes ({}); create the file again",
                                 path.string(), error.what()));
  }
}

}  // namespace lodestone
