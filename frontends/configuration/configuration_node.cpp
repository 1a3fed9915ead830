#include "frontends/configuration/configuration_node.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/number_text.h"

namespace lodestone {

const ConfigurationNode* ConfigurationNode::find(const std::string& key) const {
  const auto found = std::find(keys_.begin(), keys_.end(), key);
  return found == keys_.end() ? nullptr : &elements_[static_cast<std::size_t>(found - keys_.begin())];
}

const ConfigurationNode& ConfigurationNode::at(const std::string& key) const {
  if (const ConfigurationNode* value = find(key)) return *value;
  if (kind_ != Kind::map && kind_ != Kind::empty) fail_expected("a map with the key '" + key + "'");
  fail("the key '" + key + "' is missing");
}

std::vector<std::string> ConfigurationNode::keys() const {
  if (kind_ != Kind::map && kind_ != Kind::empty) fail_expected("a map");
  return keys_;
}

const std::vector<ConfigurationNode>& ConfigurationNode::elements() const {
  if (kind_ != Kind::sequence && kind_ != Kind::empty) fail_expected("a list");
  return elements_;
}

bool ConfigurationNode::as_bool() const {
  if (kind_ == Kind::scalar && (scalar_ == "true" || scalar_ == "false")) return scalar_ == "true";
  fail_expected("true or false");
}

int ConfigurationNode::as_int() const {
  int value = 0;
  if (kind_ == Kind::scalar && parse_number(scalar_, value)) return value;
  fail_expected("a whole number");
}

double ConfigurationNode::as_double() const {
  double value = 0.0;
  if (kind_ == Kind::scalar) {
    if (scalar_ == ".inf" || scalar_ == "+.inf") return std::numeric_limits<double>::infinity();
    if (scalar_ == "-.inf") return -std::numeric_limits<double>::infinity();
    if (parse_number(scalar_, value) && !std::isnan(value)) return value;
  }
  fail_expected("a number");
}

std::string ConfigurationNode::as_string() const {
  if (kind_ == Kind::scalar) return scalar_;
  fail_expected("a text");
}

std::vector<double> ConfigurationNode::as_doubles(std::size_t count) const {
  const std::string expected = count > 0 ? "a list of " + std::to_string(count) + " numbers" : "a list of numbers";
  if (kind_ != Kind::sequence) fail_expected(expected);
  if (count > 0 && elements_.size() != count) {
    fail("expected " + expected + ", found " + std::to_string(elements_.size()));
  }
  std::vector<double> values;
  for (const ConfigurationNode& element : elements_) values.push_back(element.as_double());
  return values;
}

void ConfigurationNode::refuse_keys_other_than(const std::vector<std::string>& known) const {
  if (kind_ != Kind::map && kind_ != Kind::empty) fail_expected("a map with the keys " + join_names(known));
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (std::find(known.begin(), known.end(), keys_[i]) != known.end()) continue;
    const std::string near = suggestion(keys_[i], known);
    elements_[i].fail("unknown key '" + keys_[i] + "'" +
                      (known.empty()  ? "; expected no key here"
                       : near.empty() ? "; known: " + join_names(known)
                                      : near));
  }
}

void ConfigurationNode::merge(const ConfigurationNode& other) {
  if (other.kind_ == Kind::empty) return;
  if (kind_ != Kind::map || other.kind_ != Kind::map) {
    *this = other;
    return;
  }
  for (std::size_t i = 0; i < other.keys_.size(); ++i) {
    const auto found = std::find(keys_.begin(), keys_.end(), other.keys_[i]);
    if (found == keys_.end()) {
      keys_.push_back(other.keys_[i]);
      elements_.push_back(other.elements_[i]);
    } else {
      elements_[static_cast<std::size_t>(found - keys_.begin())].merge(other.elements_[i]);
    }
  }
}

ConfigurationNode ConfigurationNode::with_texts(const TextReplacement& replace) const {
  ConfigurationNode copy = *this;
  if (kind_ == Kind::scalar) copy.scalar_ = replace(*this, scalar_);
  for (std::size_t i = 0; i < elements_.size(); ++i) copy.elements_[i] = elements_[i].with_texts(replace);
  for (std::size_t i = 0; i < keys_.size(); ++i) copy.keys_[i] = replace(elements_[i], keys_[i]);
  return copy;
}

ConfigurationNode ConfigurationNode::without(const std::string& key) const {
  ConfigurationNode copy = *this;
  const auto found = std::find(copy.keys_.begin(), copy.keys_.end(), key);
  if (found == copy.keys_.end()) return copy;
  copy.elements_.erase(copy.elements_.begin() + (found - copy.keys_.begin()));
  copy.keys_.erase(found);
  return copy;
}

std::string ConfigurationNode::describe() const {
  // The text of a whole table, where another file was expected.
  constexpr std::size_t most = 80;
  switch (kind_) {
    case Kind::empty:
      return "nothing";
    case Kind::scalar: {
      if (scalar_.size() <= most) return "'" + scalar_ + "'";
      std::size_t size = most;
      while (size > 0 && (static_cast<unsigned char>(scalar_[size]) & 0xC0U) == 0x80U) --size;  // within a UTF-8 letter
      return "'" + scalar_.substr(0, size) + "...'";
    }
    case Kind::sequence:
      return "a list of " + std::to_string(elements_.size());
    case Kind::map:
      break;
  }
  return "a map with the keys " + join_names(keys_);
}

void ConfigurationNode::fail_expected(const std::string& expected) const {
  fail("expected " + expected + ", found " + describe());
}

std::string ConfigurationNode::where() const {
  std::string place = file_;
  if (line_ > 0) place += ":" + std::to_string(line_);
  if (!key_path_.empty()) place += (place.empty() ? "" : ": ") + key_path_;
  return place;
}

void ConfigurationNode::fail(const std::string& message) const {
  const std::string place = where();
  throw InputError(place.empty() ? message : place + ": " + message);
}

}  // namespace lodestone
