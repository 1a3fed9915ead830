#include "frontends/maps/ply_vertices.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/number_text.h"

namespace lodestone {
namespace {

constexpr std::size_t longest_header_line = 4096;
constexpr std::size_t most_properties = 1000;
constexpr std::size_t longest_number = 8;  // bytes

struct NumberName {
  const char* name;
  char type;
  int size;
};

constexpr std::array<NumberName, 16> number_names{{{"char", 'I', 1},
                                                   {"uchar", 'U', 1},
                                                   {"short", 'I', 2},
                                                   {"ushort", 'U', 2},
                                                   {"int", 'I', 4},
                                                   {"uint", 'U', 4},
                                                   {"float", 'F', 4},
                                                   {"double", 'F', 8},
                                                   {"int8", 'I', 1},
                                                   {"uint8", 'U', 1},
                                                   {"int16", 'I', 2},
                                                   {"uint16", 'U', 2},
                                                   {"int32", 'I', 4},
                                                   {"uint32", 'U', 4},
                                                   {"float32", 'F', 4},
                                                   {"float64", 'F', 8}}};

}  // namespace

PlyVertices::PlyVertices(const std::string& path) : path_(path), stream_(path, std::ios::binary) {
  std::error_code code;
  size_ = std::filesystem::file_size(path, code);
  if (!stream_ || code) fail("the file cannot be opened");
  read_header();
  find_coordinates();
  for (std::size_t i = 0; i < vertex_; ++i) skip(elements_[i]);
}

void PlyVertices::fail(const std::string& what) const {
  throw InputError(fmt::format(
      "{}: the point cloud cannot be read: it is malformed or truncated: {}; copy or write it again", path_, what));
}

bool PlyVertices::header_line(std::string& line) {
  line.clear();
  for (char one = 0; stream_.get(one) && one != '\n';) {
    if (line.size() == longest_header_line) fail("a line of the header does not end");
    line += one;
  }
  while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())) != 0) line.pop_back();
  return static_cast<bool>(stream_);
}

void PlyVertices::read_header() {
  header_line(line_);
  if (line_ != "ply") fail("the first line is not 'ply'");
  bool has_format = false;
  while (header_line(line_)) {
    std::istringstream words(line_);
    std::string key, name;
    words >> key;
    if (key == "end_header") {
      if (!has_format) fail("the header has no line format");
      return;
    }
    if (key.empty() || key == "comment" || key == "obj_info") continue;
    if (key == "format") {
      if (!(words >> name)) fail("the line format is empty");
      parse_format(name);
      has_format = true;
    } else if (key == "element") {
      std::string count;
      Element element;
      if (!(words >> element.name >> count) || !parse_number(count, element.count))
        fail("the header has an element without a count");
      if (elements_.size() == most_properties) fail("the header has too many elements");
      elements_.push_back(std::move(element));
    } else if (key == "property") {
      parse_property(words);
    } else {
      fail("the header has an unknown line");
    }
  }
  fail("the header has no end");
}

void PlyVertices::parse_format(const std::string& kind) {
  if (kind == "ascii") {
    encoding_ = Encoding::text;
  } else if (kind == "binary_little_endian") {
    encoding_ = Encoding::little_endian;
  } else if (kind == "binary_big_endian") {
    encoding_ = Encoding::big_endian;
  } else {
    fail("the format is neither ascii nor binary_little_endian nor binary_big_endian");
  }
}

PlyVertices::Property PlyVertices::number_type(const std::string& name) const {
  for (const NumberName& each : number_names) {
    if (name == each.name) return {"", each.type, each.size, 0};
  }
  fail("the header has a property of unknown type");
}

void PlyVertices::parse_property(std::istream& words) {
  if (elements_.empty()) fail("the header has a property before any element");
  std::string type, name;
  words >> type;
  int count_size = 0;
  if (type == "list") {
    words >> type;
    const Property count = number_type(type);
    if (count.type == 'F') fail("the header has a list whose count is not an integer");
    count_size = count.size;
    words >> type;
  }
  Property property = number_type(type);
  property.count_size = count_size;
  if (!(words >> property.name)) fail("the header has a property without a name");
  if (elements_.back().properties.size() == most_properties) fail("the header has too many properties");
  elements_.back().properties.push_back(std::move(property));
}

void PlyVertices::find_coordinates() {
  const auto found =
      std::find_if(elements_.begin(), elements_.end(), [](const Element& each) { return each.name == "vertex"; });
  if (found == elements_.end()) fail("the header has no element vertex");
  vertex_ = static_cast<std::size_t>(found - elements_.begin());
  for (std::size_t row = 0; row < 3; ++row) {
    const std::string name(1, "xyz"[row]);
    const auto property = std::find_if(found->properties.begin(), found->properties.end(),
                                       [&name](const Property& each) { return each.name == name; });
    if (property == found->properties.end()) {
      throw InputError(fmt::format("{}: the points have no field '{}'; the file has {}", path_, name,
                                   join_names(found->properties, &Property::name)));
    }
    if (property->type != 'F' || property->count_size > 0) {
      throw InputError(fmt::format(
          "{}: the field '{}' is not a floating-point number; write x, y and z as floats or doubles, in metres", path_,
          name));
    }
    coordinates_[row] = static_cast<std::size_t>(property - found->properties.begin());
  }
}

/// Skips an element before the vertices.
void PlyVertices::skip(const Element& element) {
  if (element.properties.empty()) return;
  std::uint64_t bytes = 0;  // per instance; in a text, one line
  bool has_list = false;
  for (const Property& each : element.properties) {
    bytes += static_cast<std::uint64_t>(each.count_size > 0 ? each.count_size : each.size);
    has_list = has_list || each.count_size > 0;
  }
  if (element.count > size_ / (encoding_ == Encoding::text ? 1 : bytes)) fail("it announces more than it contains");
  if (encoding_ != Encoding::text && !has_list) return skip_bytes(element.count * bytes);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    if (encoding_ == Encoding::text) {
      if (!std::getline(stream_, line_)) fail("the file ends too early");
      continue;
    }
    for (const Property& each : element.properties) {
      skip_bytes(each.count_size > 0 ? list_bytes(each) : static_cast<std::uint64_t>(each.size));
    }
  }
}

void PlyVertices::skip_bytes(std::uint64_t count) {
  const auto at = static_cast<std::uint64_t>(stream_.tellg());
  if (!stream_ || count > size_ - at) fail("the file ends too early");
  stream_.seekg(static_cast<std::streamoff>(at + count));
}

/// Reads bytes in little-endian order.
void PlyVertices::read_bytes(std::uint8_t* bytes, int count) {
  if (!stream_.read(reinterpret_cast<char*>(bytes), count)) fail("the file ends too early");
  if (encoding_ == Encoding::big_endian) std::reverse(bytes, bytes + count);
}

/// Reads a list's count and returns the number of bytes that follow.
std::uint64_t PlyVertices::list_bytes(const Property& list) {
  std::array<std::uint8_t, longest_number> bytes{};
  read_bytes(bytes.data(), list.count_size);
  std::uint64_t count = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) count = (count << 8) | bytes[i];
  return count * static_cast<std::uint64_t>(list.size);
}

Vector3 PlyVertices::next_binary() {
  Vector3 position = Vector3::Zero();
  const std::vector<Property>& properties = elements_[vertex_].properties;
  std::array<std::uint8_t, longest_number> bytes{};
  for (std::size_t i = 0; i < properties.size(); ++i) {
    const Property& property = properties[i];
    if (property.count_size > 0) {
      skip_bytes(list_bytes(property));
      continue;
    }
    read_bytes(bytes.data(), property.size);
    for (std::size_t row = 0; row < 3; ++row) {
      if (coordinates_[row] != i) continue;
      if (property.size == 8) {
        std::memcpy(&position[static_cast<int>(row)], bytes.data(), sizeof(double));
      } else {
        float value = 0.0F;
        std::memcpy(&value, bytes.data(), sizeof(value));
        position[static_cast<int>(row)] = value;
      }
    }
  }
  return position;
}

Vector3 PlyVertices::next_text() {
  Vector3 position = Vector3::Zero();
  if (!std::getline(stream_, line_)) fail("the file ends too early");
  std::istringstream words(line_);
  std::string word;
  const auto next_word = [&]() {
    if (!(words >> word)) fail("a line has too few numbers");
  };
  const std::vector<Property>& properties = elements_[vertex_].properties;
  for (std::size_t i = 0; i < properties.size(); ++i) {
    next_word();
    if (properties[i].count_size > 0) {
      std::uint64_t count = 0;
      if (!parse_number(word, count)) fail("a list has no count");
      for (; count > 0; --count) next_word();
      continue;
    }
    for (std::size_t row = 0; row < 3; ++row) {
      if (coordinates_[row] != i) continue;
      double value = 0.0;
      float single = 0.0F;
      const bool is_double = properties[i].size == 8;
      if (!(is_double ? parse_number(word, value) : parse_number(word, single))) fail("a coordinate is not a number");
      position[static_cast<int>(row)] = is_double ? value : static_cast<double>(single);
    }
  }
  return position;
}

Vector3 PlyVertices::next() {
  return encoding_ == Encoding::text ? next_text() : next_binary();
}

}  // namespace lodestone
