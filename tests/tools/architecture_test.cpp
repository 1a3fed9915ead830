// The floors of the house (design: core < factors, frontends < estimators < tools): an include only ever points down.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>

namespace lodestone {
namespace {

namespace fs = std::filesystem;

/// What each floor may include besides itself.
const std::map<std::string, std::set<std::string>> kAllowed{{"core", {}},
                                                            {"factors", {"core"}},
                                                            {"frontends", {"core"}},
                                                            {"estimators", {"core", "factors", "frontends"}},
                                                            {"tools", {"core", "factors", "frontends", "estimators"}}};

bool is_source(const fs::path& path) {
  static const std::set<std::string> kEndings{".h", ".cpp", ".cc"};
  return kEndings.count(path.extension().string()) > 0;
}

/// Calls `check(file, line number, what is included)` for every quoted or bracketed include below a floor.
template <class Check>
void for_each_include(const std::string& floor, Check check) {
  static const std::regex kInclude(R"re(^\s*#\s*include\s*["<]([^">]+)[">])re");
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(LODESTONE_SOURCE_DIR) / floor)) {
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

TEST(Architecture, IncludesOnlyPointToLowerFloors) {
  for (const auto& [floor, lower] : kAllowed) {
    for_each_include(floor, [&, &floor = floor, &lower = lower](const fs::path& path, int line, const std::string& include) {
      EXPECT_EQ(include.find(".."), std::string::npos) << path << ":" << line << ": includes are written from the root";
      const std::string target = include.substr(0, include.find('/'));
      if (target == "tests" || (kAllowed.count(target) > 0 && target != floor)) {
        EXPECT_EQ(lower.count(target), 1U) << path << ":" << line << ": " << floor << " must not include " << include;
      }
    });
  }
}

TEST(Architecture, TheCoreDoesWithoutInputOutputAndSolvers) {
  const std::regex forbidden(R"(^(ceres|pcl|opencv2|yaml-cpp|rosbag|ros|sensor_msgs|embree3|CLI|nlohmann|spdlog|fstream|iostream)(/|$))");
  for_each_include("core", [&](const fs::path& path, int line, const std::string& include) {
    EXPECT_FALSE(std::regex_search(include, forbidden)) << path << ":" << line << ": the core must not include " << include;
  });
}

TEST(Architecture, HeadersKeepHeavyLibrariesToThemselves) {
  const std::regex heavy(R"(^(pcl/|opencv2/|embree3/|yaml-cpp/|cairo/|tiffio?\.h))");
  for (const auto& [floor, lower] : kAllowed) {
    for_each_include(floor, [&](const fs::path& path, int line, const std::string& include) {
      if (path.extension() != ".h") return;
      EXPECT_FALSE(std::regex_search(include, heavy)) << path << ":" << line << ": include " << include << " in a .cpp";
    });
  }
}

/// ThreadSanitizer is told of the order of loops in one place (core/parallel.h).
TEST(Architecture, LoopsOnAllCoresGoThroughOneDoor) {
  const std::regex loops(R"(^tbb/(parallel_|blocked_range|task_group|flow_graph))");
  for (const auto& [floor, lower] : kAllowed) {
    for_each_include(floor, [&](const fs::path& path, int line, const std::string& include) {
      if (path.filename() == "parallel.cpp" || path.filename() == "parallel_sort.h") return;
      EXPECT_FALSE(std::regex_search(include, loops)) << path << ":" << line << ": core/parallel.h instead of " << include;
    });
  }
}

TEST(Architecture, NoFileOutgrowsFourHundredLines) {
  for (const auto& [floor, lower] : kAllowed) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(LODESTONE_SOURCE_DIR) / floor)) {
      if (!entry.is_regular_file() || !is_source(entry.path())) continue;
      std::ifstream file(entry.path());
      const auto lines = std::count(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>(), '\n');
      EXPECT_LT(lines, 400) << entry.path() << ": a file holds one idea";
    }
  }
}

TEST(Architecture, NothingBelowMainEndsTheProgram) {
  const std::regex ends(R"((^|[^\w.>:])(std::)?(abort|exit|quick_exit|_exit)\s*\()");
  for (const auto& [floor, lower] : kAllowed) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(LODESTONE_SOURCE_DIR) / floor)) {
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
