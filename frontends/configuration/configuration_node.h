#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace lodestone {

/// A configuration as it was written: a tree of maps, sequences and scalars, each of which knows the file and line that
/// it came from. Every mistake found in it is an InputError "file:line: key.path: what is wrong; what to change".
class ConfigurationNode {
 public:
  enum class Kind { empty, scalar, sequence, map };

  /// An empty node without origin.
  ConfigurationNode() = default;

  /// Reads a YAML file. Throws InputError where it is missing, malformed, or names a key twice.
  static ConfigurationNode load(const std::string& path);

  /// Parses YAML text; `name` stands for the file in messages.
  static ConfigurationNode parse(const std::string& text, const std::string& name);

  Kind kind() const { return kind_; }
  bool has(const std::string& key) const { return find(key) != nullptr; }

  /// The value of `key`; null where absent, or where this is no map.
  const ConfigurationNode* find(const std::string& key) const;

  /// The value of `key`. Throws InputError where absent.
  const ConfigurationNode& at(const std::string& key) const;

  /// Keys of a map in the order of the file (none for an empty node). Throws InputError for other kinds.
  std::vector<std::string> keys() const;

  /// Elements of a sequence (none for an empty node). Throws InputError for other kinds.
  const std::vector<ConfigurationNode>& elements() const;

  /// Scalars. Each throws InputError, with what was expected and what came, where the node is something else.
  bool as_bool() const;
  int as_int() const;
  double as_double() const;
  std::string as_string() const;

  /// A sequence of numbers. With `count` > 0, of exactly so many. Throws InputError.
  std::vector<double> as_doubles(std::size_t count = 0) const;

  /// Throws InputError, with the nearest right key, where this map has a key that is not among `known`.
  void refuse_keys_other_than(const std::vector<std::string>& known) const;

  /// Lays `other` over this: maps are merged key by key, everything else is replaced.
  void merge(const ConfigurationNode& other);

  /// Lays `key.path=value` (the value in YAML) over this, as the command line's --set does. Throws InputError where
  /// there is no '=' or no key.
  void set(const std::string& assignment);

  /// A copy in which `replace` was applied to every key and scalar; it gets the text and the node that it stands in.
  using TextReplacement = std::function<std::string(const ConfigurationNode& node, const std::string& text)>;
  ConfigurationNode with_texts(const TextReplacement& replace) const;

  /// A copy without a key of this map.
  ConfigurationNode without(const std::string& key) const;

  /// Throws InputError "file:line: key.path: message".
  [[noreturn]] void fail(const std::string& message) const;

  /// "file:line: key.path"; what is unknown is left out.
  std::string where() const;

  /// The file that this node came from, for paths relative to it.
  const std::string& file() const { return file_; }

 private:
  friend class YamlReader;

  std::string describe() const;
  [[noreturn]] void fail_expected(const std::string& expected) const;

  Kind kind_ = Kind::empty;
  std::string file_;
  int line_ = 0;          ///< from 1; 0 where unknown
  std::string key_path_;  ///< from the root, for example lidar.fields[2]
  std::string scalar_;
  std::vector<ConfigurationNode> elements_;  ///< of a sequence, or the values of a map
  std::vector<std::string> keys_;            ///< of a map, one an element
};

}  // namespace lodestone
