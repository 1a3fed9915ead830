#include "tools/experiments/repeated_entries.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/experiments/yaml_parts.h"

namespace lodestone::reproduce {

namespace {

/// A name and the values that replace it.
struct Repetition {
  std::string name;
  std::vector<std::string> values;
};

/// {NAME: [values]}: one name, at least one value, all different.
Repetition read_repetition(const ConfigurationNode& node) {
  const std::vector<std::string> names = node.keys();
  if (names.size() != 1)
    node.fail(fmt::format("expected one name with a list of values, found {} names", names.size()));
  Repetition repetition{names.front(), texts(node, names.front())};
  if (repetition.values.empty()) node.at(names.front()).fail("expected at least one value");
  for (const ConfigurationNode& value : node.at(names.front()).elements()) {
    if (std::count(repetition.values.begin(), repetition.values.end(), value.as_string()) > 1)
      value.fail(fmt::format("'{}' appears twice", value.as_string()));
  }
  return repetition;
}

/// `text` with every {name} replaced by `value`. Other names in braces are errors.
std::string substituted(const ConfigurationNode& node, std::string text, const std::string& name,
                        const std::string& value) {
  for (std::size_t begin = text.find('{'); begin != std::string::npos; begin = text.find('{', begin)) {
    const std::size_t end = text.find('}', begin);
    const std::string found = text.substr(begin + 1, end == std::string::npos ? end : end - begin - 1);
    if (end == std::string::npos || found != name) {
      node.fail(
          fmt::format("expected {{{}}} of 'for_each', found {{{}{}", name, found, end == std::string::npos ? "" : "}"));
    }
    text.replace(begin, end - begin + 1, value);
    begin += value.size();
  }
  return text;
}

ConfigurationNode with_value(const ConfigurationNode& node, const std::string& name, const std::string& value) {
  return node.with_texts(
      [&](const ConfigurationNode& where, const std::string& text) { return substituted(where, text, name, value); });
}

/// Whether the entry applies for this value.
bool applies(const ConfigurationNode& entry, const Repetition& repetition, const std::string& value) {
  const ConfigurationNode* when = entry.find("when");
  if (when == nullptr) return true;
  when->refuse_keys_other_than({repetition.name});
  const Repetition some = read_repetition(*when);
  for (const ConfigurationNode& one : when->at(repetition.name).elements())
    require_known(one, one.as_string(), repetition.values, "value of 'for_each'");
  return std::find(some.values.begin(), some.values.end(), value) != some.values.end();
}

}  // namespace

std::vector<ConfigurationNode> repeated_entries(const ConfigurationNode& list) {
  std::vector<ConfigurationNode> result;
  for (const ConfigurationNode& element : list.elements()) {
    const ConfigurationNode* each = element.find("for_each");
    if (each == nullptr) {
      result.push_back(element);
      continue;
    }
    element.refuse_keys_other_than({"for_each", "entries"});
    const Repetition repetition = read_repetition(*each);
    const std::vector<ConfigurationNode>& entries = element.at("entries").elements();
    if (entries.empty()) element.at("entries").fail("expected at least one entry");
    for (const std::string& value : repetition.values) {
      for (const ConfigurationNode& entry : entries) {
        if (applies(entry, repetition, value))
          result.push_back(with_value(entry.without("when"), repetition.name, value));
      }
    }
  }
  return result;
}

std::vector<std::pair<std::string, ConfigurationNode>> repeated_groups(const ConfigurationNode& groups) {
  std::vector<std::pair<std::string, ConfigurationNode>> result;
  for (const std::string& name : groups.keys()) {
    const ConfigurationNode& group = groups.at(name);
    const ConfigurationNode* each = group.find("for_each");
    if (each == nullptr) {
      result.emplace_back(name, group);
      continue;
    }
    const Repetition repetition = read_repetition(*each);
    for (const std::string& value : repetition.values) {
      result.emplace_back(substituted(group, name, repetition.name, value),
                          with_value(group.without("for_each"), repetition.name, value));
    }
  }
  return result;
}

}  // namespace lodestone::reproduce
