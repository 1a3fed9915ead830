#include "frontends/logs/ros2/bag_metadata.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>

#include "core/error.h"
#include "frontends/configuration/text_file.h"

namespace lodestone {

namespace fs = std::filesystem;

std::vector<std::string> bag_files(const std::string& metadata) {
  std::vector<std::string> names;
  try {
    const YAML::Node root = YAML::Load(read_text_file(metadata))["rosbag2_bagfile_information"];
    if (root) names = root["relative_file_paths"].as<std::vector<std::string>>();
  } catch (const YAML::Exception& error) {
    throw InputError(metadata + ": is not a description of a ROS 2 bag: " + error.msg +
                     "; create it again with 'ros2 bag reindex'");
  }
  if (names.empty()) {
    throw InputError(metadata +
                     ": lists no files (rosbag2_bagfile_information.relative_file_paths); create it again with "
                     "'ros2 bag reindex'");
  }
  std::vector<std::string> files;
  const fs::path folder = fs::path(metadata).parent_path();
  for (const std::string& name : names) {
    // The oldest bags include the folder's name. A packed file may be listed without its ending, or be unpacked since.
    const fs::path plain = fs::path(name).filename();
    const fs::path unpacked = plain.extension() == ".zstd" ? fs::path(plain).replace_extension() : plain;
    const fs::path candidates[] = {folder / name, folder / plain, folder / (plain.string() + ".zstd"),
                                   folder / unpacked};
    std::error_code ignored;
    const fs::path* found = nullptr;
    for (const fs::path& candidate : candidates) {
      if (found == nullptr && fs::is_regular_file(candidate, ignored)) found = &candidate;
    }
    if (found == nullptr) {
      throw InputError((folder / name).string() + ": there is no such file, but " + metadata +
                       " lists it; copy the file there, or "
                       "remove it from the list");
    }
    if (std::find(files.begin(), files.end(), found->string()) != files.end()) {
      throw InputError(metadata + ": lists " + name + " twice; remove one entry from the list");
    }
    files.push_back(found->string());
  }
  return files;
}

}  // namespace lodestone
