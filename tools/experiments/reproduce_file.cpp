#include "tools/experiments/reproduce_file.h"

#include <nlohmann/json.hpp>

namespace lodestone::reproduce {

namespace {

using Json = nlohmann::ordered_json;

Json optional_number(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}
Json optional_text(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json(text);
}

}  // namespace

std::string to_json(const Experiment& experiment, const Results& results, const std::vector<std::string>& status,
                    const std::vector<ResultTable>& tables, const std::vector<DrawnFigure>& figures) {
  Json json;
  json["experiment"] = experiment.name;
  json["title"] = experiment.title;
  json["runs"] = Json::array();
  for (std::size_t i = 0; i < results.runs().size(); ++i) {
    const Run& run = results.runs()[i];
    json["runs"].push_back({{"name", run.name},
                            {"group", run.group},
                            {"row", run.row},
                            {"sequence", run.sequence},
                            {"world", run.world_name},
                            {"grade", optional_text(run.grade)},
                            {"range_m", optional_number(run.range_m)},
                            {"noise_ut", optional_number(run.noise_ut)},
                            {"scene", optional_text(run.scene)},
                            {"seed", run.seed},
                            {"folder", run.folder},
                            {"estimators", run.estimators},
                            {"status", status[i]}});
  }
  json["tables"] = Json::array();
  for (const ResultTable& table : tables) {
    json["tables"].push_back(
        {{"title", table.title}, {"header", table.header}, {"rows", table.rows}, {"note", table.note}});
  }
  json["figures"] = Json::array();
  for (const DrawnFigure& figure : figures) {
    json["figures"].push_back({{"title", figure.title},
                               {"png", figure.png},
                               {"pdf", figure.pdf},
                               {"svg", figure.svg},
                               {"caption", figure.caption}});
  }
  return json.dump(2) + "\n";
}

}  // namespace lodestone::reproduce
