#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/magnetometer/magnetic_difference.h"
#include "frontends/configuration/text_file.h"
#include "frontends/maps/magnetic_difference_file.h"
#include "frontends/maps/magnetic_map_file.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/map/changed_places.h"
#include "tools/map/difference_picture.h"
#include "tools/progress.h"
#include "tools/writers/output_folder.h"

namespace lodestone {
namespace {

struct MapDiffCall {
  std::string first;
  std::string second;
  std::string out;
  double threshold_ut = 10.0;
  double level = 0.05;  // as usual for a test of one hypothesis: this site did not change
};

struct Shares {
  double compared, only_first, only_second;
};

Shares shares_of(const MagneticDifference& difference) {
  const double all = difference.compared_m2 + difference.only_first_m2 + difference.only_second_m2;
  return {difference.compared_m2 / all, difference.only_first_m2 / all, difference.only_second_m2 / all};
}

void refuse_disjoint(const MapDiffCall& call, const MagneticMap& first, const MagneticMap& second) {
  const auto span = [](const FieldGrid& grid) {
    return fmt::format("x {:.2f} to {:.2f}, y {:.2f} to {:.2f}, z {:.2f} to {:.2f} m", grid.origin.x(),
                       grid.origin.x() + grid.resolution_m * (grid.columns - 1), grid.origin.y(),
                       grid.origin.y() + grid.resolution_m * (grid.rows - 1), grid.heights_m.front(),
                       grid.heights_m.back());
  };
  throw InputError(
      fmt::format("the maps do not overlap: {} spans {}, {} spans {}; compare maps of one site, in one "
                  "frame",
                  call.first, span(first.grid()), call.second, span(second.grid())));
}

std::string to_json(const MapDiffCall& call, const MagneticDifference& difference,
                    const DifferenceSignificance& significance, const std::vector<ChangedPlace>& places) {
  using Json = nlohmann::ordered_json;
  const Shares shares = shares_of(difference);
  const Vector3& at = difference.largest_at;
  Json json{{"first", call.first},
            {"second", call.second},
            {"compared_m2", difference.compared_m2},
            {"compared_nodes", difference.nodes},
            {"share_compared", shares.compared},
            {"share_only_first", shares.only_first},
            {"share_only_second", shares.only_second},
            {"mean_ut", difference.mean_ut},
            {"rms_ut", difference.rms_ut},
            {"quantile_95_ut", difference.high_ut},
            {"largest_ut", difference.largest_ut},
            {"largest_at_m", {at.x(), at.y(), at.z()}},
            {"normalized_rms", difference.normalized_rms},
            {"share_above_3_sigma", difference.share_above_three_sigma},
            {"common_change_ut", {significance.common_ut.x(), significance.common_ut.y(), significance.common_ut.z()}},
            {"sigma_scale", {significance.scale.x(), significance.scale.y(), significance.scale.z()}},
            {"level", call.level},
            {"critical_chi_square", significance.critical(call.level)},
            {"threshold_ut", call.threshold_ut},
            {"places_above_threshold", places.size()}};
  double area = 0.0;
  for (const ChangedPlace& place : places) area += place.area_m2;
  json["area_above_threshold_m2"] = area;
  return json.dump(2) + "\n";
}

std::string to_csv(const std::vector<ChangedPlace>& places) {
  std::string text =
      "place,x_m,y_m,area_m2,mean_change_ut,largest_change_ut,largest_x_m,largest_y_m,largest_z_m,sigma_ut,"
      "p_value\n";
  for (std::size_t i = 0; i < places.size(); ++i) {
    const ChangedPlace& place = places[i];
    text +=
        fmt::format("{},{:.3f},{:.3f},{:.4g},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.3g}\n", i + 1,
                    place.center.x(), place.center.y(), place.area_m2, place.mean_ut, place.largest_ut,
                    place.largest_at.x(), place.largest_at.y(), place.largest_at.z(), place.sigma_ut, place.p_value);
  }
  return text;
}

void print_figures(const MapDiffCall& call, const MagneticDifference& difference,
                   const DifferenceSignificance& significance, const std::vector<ChangedPlace>& places) {
  const Shares shares = shares_of(difference);
  const Vector3& at = difference.largest_at;
  fmt::print("compared {:.2f} m2, {:.1f} % of the union of both maps; only {}: {:.1f} %, only {}: {:.1f} %\n",
             difference.compared_m2, 100.0 * shares.compared, call.first, 100.0 * shares.only_first, call.second,
             100.0 * shares.only_second);
  fmt::print(
      "|dB|: mean {:.3f} uT, rms {:.3f} uT, 95 % below {:.3f} uT, largest {:.3f} uT at ({:.2f}, {:.2f}, {:.2f}) m\n",
      difference.mean_ut, difference.rms_ut, difference.high_ut, difference.largest_ut, at.x(), at.y(), at.z());
  fmt::print(
      "normalized by the maps' sigma: rms {:.2f} per component (1: no change), {:.1f} % above 3 sigma (2.9 % by "
      "chance)\n",
      difference.normalized_rms, 100.0 * difference.share_above_three_sigma);
  const Vector3& common = significance.common_ut;
  fmt::print("common to the whole site: {:.2f} {:.2f} {:.2f} uT (x y z), removed before the test\n", common.x(),
             common.y(), common.z());
  if (significance.scale != difference.sigma_shares) {
    fmt::print("the maps differ by {:.2f} {:.2f} {:.2f} of their sigma (x y z) almost everywhere; the test uses this\n",
               significance.scale.x(), significance.scale.y(), significance.scale.z());
  }
  fmt::print("{} place{} above {:g} uT, by more than the maps' errors at the level {:g}\n", places.size(),
             places.size() == 1 ? "" : "s", call.threshold_ut, call.level);
  constexpr std::size_t most = 10;
  if (!places.empty()) fmt::print("  place        x, m      y, m   area, m2   largest, uT   sigma, uT   p-value\n");
  for (std::size_t i = 0; i < std::min(most, places.size()); ++i) {
    fmt::print("  {:>5} {:>11.2f} {:>9.2f} {:>10.3g} {:>13.2f} {:>11.2f} {:>9.2g}\n", i + 1, places[i].center.x(),
               places[i].center.y(), places[i].area_m2, places[i].largest_ut, places[i].sigma_ut, places[i].p_value);
  }
  if (places.size() > most) fmt::print("  ... {} more in places.csv\n", places.size() - most);
}

/// Names without folders if they differ.
std::string difference_title(const MapDiffCall& call) {
  const std::string first = std::filesystem::path(call.first).filename().string();
  const std::string second = std::filesystem::path(call.second).filename().string();
  return first != second ? fmt::format("Change of the field from {} to {}", first, second)
                         : fmt::format("Change of the field from {} to {}", call.first, call.second);
}

void map_diff(const MapDiffCall& call) {
  if (!(call.threshold_ut > 0.0) || !std::isfinite(call.threshold_ut)) {
    throw InputError(fmt::format("--threshold-ut: expected microtesla above 0, found {}", call.threshold_ut));
  }
  if (!(call.level > 0.0 && call.level < 1.0)) {
    throw InputError(fmt::format("--level: expected a probability between 0 and 1, found {}", call.level));
  }
  const MagneticMap first = read_magnetic_map(call.first);
  throw_if_interrupted();
  const MagneticMap second = read_magnetic_map(call.second);
  throw_if_interrupted();
  const MagneticDifference difference = compare_maps(first, second);
  throw_if_interrupted();
  if (difference.nodes == 0) refuse_disjoint(call, first, second);
  const DifferenceSignificance significance = significance_of(difference);
  const std::vector<ChangedPlace> places = changed_places(difference, significance, call.threshold_ut, call.level);
  throw_if_interrupted();  // not later: the files of a result belong together

  const std::filesystem::path out = made_folder(call.out);
  print_figures(call, difference, significance, places);
  write_magnetic_difference(difference, call.first, call.second, (out / "difference.yaml").string());
  write_text_file(out / "places.csv", to_csv(places));
  draw_difference_picture(out / "picture", difference, places, difference_title(call));
  write_text_file(out / "diff.json", to_json(call, difference, significance, places));
  fmt::print("wrote {}/: picture.png, .pdf and .svg, difference.yaml with difference.tif, places.csv, diff.json\n",
             call.out);
}

}  // namespace

void add_map_diff(CLI::App& map) {
  const auto call = std::make_shared<MapDiffCall>();
  CLI::App* command = map.add_subcommand(
      "diff", "Compare two magnetic maps of one site at the nodes of the first: significant changes and their places");
  CommandFiles files(*command);
  files.input(command->add_option("FIRST", call->first, "the earlier magnetic map, FIELD.yaml"))->required();
  files.input(command->add_option("SECOND", call->second, "the later magnetic map, with any grid and resolution"))
      ->required();
  files
      .output(
          command->add_option("--out", call->out,
                              "folder for picture.png, .pdf and .svg, difference.yaml and .tif, places.csv, diff.json"),
          CommandFiles::within({"picture.png", "picture.pdf", "picture.svg", "difference.yaml", "difference.tif",
                                "places.csv", "diff.json"}))
      ->required();
  command->add_option("--threshold-ut", call->threshold_ut, "places with a larger change are listed, microtesla")
      ->capture_default_str();
  command->add_option("--level", call->level, "probability that two maps of an unchanged site show any place")
      ->capture_default_str();
  command->footer(R"(
Examples:
  lodestone map diff spring.yaml autumn.yaml --out /tmp/change
  lodestone map diff spring.yaml autumn.yaml --out /tmp/change --threshold-ut 3 --level 0.01)");
  command->callback([call] { map_diff(*call); });
}

}  // namespace lodestone
