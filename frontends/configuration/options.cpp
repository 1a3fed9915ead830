#include "frontends/configuration/options.h"

#include <fmt/format.h>

#include <cmath>

#include "frontends/configuration/file_kind.h"

namespace lodestone {

namespace options_detail {

std::string write_value(bool value) {
  return value ? "true" : "false";
}

std::string write_value(int value) {
  return std::to_string(value);
}

std::string write_value(double value) {
  if (std::isinf(value)) return value > 0 ? ".inf" : "-.inf";
  const std::string text = fmt::format("{}", value);  // the shortest text that is parsed to the same bits
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

std::string write_value(const std::string& value) {
  std::string text = "\"";
  for (const char character : value) {
    if (character == '"' || character == '\\') text += '\\';
    if (character == '\n') {
      text += "\\n";
    } else {
      text += character;
    }
  }
  return text + "\"";
}

std::string write_value(const std::vector<double>& value) {
  std::string text = "[";
  for (const double element : value) text += (text.size() == 1 ? "" : ", ") + write_value(element);
  return text += "]";
}

}  // namespace options_detail

ConfigurationNode load_configuration(const std::vector<std::string>& files,
                                     const std::vector<std::string>& assignments) {
  ConfigurationNode configuration;
  for (const std::string& file : files) {
    require_kind(file, SeemingKind::unknown, "a file of options");
    const ConfigurationNode node = ConfigurationNode::load(file);
    if (node.kind() != ConfigurationNode::Kind::empty) node.keys();  // throws, with the file, if it is not a map
    configuration.merge(node);
  }
  for (const std::string& assignment : assignments) configuration.set(assignment);
  return configuration;
}

}  // namespace lodestone
