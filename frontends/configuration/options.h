#pragma once

#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/error.h"
#include "core/nearest_name.h"
#include "core/options.h"
#include "frontends/configuration/configuration_node.h"

/// Readers and writers of option structs (core/options.h), independent of the structs.
namespace lodestone {

template <class Options>
void load_options(const ConfigurationNode& node, Options& options);

namespace options_detail {

template <class Enum>
std::vector<std::string> names_of(Enum value) {
  std::vector<std::string> names;
  for (const auto& entry : enum_names(value)) names.emplace_back(entry.second);
  return names;
}

/// Sets `value` to the enumerator called `text`. Returns false and keeps `value` if there is none.
template <class Enum>
bool parse_name(std::string_view text, Enum& value) {
  for (const auto& [enumerator, name] : enum_names(value)) {
    if (name != text) continue;
    value = enumerator;
    return true;
  }
  return false;
}

inline std::string unknown_name(const std::string& text, const std::vector<std::string>& names) {
  return "expected one of " + join_names(names) + ", found '" + text + "'" + suggestion(text, names);
}

inline void read_value(const ConfigurationNode& node, bool& value) {
  value = node.as_bool();
}
inline void read_value(const ConfigurationNode& node, int& value) {
  value = node.as_int();
}
inline void read_value(const ConfigurationNode& node, double& value) {
  value = node.as_double();
}
inline void read_value(const ConfigurationNode& node, std::string& value) {
  value = node.as_string();
}
inline void read_value(const ConfigurationNode& node, std::vector<double>& value) {
  value = node.as_doubles();
}

template <class Enum, std::enable_if_t<std::is_enum_v<Enum>, int> = 0>
void read_value(const ConfigurationNode& node, Enum& value) {
  const std::string text = node.as_string();
  if (!parse_name(text, value)) node.fail(unknown_name(text, names_of(value)));
}

/// Values as YAML that is parsed to the same bits.
std::string write_value(bool value);
std::string write_value(int value);
std::string write_value(double value);
std::string write_value(const std::string& value);
std::string write_value(const std::vector<double>& value);

template <class Enum, std::enable_if_t<std::is_enum_v<Enum>, int> = 0>
std::string write_value(Enum value) {
  for (const auto& [enumerator, name] : enum_names(value)) {
    if (enumerator == value) return std::string(name);
  }
  return "?";
}

template <class Value>
std::string type_name(const Value& value) {
  if constexpr (std::is_enum_v<Value>) {
    std::string text;
    for (const std::string& name : names_of(value)) text += (text.empty() ? "" : "|") + name;
    return text;
  }
  if constexpr (std::is_same_v<Value, bool>) return "true|false";
  if constexpr (std::is_same_v<Value, int>) return "whole number";
  if constexpr (std::is_same_v<Value, double>) return "number";
  return std::is_same_v<Value, std::string> ? "text" : "list of numbers";
}

class Loader {
 public:
  explicit Loader(const ConfigurationNode& node) : node_(node) {}

  template <class Value>
  void field(std::string_view name, Value& value, std::string_view) {
    known_.emplace_back(name);
    if (const ConfigurationNode* child = node_.find(known_.back())) read_value(*child, value);
  }

  template <class Options>
  void section(std::string_view name, Options& options) {
    known_.emplace_back(name);
    static const ConfigurationNode absent;
    const ConfigurationNode* child = node_.find(known_.back());
    load_options(child != nullptr ? *child : absent, options);
  }

  void finish() const { node_.refuse_keys_other_than(known_); }

 private:
  const ConfigurationNode& node_;
  std::vector<std::string> known_;
};

class Writer {
 public:
  explicit Writer(int depth) : indent_(static_cast<std::size_t>(2 * depth), ' '), depth_(depth) {}

  template <class Value>
  void field(std::string_view name, const Value& value, std::string_view) {
    text += indent_ + std::string(name) + ": " + write_value(value) + "\n";
  }

  template <class Options>
  void section(std::string_view name, Options& options) {
    Writer inner(depth_ + 1);
    options.visit(inner);
    text += indent_ + std::string(name) + (inner.text.empty() ? ": {}\n" : ":\n" + inner.text);
  }

  std::string text;

 private:
  std::string indent_;
  int depth_;
};

template <class Call>
class Walker {
 public:
  Walker(std::string prefix, const Call& call) : prefix_(std::move(prefix)), call_(call) {}

  template <class Value>
  void field(std::string_view name, const Value& value, std::string_view help) {
    call_(prefix_ + std::string(name), value, help);
  }

  template <class Options>
  void section(std::string_view name, Options& options) {
    Walker inner(prefix_ + std::string(name) + ".", call_);
    options.visit(inner);
  }

 private:
  std::string prefix_;
  const Call& call_;
};

}  // namespace options_detail

/// The enumerator called `text`, the value of the option `what`. Throws InputError if there is none.
template <class Enum>
Enum enumerator_of(const std::string& what, const std::string& text) {
  Enum value{};
  if (options_detail::parse_name(text, value)) return value;
  throw InputError(what + ": " + options_detail::unknown_name(text, options_detail::names_of(value)));
}

/// Sets the fields that `node` contains and keeps the others; then calls the structs' checks. Throws InputError, with
/// file and line, for an unknown key (with the closest known one), a value of the wrong type, or a value that a check
/// rejects.
template <class Options>
void load_options(const ConfigurationNode& node, Options& options) {
  options_detail::Loader loader(node);
  options.visit(loader);
  loader.finish();
  if constexpr (requires { options.check(); }) {
    try {
      options.check();
    } catch (const InputError& error) {
      node.fail(error.what());
    }
  }
}

/// All fields and their values as YAML text, which load_options parses to the same bits.
template <class Options>
std::string save_options(Options options) {
  options_detail::Writer writer(0);
  options.visit(writer);
  return writer.text;
}

/// Calls `call(path for --set, value, help text)` for each field.
template <class Options, class Call>
void for_each_option(Options options, const Call& call) {
  options_detail::Walker walker("", call);
  options.visit(walker);
}

/// One line per field: its path for --set, its value, its type and its help text.
template <class Options>
std::string list_options(const Options& options) {
  std::string text;
  for_each_option(options, [&text](const std::string& path, const auto& value, std::string_view help) {
    text += path + " = " + options_detail::write_value(value) + "  (" + options_detail::type_name(value) + ")  " +
            std::string(help) + "\n";
  });
  return text;
}

/// Merges the configuration files in order, then the assignments of --set. Throws InputError.
ConfigurationNode load_configuration(const std::vector<std::string>& files,
                                     const std::vector<std::string>& assignments);

}  // namespace lodestone
