#include "tools/calibrate/field_change_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tools/table.h"

namespace lodestone {

namespace {

constexpr std::size_t kShownPlaces = 5;

std::string axes_of(const std::vector<int>& axes) {
  std::string text;
  for (std::size_t i = 0; i < axes.size(); ++i)
    text += std::string(i == 0 ? "" : (i + 1 == axes.size() ? " and " : ", ")) + "xyz"[axes[i]];
  return text;
}

std::string places_table(const FieldChange& change) {
  std::vector<ComparedPlace> changed;
  std::copy_if(change.places.begin(), change.places.end(), std::back_inserter(changed),
               [](const ComparedPlace& place) { return place.changed; });
  std::stable_sort(changed.begin(), changed.end(), [](const ComparedPlace& a, const ComparedPlace& b) {
    return a.difference_ut.norm() > b.difference_ut.norm();
  });
  if (changed.size() > kShownPlaces) changed.resize(kShownPlaces);
  Table table({"place: x, m", "y, m", "measured - map: x, uT", "y, uT", "z, uT", "size, uT", "sigma, uT", "p-value"});
  for (const ComparedPlace& place : changed) {
    table.add({fixed(place.centre_m.x(), 1), fixed(place.centre_m.y(), 1), fixed(place.difference_ut.x(), 1),
               fixed(place.difference_ut.y(), 1), fixed(place.difference_ut.z(), 1),
               fixed(place.difference_ut.norm(), 1), fixed(place.sigma_ut, 1), fmt::format("{:.0e}", place.p_value)});
  }
  return table.to_string();
}

}  // namespace

std::string field_change_text(const FieldChange& change) {
  if (!change.compared) return "";
  std::string text;
  if (change.everywhere) {
    const MapChange& x = change.change;
    const MapChange& s = change.sigma;
    text += fmt::format(
        "\nthe field differs from the map by {:.1f} uT (rms) common to all magnetometers: the map is stale, survey it "
        "again\n"
        "field = {:.3f} map + ({:.2f} {:.2f} {:.2f}) uT in map axes; sigmas {:.3f} and ({:.2f} {:.2f} {:.2f}) uT; "
        "p-value {:.0e}\n"
        "this change is not counted as an error of the magnetometers, and their sigmas contain its uncertainty\n",
        change.difference_ut, 1.0 + x[0], x[1], x[2], x[3], s[0], s[1], s[2], s[3], change.p_value);
  }
  if (const std::size_t changed = change.changed_places(); changed > 0) {
    text += fmt::format(
        "\n{} of {} places differ from the map by more than its error, common to all magnetometers ({:.1f} expected "
        "by chance): the map is stale there\n{}",
        changed, change.places.size(), field_change_probability * static_cast<double>(change.places.size()),
        places_table(change));
  }
  if (!change.found()) text += "\nthe magnetometers together agree with the map within its error\n";
  if (!change.like_sensors.empty()) {
    text += fmt::format(
        "this drive does not distinguish an offset of all magnetometers from a change of the field along {} of the "
        "map: {}\n",
        axes_of(change.like_sensors),
        change.everywhere ? "sigmas of the offsets contain the change" : "offsets assume the mapped field");
  }
  return text;
}

nlohmann::ordered_json field_change_json(const FieldChange& change) {
  using Json = nlohmann::ordered_json;
  const auto offset = [](const MapChange& x) { return Json{x[1], x[2], x[3]}; };
  Json json{{"map_as_a_whole", change.everywhere},       {"p_value", change.p_value},
            {"scale", 1.0 + change.change[0]},           {"scale_sigma", change.sigma[0]},
            {"offset_ut", offset(change.change)},        {"offset_sigma_ut", offset(change.sigma)},
            {"difference_rms_ut", change.difference_ut}, {"places", change.places.size()},
            {"changed_places", change.changed_places()}, {"false_alarm_probability", field_change_probability}};
  json["like_an_offset_of_all"] = Json::array();
  for (const int axis : change.like_sensors) json["like_an_offset_of_all"].push_back(std::string(1, "xyz"[axis]));
  return json;
}

std::string field_change_csv(const FieldChange& change) {
  std::string text =
      "x_m,y_m,z_m,moments,difference_x_ut,difference_y_ut,difference_z_ut,difference_ut,sigma_ut,p_value,changed\n";
  for (const ComparedPlace& place : change.places) {
    const Vector3& at = place.centre_m;
    const Vector3& d = place.difference_ut;
    text +=
        fmt::format("{:.3f},{:.3f},{:.3f},{},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.6e},{}\n", at.x(), at.y(), at.z(),
                    place.moments, d.x(), d.y(), d.z(), d.norm(), place.sigma_ut, place.p_value, place.changed ? 1 : 0);
  }
  return text;
}

}  // namespace lodestone
