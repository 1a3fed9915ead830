#pragma once

#include <array>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "core/geometry/so3.h"

namespace lodestone {

/// Streams the positions of a PLY file's vertices: text or binary of either byte order, coordinates as float or double,
/// with any other properties and elements. Announced sizes are not trusted: memory is required for one vertex only, and
/// the bytes must exist.
class PlyVertices {
 public:
  /// Reads the header. Throws InputError if it is invalid, or has no vertices with x, y and z.
  explicit PlyVertices(const std::string& path);

  std::uint64_t count() const { return elements_[vertex_].count; }

  /// The next of count() positions. Throws InputError if the file ends before, or a value is not a number.
  Vector3 next();

 private:
  enum class Encoding { text, little_endian, big_endian };
  struct Property {
    std::string name;
    char type = 'F';     ///< F, I or U
    int size = 4;        ///< bytes
    int count_size = 0;  ///< bytes of a list's count; 0: no list
  };
  struct Element {
    std::string name;
    std::uint64_t count = 0;
    std::vector<Property> properties;
  };

  [[noreturn]] void fail(const std::string& what) const;
  bool header_line(std::string& line);
  void read_header();
  void parse_format(const std::string& kind);
  void parse_property(std::istream& words);
  Property number_type(const std::string& name) const;
  void find_coordinates();
  void skip(const Element& element);
  void skip_bytes(std::uint64_t count);
  void read_bytes(std::uint8_t* bytes, int count);
  std::uint64_t list_bytes(const Property& list);
  Vector3 next_binary();
  Vector3 next_text();

  std::string path_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;  ///< size of the file, bytes
  Encoding encoding_ = Encoding::text;
  std::vector<Element> elements_;
  std::size_t vertex_ = 0;                    ///< index of the vertex element
  std::array<std::size_t, 3> coordinates_{};  ///< indices of the vertex properties
  std::string line_;
};

}  // namespace lodestone
