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

std::string type_name(bool);
std::string type_name(int);
std::string type_name(double);
std::string type_name(const std::string&);
std::string type_name(const std::vector<double>&);

template <class Enum, std::enable_if_t<std::is_enum_v<Enum>, int> = 0>
std::string type_name(Enum value) {
  std::string text;
  for (const std::string& name : names_of(value)) text += (text.empty() ? "" : "|") + name;
  return text;
}

template <class Options>
void load(const ConfigurationNode& node, Options& options);

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
    load(child != nullptr ? *child : absent, options);
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

class Lister {
 public:
  explicit Lister(std::string prefix) : prefix_(std::move(prefix)) {}

  template <class Value>
  void field(std::string_view name, const Value& value, std::string_view help) {
    text += prefix_ + std::string(name) + " = " + write_value(value) + "  (" + type_name(value) + ")  " +
            std::string(help) + "\n";
  }

  template <class Options>
  void section(std::string_view name, Options& options) {
    Lister inner(prefix_ + std::string(name) + ".");
    options.visit(inner);
    text += inner.text;
  }

  std::string text;

 private:
  std::string prefix_;
};

template <class Options>
void load(const ConfigurationNode& node, Options& options) {
  Loader loader(node);
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
  options_detail::load(node, options);
}

/// All fields and their values as YAML text, which load_options parses to the same bits.
template <class Options>
std::string save_options(Options options) {
  options_detail::Writer writer(0);
  options.visit(writer);
  return writer.text;
}

/// One line per field: its path for --set, its value, its type and its help text.
template <class Options>
std::string list_options(Options options) {
  options_detail::Lister lister("");
  options.visit(lister);
  return lister.text;
}

/// Merges the configuration files in order, then the assignments of --set. Throws InputError.
ConfigurationNode load_configuration(const std::vector<std::string>& files,
                                     const std::vector<std::string>& assignments);

}  // namespace lodestone
