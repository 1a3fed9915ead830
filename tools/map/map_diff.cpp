#include "tools/map/map_diff.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/magnetometer/difference_significance.h"
#include "core/magnetometer/magnetic_difference.h"
#include "frontends/maps/magnetic_difference_file.h"
#include "frontends/maps/magnetic_map_file.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/map/changed_places.h"
#include "tools/plotting/difference_picture.h"
#include "tools/writers/output_file.h"

namespace lodestone {
namespace {

struct MapDiffCall {
  std::string first;
  std::string second;
  std::string out;
  double threshold_ut = 10.0;
  double significance = 0.05;  ///< the customary level since Fisher (1925), Statistical Methods for Research Workers
};

/// The places above the threshold: those that chance does not explain, and the others.
struct JudgedPlaces {
  std::vector<ChangedPlace> reported;
  std::vector<ChangedPlace> by_chance;
};

double area_m2(const std::vector<ChangedPlace>& places) {
  double sum = 0.0;
  for (const ChangedPlace& place : places) sum += place.area_m2;
  return sum;
}

JudgedPlaces judge(const std::vector<ChangedPlace>& places, double level) {
  JudgedPlaces result;
  for (const ChangedPlace& place : places) {
    (place.p_value <= level ? result.reported : result.by_chance).push_back(place);
  }
  return result;
}

struct Shares {
  double compared, only_first, only_second;
};

Shares shares_of(const MagneticDifference& difference) {
  const double all = difference.compared_m2 + difference.only_first_m2 + difference.only_second_m2;
  return {difference.compared_m2 / all, difference.only_first_m2 / all, difference.only_second_m2 / all};
}

void refuse_disjoint(const MapDiffCall& call, const MagneticMap& first, const MagneticMap& second) {
  const auto span = [](const FieldGrid& grid) {
    return fmt::format("x {:.2f} to {:.2f}, y {:.2f} to {:.2f} m", grid.origin.x(),
                       grid.origin.x() + grid.resolution_m * (grid.columns - 1), grid.origin.y(),
                       grid.origin.y() + grid.resolution_m * (grid.rows - 1));
  };
  throw InputError(
      fmt::format("the maps have no place in common: {} spans {}, {} spans {}; compare maps of one site, in one "
                  "frame",
                  call.first, span(first.grid()), call.second, span(second.grid())));
}

std::string to_json(const MapDiffCall& call, const MagneticDifference& difference,
                    const DifferenceSignificance& significance, const JudgedPlaces& judged) {
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
            {"threshold_ut", call.threshold_ut},
            {"places_above_threshold", judged.reported.size() + judged.by_chance.size()},
            {"area_above_threshold_m2", area_m2(judged.reported) + area_m2(judged.by_chance)},
            {"places_reported", judged.reported.size()},
            {"area_reported_m2", area_m2(judged.reported)},
            {"significance", call.significance},
            {"sigma_scale", significance.sigma_scale()},
            {"correlation_length_m", significance.correlation_length_m()},
            {"independent_places", significance.independent_places(call.significance)},
            {"critical_scaled_sigmas", significance.critical_sigmas(call.significance)}};
  return json.dump(2) + "\n";
}

std::string to_csv(const std::vector<ChangedPlace>& places) {
  std::string text =
      "place,x_m,y_m,area_m2,mean_change_ut,largest_change_ut,largest_x_m,largest_y_m,largest_z_m,sigma_ut,"
      "scaled_sigma_ut,largest_over_scaled_sigma,p_value\n";
  for (std::size_t i = 0; i < places.size(); ++i) {
    const ChangedPlace& place = places[i];
    text += fmt::format("{},{:.3f},{:.3f},{:.4g},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{:.4g},{:.4g},{:.4g},{:.3g}\n",
                        i + 1, place.center.x(), place.center.y(), place.area_m2, place.mean_ut, place.largest_ut,
                        place.largest_at.x(), place.largest_at.y(), place.largest_at.z(), place.sigma_ut,
                        place.scaled_sigma_ut, place.most_sigmas, place.p_value);
  }
  return text;
}

void print_significance(const MapDiffCall& call, const DifferenceSignificance& significance) {
  const double scale = significance.sigma_scale();
  if (scale > 1.0) {
    fmt::print(
        "stated sigmas: too small by a factor of {:.2f}, by the median over all nodes; scaled sigma = {:.2f} sigma\n",
        scale, scale);
  } else {
    fmt::print("stated sigmas: not too small, the median over all nodes is {:.2f} of theirs; scaled sigma = sigma\n",
               significance.median_ratio());
  }
  fmt::print(
      "chance: correlation length {:.2f} m, as many as {:.0f} independent places; p is at most {:g} beyond {:.2f} "
      "scaled "
      "sigma\n",
      significance.correlation_length_m(), significance.independent_places(call.significance), call.significance,
      significance.critical_sigmas(call.significance));
}

void print_places(const MapDiffCall& call, const JudgedPlaces& judged) {
  const std::vector<ChangedPlace>& places = judged.reported;
  const auto count = [](std::size_t number) { return fmt::format("{} place{}", number, number == 1 ? "" : "s"); };
  fmt::print("{} above {:g} uT with p of at most {:g}; {} above {:g} uT discarded as chance\n", count(places.size()),
             call.threshold_ut, call.significance, count(judged.by_chance.size()), call.threshold_ut);
  constexpr std::size_t most = 10;
  if (!places.empty()) {
    fmt::print("  place        x, m      y, m   area, m2   largest, uT   sigma, uT   scaled, uT         p\n");
  }
  for (std::size_t i = 0; i < std::min(most, places.size()); ++i) {
    const ChangedPlace& place = places[i];
    fmt::print("  {:>5} {:>11.2f} {:>9.2f} {:>10.3g} {:>13.2f} {:>11.2f} {:>12.2f} {:>9.2g}\n", i + 1, place.center.x(),
               place.center.y(), place.area_m2, place.largest_ut, place.sigma_ut, place.scaled_sigma_ut, place.p_value);
  }
  if (places.size() > most) fmt::print("  ... {} more in places.csv\n", places.size() - most);
}

void print_figures(const MapDiffCall& call, const MagneticDifference& difference) {
  const Shares shares = shares_of(difference);
  const Vector3& at = difference.largest_at;
  fmt::print("compared {:.2f} m2, {:.1f} % of what either map covers; only {}: {:.1f} %, only {}: {:.1f} %\n",
             difference.compared_m2, 100.0 * shares.compared, call.first, 100.0 * shares.only_first, call.second,
             100.0 * shares.only_second);
  fmt::print(
      "|dB|: mean {:.3f} uT, rms {:.3f} uT, 95 % below {:.3f} uT, largest {:.3f} uT at ({:.2f}, {:.2f}, {:.2f}) m\n",
      difference.mean_ut, difference.rms_ut, difference.high_ut, difference.largest_ut, at.x(), at.y(), at.z());
  fmt::print(
      "over the maps' sigma: rms {:.2f} a component (1 where nothing changed), {:.1f} % above 3 sigma (2.9 % by "
      "chance)\n",
      difference.normalized_rms, 100.0 * difference.share_above_three_sigma);
}

void write_result(const std::filesystem::path& path, const std::string& text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

void map_diff(const MapDiffCall& call) {
  if (!(call.threshold_ut > 0.0) || !std::isfinite(call.threshold_ut)) {
    throw InputError(fmt::format("--threshold-ut: expected microtesla above 0, found {}", call.threshold_ut));
  }
  if (!(call.significance > 0.0 && call.significance < 1.0)) {
    throw InputError(
        fmt::format("--significance: expected a probability between 0 and 1, found {}", call.significance));
  }
  const MagneticMap first = read_magnetic_map(call.first);
  const MagneticMap second = read_magnetic_map(call.second);
  const MagneticDifference difference = compare_maps(first, second);
  if (difference.nodes == 0) refuse_disjoint(call, first, second);
  const DifferenceSignificance significance(difference);
  const JudgedPlaces judged = judge(changed_places(difference, significance, call.threshold_ut), call.significance);

  const std::filesystem::path out = made_folder(call.out);
  print_figures(call, difference);
  print_significance(call, significance);
  print_places(call, judged);
  write_magnetic_difference(difference, call.first, call.second, (out / "difference.yaml").string());
  write_result(out / "places.csv", to_csv(judged.reported));
  draw_difference_picture(out / "picture", difference, judged.reported,
                          fmt::format("Change of the field from {} to {}", call.first, call.second));
  write_result(out / "diff.json", to_json(call, difference, significance, judged));
  fmt::print("wrote {}/: picture.png, .pdf and .svg, difference.yaml with difference.tif, places.csv, diff.json\n",
             call.out);
}

}  // namespace

void add_map_diff(CLI::App& map, int* code) {
  const auto call = std::make_shared<MapDiffCall>();
  CLI::App* command = map.add_subcommand(
      "diff",
      "Compare two magnetic maps of one site, node by node of the first: what changed, where, beyond their sigma");
  CommandFiles files(*command);
  files.input(command->add_option("FIRST", call->first, "a magnetic map, FIELD.yaml: what was"))->required();
  files.input(command->add_option("SECOND", call->second, "another one, of any grid and resolution: what is"))
      ->required();
  files
      .output(
          command->add_option("--out", call->out,
                              "folder for picture.png, .pdf and .svg, difference.yaml and .tif, places.csv, diff.json"),
          CommandFiles::within({"picture.png", "picture.pdf", "picture.svg", "difference.yaml", "difference.tif",
                                "places.csv", "diff.json"}))
      ->required();
  command->add_option("--threshold-ut", call->threshold_ut, "places changed by more than this are listed, microtesla")
      ->capture_default_str();
  command
      ->add_option(
          "--significance", call->significance,
          "places are listed if their p-value is at most this: the probability of any false place in a pair of "
          "maps of an unchanged site")
      ->capture_default_str();
  command->footer(R"(
Examples:
  lodestone map diff spring.yaml autumn.yaml --out /tmp/change
  lodestone map diff spring.yaml autumn.yaml --out /tmp/change --threshold-ut 3)");
  command->callback([call, code]() {
    map_diff(*call);
    *code = exit_code::done;
  });
}

}  // namespace lodestone
