#include "estimators/initialization/field_search.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "estimators/initialization/scan_registration.h"

namespace lodestone {

namespace {

constexpr double kStep_m = 0.15;
constexpr double kSigma_ut = 4.0;      // change of the field within half a step
constexpr double kWorstSquare = 16.0;  // limit of a reading's squared residual, sigmas²: one broken sensor must not win
constexpr double kCrowding = 3.0;      // number of readings that share one error of the map
constexpr std::size_t kScored = 3000;  // places with the best fit to the field that are also scored by the cloud map
// Largest number of places that are registered: by field and scan together, and by the field alone, because a scan may
// see only what is not on the map.
constexpr std::size_t kByBoth = 100;
constexpr std::size_t kByField = 50;
constexpr double kPlacesApart_m = 0.3;
constexpr double kPlacesApart_rad = 10.0 * std::numbers::pi / 180.0;

struct FieldFit {
  Place place;
  double field = 0.0;  ///< log-likelihood up to a constant
};

/// Heading and log-likelihood at one place. Returns false if most readings are off the map.
bool fit(const ArrayReading& array, const Quaternion& attitude, const Vector3& position, const MagneticMap& map,
         double& yaw, double& log_likelihood) {
  std::vector<Vector3> places;  // relative to the imu, level axes, yaw 0
  std::vector<Vector3> measured;
  for (const MeanReading& reading : array.readings) {
    places.push_back(attitude * reading.T_end_mag.position);
    measured.push_back((attitude * reading.T_end_mag.rotation) * reading.measured_ut);
  }
  std::vector<Vector3> fields(places.size());
  std::vector<bool> known(places.size());
  const auto look_up = [&]() {
    const Eigen::AngleAxisd turn(yaw, Vector3::UnitZ());
    std::size_t count = 0;
    for (std::size_t j = 0; j < places.size(); ++j) {
      const auto field = map.query(position + turn * places[j], FieldInterpolation::bilinear);
      known[j] = field.has_value();
      if (field) fields[j] = field->field_ut;
      count += known[j] ? 1 : 0;
    }
    return 2 * count > places.size();
  };
  const auto heading = [&]() {
    double sine = 0.0;
    double cosine = 0.0;
    for (std::size_t j = 0; j < places.size(); ++j) {
      if (!known[j]) continue;
      cosine += measured[j].head<2>().dot(fields[j].head<2>());
      sine += measured[j].x() * fields[j].y() - measured[j].y() * fields[j].x();
    }
    return std::atan2(sine, cosine);
  };
  const auto center = map.query(position, FieldInterpolation::bilinear);
  if (!center) return false;
  fields.assign(places.size(), center->field_ut);
  known.assign(places.size(), true);
  for (int round = 0; round < 3; ++round) {
    yaw = heading();
    if (!look_up()) return false;
  }
  const Eigen::AngleAxisd turn(yaw, Vector3::UnitZ());
  double sum = 0.0;
  for (std::size_t j = 0; j < places.size(); ++j) {
    const double square =
        known[j] ? (turn * measured[j] - fields[j]).squaredNorm() / (kSigma_ut * kSigma_ut) : kWorstSquare;
    sum += std::min(square, kWorstSquare);
  }
  log_likelihood = -0.5 * sum / kCrowding;
  return true;
}

void add_if_new(const Place& place, std::vector<Place>& result) {
  const bool is_near = std::any_of(result.begin(), result.end(), [&](const Place& other) {
    return other.level == place.level && (other.position_m - place.position_m).norm() < kPlacesApart_m &&
           std::abs(std::remainder(other.yaw - place.yaw, 2.0 * std::numbers::pi)) < kPlacesApart_rad;
  });
  if (!is_near) result.push_back(place);
}

}  // namespace

std::vector<Place> search_field(const ArrayReading& array, const Quaternion& attitude, double height_m,
                                const MagneticMap& map, const PlaceSearch& search,
                                std::span<const SearchPoint> points) {
  if (array.readings.empty()) return {};
  const FieldGrid& grid = map.grid();
  const int rows = static_cast<int>((grid.rows - 1) * grid.resolution_m / kStep_m) + 1;
  const int columns = static_cast<int>((grid.columns - 1) * grid.resolution_m / kStep_m) + 1;
  std::vector<FieldFit> fits;
  for (std::size_t index = 0; index < search.levels().size(); ++index) {
    const SiteLevel& level = search.levels()[index];
    std::vector<std::vector<FieldFit>> lines(static_cast<std::size_t>(rows));
    parallel_for(0, rows, [&](int row) {
      for (int column = 0; column < columns; ++column) {
        const Eigen::Vector2d place = grid.origin + kStep_m * Eigen::Vector2d(column, row);
        const int x = level.column_of(place.x());
        const int y = level.row_of(place.y());
        if (!level.contains(x, y)) continue;
        const std::size_t cell = level.index(x, y);
        if ((level.cells[cell] & SiteLevel::standable) == 0) continue;
        FieldFit found;
        found.place.level = static_cast<int>(index);
        found.place.position_m = place;
        const Vector3 position(place.x(), place.y(), static_cast<double>(level.floor_m[cell]) + height_m);
        if (fit(array, attitude, position, map, found.place.yaw, found.field))
          lines[static_cast<std::size_t>(row)].push_back(found);
      }
    });
    for (const auto& line : lines) fits.insert(fits.end(), line.begin(), line.end());
  }
  std::stable_sort(fits.begin(), fits.end(), [](const FieldFit& a, const FieldFit& b) { return a.field > b.field; });
  if (fits.size() > kScored) fits.resize(kScored);
  std::vector<Place> places;
  places.reserve(fits.size());
  for (const FieldFit& one : fits) places.push_back(one.place);
  search.score(points, places);
  // A scan counts as this number of independent points, however many it has.
  const double weight = points.empty() ? 0.0 : std::min(1.0, kIndependentPoints / static_cast<double>(points.size()));
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < fits.size(); ++i) order.emplace_back(-(fits[i].field + weight * places[i].score), i);
  std::sort(order.begin(), order.end());
  std::vector<Place> result;
  for (const auto& [cost, i] : order) {
    if (result.size() == kByBoth) break;
    add_if_new(places[i], result);
  }
  const std::size_t most = result.size() + kByField;
  for (std::size_t i = 0; i < places.size() && result.size() < most; ++i) add_if_new(places[i], result);
  return result;
}

}  // namespace lodestone
