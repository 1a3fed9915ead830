#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <vector>

#include "core/error.h"
#include "frontends/configuration/configuration_node.h"
#include "frontends/configuration/text_file.h"

namespace lodestone {

/// Converts yaml-cpp's tree to ConfigurationNode, which keeps file and line through merging.
class YamlReader {
 public:
  explicit YamlReader(std::string file) : file_(std::move(file)) {}

  ConfigurationNode read(const YAML::Node& yaml, const std::string& key_path) const {
    ConfigurationNode node;
    node.file_ = file_;
    node.line_ = yaml.Mark().is_null() ? 0 : yaml.Mark().line + 1;
    node.key_path_ = key_path;
    if (yaml.IsScalar()) {
      node.kind_ = ConfigurationNode::Kind::scalar;
      node.scalar_ = yaml.Scalar();
    } else if (yaml.IsSequence()) {
      node.kind_ = ConfigurationNode::Kind::sequence;
      for (const YAML::Node& element : yaml) {
        const std::string index = "[" + std::to_string(node.elements_.size()) + "]";
        node.elements_.push_back(read(element, key_path + index));
      }
    } else if (yaml.IsMap()) {
      node.kind_ = ConfigurationNode::Kind::map;
      for (const auto& entry : yaml) read_entry(entry.first, entry.second, node);
    }
    return node;
  }

  /// Nested maps along `keys`, with `value` at the end.
  static ConfigurationNode nest(const std::vector<std::string>& keys, ConfigurationNode value) {
    for (auto key = keys.rbegin(); key != keys.rend(); ++key) {
      ConfigurationNode outer;
      outer.kind_ = ConfigurationNode::Kind::map;
      outer.file_ = value.file_;
      outer.keys_ = {*key};
      outer.elements_ = {std::move(value)};
      value = std::move(outer);
    }
    return value;
  }

 private:
  void read_entry(const YAML::Node& key, const YAML::Node& value, ConfigurationNode& map) const {
    if (!key.IsScalar()) map.fail("a key must be a plain word");
    const std::string& name = key.Scalar();
    const std::string path = map.key_path_.empty() ? name : map.key_path_ + "." + name;
    ConfigurationNode node = read(value, path);
    // The value of a map starts on the next line; errors of the key refer to the key's line.
    if (!key.Mark().is_null()) node.line_ = key.Mark().line + 1;
    if (map.has(name)) node.fail("the key is given twice");
    map.keys_.push_back(name);
    map.elements_.push_back(std::move(node));
  }

  std::string file_;
};

ConfigurationNode ConfigurationNode::load(const std::string& path) {
  const std::string text = read_text_file(path);
  // For binary files, YAML's message would quote unreadable bytes.
  if (text.find('\0') != std::string::npos) throw InputError(path + ": expected YAML, found a binary file");
  return parse(text, path);
}

ConfigurationNode ConfigurationNode::parse(const std::string& text, const std::string& name) {
  try {
    const std::vector<YAML::Node> documents = YAML::LoadAll(text);
    if (documents.size() > 1) {
      throw InputError(fmt::format("{}:{}: a second YAML document begins; join it with the first", name,
                                   documents[1].Mark().line + 1));
    }
    return YamlReader(name).read(documents.empty() ? YAML::Node() : documents.front(), "");
  } catch (const YAML::Exception& error) {
    const std::string line = error.mark.is_null() ? "" : ":" + std::to_string(error.mark.line + 1);
    std::string what = error.msg;  // may contain a line end
    std::replace_if(
        what.begin(), what.end(), [](unsigned char letter) { return letter < ' '; }, ' ');
    const bool tab = text.find("\n\t") != std::string::npos || text.find(" \t") != std::string::npos;
    throw InputError(name + line + ": is no valid YAML (" + what + ")" +
                     (tab ? "; YAML allows no tabs as indentation: use spaces" : ""));
  }
}

void ConfigurationNode::set(const std::string& assignment) {
  const std::string origin = "--set " + assignment;
  const std::size_t equals = assignment.find('=');
  std::vector<std::string> keys;
  std::string rest = assignment.substr(0, equals);
  for (std::size_t dot = 0; dot != std::string::npos;) {
    dot = rest.find('.');
    keys.push_back(rest.substr(0, dot));
    if (dot != std::string::npos) rest = rest.substr(dot + 1);
  }
  if (equals == std::string::npos || std::find(keys.begin(), keys.end(), "") != keys.end()) {
    throw InputError(origin + ": expected key.path=value");
  }
  ConfigurationNode value = parse(assignment.substr(equals + 1), origin);
  value.line_ = 0;
  value.key_path_ = assignment.substr(0, equals);
  merge(YamlReader::nest(keys, std::move(value)));
}

}  // namespace lodestone
