#include "frontends/maps/pcd_layout.h"

#include <fstream>
#include <sstream>

namespace lodestone {

namespace {

template <class Value>
std::vector<Value> remaining_values(std::istringstream& words) {
  std::vector<Value> values;
  for (Value value; words >> value;) values.push_back(value);
  return values;
}

}  // namespace

std::optional<PcdLayout> read_binary_pcd_layout(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  std::vector<std::string> names;
  std::vector<char> types;
  std::vector<int> sizes;
  std::vector<int> counts;
  std::int64_t width = 0;
  std::int64_t height = 1;
  std::string data;
  std::string line;
  for (int lines = 0; data.empty() && lines < 100 && std::getline(stream, line); ++lines) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "FIELDS") names = remaining_values<std::string>(words);
    if (key == "TYPE") types = remaining_values<char>(words);
    if (key == "SIZE") sizes = remaining_values<int>(words);
    if (key == "COUNT") counts = remaining_values<int>(words);
    if (key == "WIDTH") words >> width;
    if (key == "HEIGHT") words >> height;
    if (key == "DATA") words >> data;
  }
  if (counts.empty()) counts.assign(names.size(), 1);
  const std::size_t fields = names.size();
  if (data != "binary" || fields == 0 || types.size() != fields || sizes.size() != fields || counts.size() != fields ||
      width < 0 || height < 0 || (height > 0 && width > INT64_MAX / height)) {
    return std::nullopt;
  }
  PcdLayout layout;
  for (std::size_t i = 0; i < fields; ++i) {
    if (sizes[i] < 1 || sizes[i] > 8 || counts[i] < 0 || counts[i] > 1 << 20) return std::nullopt;
    layout.fields.push_back({names[i], types[i], sizes[i], layout.point_bytes});
    layout.point_bytes += std::int64_t{sizes[i]} * counts[i];
  }
  layout.points = width * height;
  layout.data_offset = static_cast<std::int64_t>(stream.tellg());
  if (layout.data_offset <= 0 || layout.point_bytes == 0) return std::nullopt;
  return layout;
}

}  // namespace lodestone
