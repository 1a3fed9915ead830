#include "frontends/messages/message_definition.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "frontends/configuration/number_text.h"
#include "frontends/messages/topic_list.h"

namespace lodestone {
namespace {

using Field = MessagePaths::Field;

constexpr int longest_fixed_list = 1 << 20;

bool is_basic(const std::string& type) {
  return size_of_number(type) > 0 || type == "string" || type == "time" || type == "duration";
}

/// Converts "Header", "Vector3" (within geometry_msgs), "geometry_msgs/msg/Vector3" to pkg/Type.
std::string full_name(const std::string& type, const std::string& package) {
  if (is_basic(type) || type == "wstring") return type;
  if (type == "Header") return "std_msgs/Header";
  return type.find('/') == std::string::npos ? package + "/" + type : ros1_type_name(type);
}

/// Parses one line of a definition; false if it declares no field.
bool parse_line(std::string line, const std::string& package, Field& field) {
  line = line.substr(0, line.find('#'));
  std::istringstream words(line);
  std::string type, rest;
  if (!(words >> type) || !std::getline(words, rest)) return false;
  if (rest.find('=') != std::string::npos) return false;  // a constant
  std::istringstream(rest) >> field.name;
  if (field.name.empty()) return false;
  field.count = Field::single;
  if (const std::size_t open = type.find('['); open != std::string::npos) {
    const std::size_t close = std::min(type.find(']', open), type.size());
    int count = 0;
    const bool fixed = parse_number(std::string_view(type).substr(open + 1, close - open - 1), count);
    if (fixed && (count < 0 || count > longest_fixed_list)) {
      throw std::invalid_argument(fmt::format("an invalid list of {} elements, '{}'", count, field.name));
    }
    field.count = fixed ? count : Field::counted;
    type.erase(open);
  }
  type = type.substr(0, type.find('<'));  // string<=10
  field.type = full_name(type, package);
  return true;
}

}  // namespace

int size_of_number(const std::string& type) {
  if (type == "bool" || type == "byte" || type == "char" || type == "int8" || type == "uint8") return 1;
  if (type == "int16" || type == "uint16") return 2;
  if (type == "int32" || type == "uint32" || type == "float32") return 4;
  if (type == "int64" || type == "uint64" || type == "float64") return 8;
  return 0;
}

std::map<std::string, std::vector<Field>> parse_definition(const std::string& type, const std::string& text) {
  std::map<std::string, std::vector<Field>> types;
  std::string current = type;
  types[current];
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("==========")) continue;
    if (line.starts_with("IDL:") || line.starts_with("module "))
      throw std::invalid_argument("it is in IDL, which is not supported");
    if (line.starts_with("MSG: ")) {
      std::istringstream(line.substr(5)) >> current;
      current = ros1_type_name(current);
      types[current].clear();
      continue;
    }
    Field field;
    if (parse_line(line, current.substr(0, current.find('/')), field)) types[current].push_back(field);
  }
  // ROS 2 recorders may omit common types.
  types.try_emplace("builtin_interfaces/Time", std::vector<Field>{{"int32", "sec"}, {"uint32", "nanosec"}});
  for (const auto& [name, fields] : types) {
    for (const Field& field : fields) {
      if (is_basic(field.type) || field.type == "std_msgs/Header" || types.count(field.type) > 0) continue;
      throw std::invalid_argument(fmt::format("it does not define '{}', the type of '{}'", field.type, field.name));
    }
  }
  return types;
}

}  // namespace lodestone
