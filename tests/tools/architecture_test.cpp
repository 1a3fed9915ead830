// Layers of the source tree: an include refers only to the same or a lower layer (core < factors, frontends <
// estimators < localization < tools).
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace lodestone {
namespace {

namespace fs = std::filesystem;

/// Layers that each layer may include, besides itself.
const std::map<std::string, std::set<std::string>> kAllowed{
    {"core", {}},
    {"factors", {"core"}},
    {"frontends", {"core"}},
    {"estimators", {"core", "factors"}},
    {"localization", {"core", "factors", "frontends", "estimators"}},
    {"tools", {"core", "factors", "frontends", "estimators", "localization"}},
    {"python", {"core", "factors", "frontends", "estimators", "localization"}}};

bool is_source(const fs::path& path) {
  static const std::set<std::string> kEndings{".h", ".cpp", ".cc"};
  return kEndings.count(path.extension().string()) > 0;
}

/// Calls `check(file, line number, include)` for every quoted or bracketed include of a layer.
template <class Check>
void for_each_include(const std::string& layer, Check check) {
  static const std::regex kInclude(R"re(^\s*#\s*include\s*["<]([^">]+)[">])re");
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(LODESTONE_SOURCE_DIR) / layer)) {
    if (!entry.is_regular_file() || !is_source(entry.path())) continue;
    std::ifstream file(entry.path());
    int number = 0;
    for (std::string line; std::getline(file, line);) {
      ++number;
      std::smatch match;
      if (std::regex_search(line, match, kInclude)) check(entry.path(), number, match[1].str());
    }
  }
}

TEST(Architecture, IncludesOnlyPointToLowerLayers) {
  for (const auto& [layer, lower] : kAllowed) {
    for_each_include(layer, [&, &layer = layer, &lower = lower](const fs::path& path, int line,
                                                                const std::string& include) {
      EXPECT_EQ(include.find(".."), std::string::npos) << path << ":" << line << ": includes are written from the root";
      const std::string target = include.substr(0, include.find('/'));
      if (target == "tests" || (kAllowed.count(target) > 0 && target != layer)) {
        EXPECT_EQ(lower.count(target), 1U) << path << ":" << line << ": " << layer << " must not include " << include;
      }
    });
  }
}

/// A room is a folder of a layer. Files beside the rooms are their common interface, and belong to none.
TEST(Architecture, RoomsOfALayerIncludeEachOtherInOneDirection) {
  for (const auto& [layer, lower] : kAllowed) {
    const fs::path root = fs::path(LODESTONE_SOURCE_DIR) / layer;
    std::map<std::string, std::set<std::string>> below;
    for_each_include(layer, [&, &layer = layer](const fs::path& path, int, const std::string& include) {
      const fs::path from = fs::relative(path, root);
      const fs::path to = fs::path(include).lexically_relative(layer);
      const auto is_in_room = [](const fs::path& file) { return std::distance(file.begin(), file.end()) > 1; };
      if (to.empty() || *to.begin() == ".." || !is_in_room(from) || !is_in_room(to)) return;
      if (*from.begin() != *to.begin()) below[from.begin()->string()].insert(to.begin()->string());
    });
    // Rooms that include none of those left are taken away, until only cycles and what is above them are left.
    for (std::size_t before = 0; before != below.size();) {
      before = below.size();
      std::erase_if(below, [&](const auto& room) {
        return std::ranges::none_of(room.second, [&](const std::string& name) { return below.count(name) > 0; });
      });
    }
    for (const auto& [room, others] : below) {
      std::string names;
      for (const std::string& other : others) names += " " + other;
      ADD_FAILURE() << layer << "/" << room << " is in a cycle, or above one; it includes" << names;
    }
  }
}

TEST(Architecture, OnlyFrontendsAndToolsKnowFilesAndTheirFormats) {
  const std::regex forbidden(R"(^(pcl|opencv2|yaml-cpp|rosbag|ros|sensor_msgs|embree3|CLI|nlohmann|spdlog|)"
                             R"(sqlite3\.h|tiffio\.h|fstream|iostream)(/|$))");
  const std::regex solvers(R"(^(ceres|cholmod\.h|suitesparse)(/|$))");
  for (const std::string layer : {"core", "factors", "estimators", "localization", "python"}) {
    for_each_include(layer, [&](const fs::path& path, int line, const std::string& include) {
      EXPECT_FALSE(std::regex_search(include, forbidden))
          << path << ":" << line << ": " << layer << " must not include " << include;
      if (layer == "core") {
        EXPECT_FALSE(std::regex_search(include, solvers))
            << path << ":" << line << ": the core must not include " << include;
      }
    });
  }
}

/// Written by CMake: "LAYER: LIBRARY LIBRARY…", with all directly and indirectly linked libraries.
TEST(Architecture, EstimatorsLinkNoFileFormat) {
  const std::regex forbidden("pcl|opencv|embree|ros|sqlite|tiff|cairo|yaml", std::regex::icase);
  std::ifstream file(LODESTONE_LINK_DEPENDENCIES);
  ASSERT_TRUE(file.is_open());
  int layers = 0;
  for (std::string line; std::getline(file, line); ++layers) {
    EXPECT_FALSE(std::regex_search(line, forbidden)) << line;
    EXPECT_NE(line.find("Eigen3"), std::string::npos) << line;  // the list is not empty
  }
  EXPECT_EQ(layers, 3);
}

TEST(Architecture, OnlyItsRoomKnowsTheSimulator) {
  const std::string door = "tools/simulate/world_queries.h";
  for (const auto& [layer, lower] : kAllowed) {
    for_each_include(layer, [&](const fs::path& path, int line, const std::string& include) {
      if (include.find("tools/simulate/") != 0 || path.string().find("/tools/simulate/") != std::string::npos) return;
      EXPECT_EQ(include, door) << path << ":" << line << ": must not include " << include;
    });
  }
}

TEST(Architecture, NoRoomHoldsAQuarterOfTheCode) {
  std::map<std::string, std::ptrdiff_t> rooms;
  std::ptrdiff_t all = 0;
  for (const auto& [layer, lower] : kAllowed) {
    const fs::path root = fs::path(LODESTONE_SOURCE_DIR) / layer;
    for (const auto& entry : fs::recursive_directory_iterator(root)) {
      if (!entry.is_regular_file() || !is_source(entry.path())) continue;
      std::ifstream file(entry.path());
      const auto lines = std::count(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>(), '\n');
      rooms[layer + "/" + fs::relative(entry.path(), root).begin()->string()] += lines;
      all += lines;
    }
  }
  for (const auto& [room, lines] : rooms) EXPECT_LT(4 * lines, all) << room;
}

TEST(Architecture, HeadersKeepHeavyLibrariesToThemselves) {
  const std::regex heavy(R"(^(pcl/|opencv2/|embree3/|yaml-cpp/|cairo/|tiffio?\.h))");
  for (const auto& [layer, lower] : kAllowed) {
    for_each_include(layer, [&](const fs::path& path, int line, const std::string& include) {
      if (path.extension() != ".h" || include == "opencv2/core/mat.hpp" || include == "opencv2/core/types.hpp")
        return;  // cv::Mat is the raster type
      EXPECT_FALSE(std::regex_search(include, heavy)) << path << ":" << line << ": include " << include << " in a .cpp";
    });
  }
}

/// ThreadSanitizer learns the order of loops in one place (core/parallel.h).
TEST(Architecture, LoopsOnAllCoresGoThroughOneDoor) {
  const std::regex loops(R"(^tbb/(parallel_|blocked_range|task_group|flow_graph))");
  for (const auto& [layer, lower] : kAllowed) {
    for_each_include(layer, [&](const fs::path& path, int line, const std::string& include) {
      if (path.filename() == "parallel.cpp") return;
      EXPECT_FALSE(std::regex_search(include, loops))
          << path << ":" << line << ": core/parallel.h instead of " << include;
    });
  }
}

TEST(Architecture, NoLineHasMoreThan120Columns) {
  const std::regex texts(R"(.*\.(h|cpp|cc|js|mjs|css|html|py|sh|cmake|yaml)|.*CMakeLists\.txt)");
  for (const char* folder : {"core", "factors", "frontends", "estimators", "localization", "tools", "tests", "config",
                             "cmake", "python", "docs/examples"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(LODESTONE_SOURCE_DIR) / folder)) {
      if (!entry.is_regular_file() || !std::regex_match(entry.path().filename().string(), texts)) continue;
      std::ifstream file(entry.path());
      int number = 0;
      for (std::string line; std::getline(file, line);) {
        ++number;
        const auto columns = std::count_if(line.begin(), line.end(), [](char byte) { return (byte & 0xC0) != 0x80; });
        EXPECT_LE(columns, 120) << entry.path() << ":" << number;
      }
    }
  }
}

TEST(Architecture, NoFileOutgrowsFourHundredLines) {
  for (const auto& [layer, lower] : kAllowed) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(LODESTONE_SOURCE_DIR) / layer)) {
      if (!entry.is_regular_file() || !is_source(entry.path())) continue;
      std::ifstream file(entry.path());
      const auto lines = std::count(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>(), '\n');
      EXPECT_LT(lines, 400) << entry.path() << ": a file holds one idea";
    }
  }
}

TEST(Architecture, NothingBelowMainEndsTheProgram) {
  const std::regex ends(R"((^|[^\w.>:])(std::)?(abort|exit|quick_exit|_exit)\s*\()");
  for (const auto& [layer, lower] : kAllowed) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(LODESTONE_SOURCE_DIR) / layer)) {
      if (!entry.is_regular_file() || !is_source(entry.path())) continue;
      std::ifstream file(entry.path());
      for (std::string line; std::getline(file, line);) {
        const std::string code = line.substr(0, line.find("//"));
        EXPECT_FALSE(std::regex_search(code, ends)) << entry.path() << ": " << line;
      }
    }
  }
}

}  // namespace
}  // namespace lodestone
