#include "tools/report/reproduce_data.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "tools/markup.h"
#include "tools/progress.h"
#include "tools/report/json_file.h"
#include "tools/report/run_data.h"

namespace lodestone {

namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

/// Text values of a JSON object that may be absent.
std::string text_of(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// The smaller of the figure's pictures, SVG or PNG, embedded, and the names of all its files.
Json figure_json(const fs::path& folder, const Json& figure, Json& missing) {
  Json json;
  json["title"] = text_of(figure, "title");
  json["caption"] = text_of(figure, "caption");
  json["files"] = Json::array();
  std::string embedded;
  std::uintmax_t smallest = 0;
  for (const char* kind : {"svg", "png", "pdf"}) {
    const std::string name = text_of(figure, kind);
    if (name.empty()) continue;
    const fs::path path = folder / name;
    if (!fs::exists(path)) {
      missing.push_back(name);
      continue;
    }
    json["files"].push_back(name);
    const std::uintmax_t size = fs::file_size(path);
    if (std::string_view(kind) == "pdf" || (!embedded.empty() && size >= smallest)) continue;
    smallest = size;
    embedded = kind;
  }
  if (!embedded.empty()) {
    const std::string bytes = read_text_file((folder / text_of(figure, embedded.c_str())).string());
    json["image"] = data_uri(embedded == "svg" ? "image/svg+xml" : "image/png", bytes);
  }
  return json;
}

/// The runs on disk with one seed per case, the smallest. Finished runs that are missing on disk are added to
/// `missing`.
std::vector<Json> choose_one_seed(const fs::path& folder, const Json& runs, Json& missing) {
  std::map<std::string, std::size_t> places;
  std::vector<Json> chosen;
  for (const Json& run : runs) {
    const std::string place = text_of(run, "folder");
    if (!is_run_folder(folder / place)) {
      if (text_of(run, "status") == "done") missing.push_back(place);
      continue;
    }
    Json key = run;
    for (const char* differs : {"seed", "folder", "name", "estimators", "status"}) key.erase(differs);
    const auto [found, fresh] = places.try_emplace(key.dump(), chosen.size());
    if (fresh) {
      chosen.push_back(run);
    } else if (run.value("seed", 0) < chosen[found->second].value("seed", 0)) {
      chosen[found->second] = run;
    }
  }
  return chosen;
}

/// About 15 MB for all runs: six characters per value, some twenty series per estimator.
DetailLimits limits_for(const std::vector<Json>& runs) {
  constexpr double kCharacters = 9e6;
  constexpr double kCharactersAPoint = 20.0 * 6.0;
  std::size_t estimators = 0;
  for (const Json& run : runs) {
    const auto found = run.find("estimators");
    estimators += found != run.end() && found->is_array() ? found->size() : 1;
  }
  const auto share = [](double total, std::size_t count) {
    return static_cast<std::size_t>(total / std::max<std::size_t>(1, count));
  };
  DetailLimits limits;
  limits.points_per_series = std::clamp<std::size_t>(share(kCharacters / kCharactersAPoint, estimators), 200, 2000);
  limits.field_values = std::clamp<std::size_t>(share(3e6, runs.size()), 40'000, 1'000'000);
  limits.cloud_points = std::clamp<std::size_t>(share(3e5, runs.size()), 8'000, 150'000);
  return limits;
}

Json reproduce_json(const fs::path& folder, const Json& source) {
  Json missing = Json::array();
  Json json;
  json["experiment"] = text_of(source, "experiment");
  json["title"] = text_of(source, "title");
  json["tables"] = source["tables"];
  json["figures"] = Json::array();
  for (const Json& figure : source["figures"]) {
    json["figures"].push_back(figure_json(folder, figure, missing));
    throw_if_interrupted();
  }

  json["all_runs"] = source["runs"].size();
  const std::vector<Json> runs = choose_one_seed(folder, source["runs"], missing);
  const DetailLimits limits = limits_for(runs);
  json["runs"] = Json::array();
  for (const Json& run : runs) {
    Json entry = run;
    entry["data"] = read_run(folder / text_of(run, "folder"), limits);
    json["runs"].push_back(std::move(entry));
  }
  json["missing"] = missing;
  return json;
}

}  // namespace

bool is_reproduce_folder(const fs::path& folder) {
  return fs::exists(folder / "reproduce.json");
}

Json read_reproduce(const fs::path& folder) {
  const fs::path path = folder / "reproduce.json";
  const Json source = read_json(path);
  for (const char* key : {"runs", "tables", "figures"}) {
    if (!source.is_object() || !source.contains(key) || !source[key].is_array()) {
      throw InputError(
          fmt::format("{}: expected a list under '{}'; run `lodestone reproduce` again", path.string(), key));
    }
  }
  return values_of(path, [&]() { return reproduce_json(folder, source); });
}

}  // namespace lodestone
