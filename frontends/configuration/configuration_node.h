#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace lodestone {

/// A configuration as written: a tree of maps, sequences and scalars with the file and line of each. Every error is an
/// InputError "file:line: key.path: what is wrong; what to change".
class ConfigurationNode {
 public:
  enum class Kind { empty, scalar, sequence, map };

  /// An empty node without origin.
  ConfigurationNode() = default;

  /// Reads a YAML file. Throws InputError if it is missing, malformed, or has a duplicate key.
  static ConfigurationNode load(const std::string& path);

  /// Parses YAML text; `name` replaces the file name in messages.
  static ConfigurationNode parse(const std::string& text, const std::string& name);

  Kind kind() const { return kind_; }
  bool has(const std::string& key) const { return find(key) != nullptr; }

  /// The value of `key`; null if absent, or if this is not a map.
  const ConfigurationNode* find(const std::string& key) const;

  /// The value of `key`. Throws InputError if absent.
  const ConfigurationNode& at(const std::string& key) const;

  /// Keys of a map in the order of the file (none for an empty node). Throws InputError for other kinds.
  std::vector<std::string> keys() const;

  /// Elements of a sequence (none for an empty node). Throws InputError for other kinds.
  const std::vector<ConfigurationNode>& elements() const;

  /// Scalars. Each throws InputError, with the expected and the found kind, if the node is something else.
  bool as_bool() const;
  int as_int() const;
  double as_double() const;
  std::string as_string() const;

  /// A sequence of numbers; with `count` > 0, of exactly this length. Throws InputError.
  std::vector<double> as_doubles(std::size_t count = 0) const;

  /// Throws InputError, with the closest known key, if this map has a key that is not in `known`.
  void refuse_keys_other_than(const std::vector<std::string>& known) const;

  /// Merges `other` into this: maps are merged key by key, everything else is replaced.
  void merge(const ConfigurationNode& other);

  /// Merges `key.path=value` (the value in YAML) into this, as --set on the command line. Throws InputError if there is
  /// no '=' or no key.
  void set(const std::string& assignment);

  /// A copy in which `replace` is applied to every key and scalar, with the text and its node as arguments.
  using TextReplacement = std::function<std::string(const ConfigurationNode& node, const std::string& text)>;
  ConfigurationNode with_texts(const TextReplacement& replace) const;

  /// A copy without a key of this map.
  ConfigurationNode without(const std::string& key) const;

  /// Throws InputError "file:line: key.path: message".
  [[noreturn]] void fail(const std::string& message) const;

  /// "file:line: key.path", without unknown parts.
  std::string where() const;

  /// The file that this node came from, for paths relative to it.
  const std::string& file() const { return file_; }

 private:
  friend class YamlReader;

  std::string describe() const;
  [[noreturn]] void fail_expected(const std::string& expected) const;

  Kind kind_ = Kind::empty;
  std::string file_;
  int line_ = 0;          ///< from 1; 0 if unknown
  std::string key_path_;  ///< from the root, for example lidar.fields[2]
  std::string scalar_;
  std::vector<ConfigurationNode> elements_;  ///< of a sequence, or values of a map
  std::vector<std::string> keys_;            ///< of a map, one per element
};

}  // namespace lodestone
