#include "estimators/initialization/place_search.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <queue>
#include <tuple>

#include "core/parallel.h"

namespace lodestone {

namespace {

constexpr double kHitAtPlace = 0.8;           // share of a scan that is explained at its true place
constexpr double kLeastShare = 0.6;           // of the best score: worse places are discarded
constexpr std::size_t kScanCandidates = 250;  // largest number of places that are registered
constexpr double kApart_m = 0.5;
constexpr double kApart_rad = 5.0 * std::numbers::pi / 180.0;
constexpr std::size_t kBatch = 256;  // number of blocks divided together

struct Offset {
  std::int32_t column;
  std::int32_t row;
};

std::vector<Offset> turned(std::span<const SearchPoint> points, double yaw, double cell_m) {
  const float cosine = static_cast<float>(std::cos(yaw) / cell_m);
  const float sine = static_cast<float>(std::sin(yaw) / cell_m);
  std::vector<Offset> result;
  result.reserve(points.size());
  for (const SearchPoint& point : points) {
    const float x = cosine * point.offset_m.x() - sine * point.offset_m.y();
    const float y = sine * point.offset_m.x() + cosine * point.offset_m.y();
    // The robot stands in the middle of a cell.
    result.push_back(
        {static_cast<std::int32_t>(std::floor(x + 0.5F)), static_cast<std::int32_t>(std::floor(y + 0.5F))});
  }
  return result;
}

/// Weights of hits on one level: rare heights count more than a ceiling that is everywhere.
struct Weights {
  std::vector<float> hit;  ///< of each point, relative to a miss
  float all_missed = 0.0F;
};

Weights weigh(std::span<const SearchPoint> points, const std::vector<std::uint32_t>& site) {
  std::map<std::uint32_t, std::pair<float, float>> known;
  Weights weights;
  double missed = 0.0;
  for (const SearchPoint& point : points) {
    const auto [entry, is_new] = known.try_emplace(point.bands);
    if (is_new) {
      const auto hits =
          std::count_if(site.begin(), site.end(), [&](std::uint32_t bits) { return (bits & point.bands) != 0; });
      const double share = (static_cast<double>(hits) + 1.0) / (static_cast<double>(site.size()) + 2.0);
      const double miss = std::min(0.0, std::log((1.0 - kHitAtPlace) / (1.0 - share)));
      const double hit = std::max(0.0, std::log(kHitAtPlace / share));
      entry->second = {static_cast<float>(hit - miss), static_cast<float>(miss)};
    }
    weights.hit.push_back(entry->second.first);
    missed += static_cast<double>(entry->second.second);
  }
  weights.all_missed = static_cast<float>(missed);
  return weights;
}

float bound_of(std::span<const SearchPoint> points, std::span<const Offset> offsets, const Weights& weights,
               const LevelPyramid& pyramid, int k, int column, int row) {
  float sum = weights.all_missed;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if ((pyramid.window(k, column + offsets[i].column, row + offsets[i].row) & points[i].bands) != 0)
      sum += weights.hit[i];
  }
  return sum;
}

struct Block {
  float bound;
  int k;  ///< 2^k cells per side
  int level;
  int yaw;
  int row;
  int column;

  bool operator<(const Block& other) const {  // of two equal blocks, the smaller is on top
    return std::tie(bound, other.k, other.level, other.yaw, other.row, other.column) <
           std::tie(other.bound, k, level, yaw, row, column);
  }
};

}  // namespace

PlaceSearch::PlaceSearch(std::vector<SiteLevel> levels, const PlaceSearchOptions& options, int headings)
    : levels_(std::move(levels)), options_(options), headings_(headings) {
  for (const SiteLevel& level : levels_) {
    pyramids_.emplace_back(level, depth);
    std::vector<std::uint32_t> site;
    for (const std::uint32_t bits : level.cells) {
      if (bits != 0) site.push_back(bits);
    }
    sites_.push_back(std::move(site));
  }
}

double PlaceSearch::bound(std::span<const SearchPoint> points, int level, int k, int column, int row,
                          double yaw) const {
  const auto index = static_cast<std::size_t>(level);
  return static_cast<double>(bound_of(points, turned(points, yaw, levels_[index].cell_m), weigh(points, sites_[index]),
                                      pyramids_[index], k, column, row));
}

void PlaceSearch::score(std::span<const SearchPoint> points, std::span<Place> places) const {
  std::vector<Weights> weights;
  for (const std::vector<std::uint32_t>& site : sites_) weights.push_back(weigh(points, site));
  parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) {
    Place& place = places[i];
    const auto index = static_cast<std::size_t>(place.level);
    const SiteLevel& level = levels_[index];
    place.score =
        static_cast<double>(bound_of(points, turned(points, place.yaw, level.cell_m), weights[index], pyramids_[index],
                                     0, level.column_of(place.position_m.x()), level.row_of(place.position_m.y())));
  });
}

PlaceSearchResult PlaceSearch::best(std::span<const SearchPoint> points) const {
  PlaceSearchResult result;
  if (levels_.empty() || points.empty()) return result;
  const auto yaw_of = [&](int heading) { return 2.0 * std::numbers::pi * heading / headings_; };
  std::vector<std::vector<Offset>> offsets(static_cast<std::size_t>(headings_));
  for (int i = 0; i < headings_; ++i)
    offsets[static_cast<std::size_t>(i)] = turned(points, yaw_of(i), levels_.front().cell_m);
  std::vector<Weights> weights;
  for (const std::vector<std::uint32_t>& site : sites_) weights.push_back(weigh(points, site));

  std::priority_queue<Block> open;
  std::vector<Block> fresh;
  std::int64_t nodes = 0;
  const auto add_if_standable = [&](int level, int k, int yaw, int row, int column) {
    if ((pyramids_[static_cast<std::size_t>(level)].window(k, column, row) & SiteLevel::standable) == 0) return;
    fresh.push_back({0.0F, k, level, yaw, row, column});
  };
  const auto judge_fresh = [&]() {
    parallel_for(std::size_t{0}, fresh.size(), [&](std::size_t i) {
      Block& block = fresh[i];
      const auto level = static_cast<std::size_t>(block.level);
      block.bound = bound_of(points, offsets[static_cast<std::size_t>(block.yaw)], weights[level], pyramids_[level],
                             block.k, block.column, block.row);
    });
    nodes += static_cast<std::int64_t>(fresh.size());
    for (const Block& block : fresh) open.push(block);
    fresh.clear();
  };
  for (int level = 0; level < static_cast<int>(levels_.size()); ++level) {
    const SiteLevel& site = levels_[static_cast<std::size_t>(level)];
    for (int yaw = 0; yaw < headings_; ++yaw) {
      for (int row = 0; row < site.rows; row += 1 << depth) {
        for (int column = 0; column < site.columns; column += 1 << depth)
          add_if_standable(level, depth, yaw, row, column);
      }
    }
  }
  judge_fresh();

  const auto is_near = [&](const Place& a, const Place& b) {
    return a.level == b.level && (a.position_m - b.position_m).norm() < kApart_m &&
           std::abs(std::remainder(a.yaw - b.yaw, 2.0 * std::numbers::pi)) < kApart_rad;
  };
  while (!open.empty() && result.places.size() < kScanCandidates) {
    const Block top = open.top();
    const double best = result.places.empty() ? static_cast<double>(top.bound) : result.places.front().score;
    if (best <= 0.0 || static_cast<double>(top.bound) < kLeastShare * best) break;
    if (top.k == 0) {
      open.pop();
      const SiteLevel& site = levels_[static_cast<std::size_t>(top.level)];
      const Place place{top.level, site.center(top.column, top.row), yaw_of(top.yaw), static_cast<double>(top.bound)};
      if (std::none_of(result.places.begin(), result.places.end(),
                       [&](const Place& other) { return is_near(place, other); })) {
        result.places.push_back(place);
      }
      continue;
    }
    if (nodes >= options_.max_nodes) {
      result.complete = false;
      break;
    }
    for (std::size_t taken = 0; taken < kBatch && !open.empty() && open.top().k > 0; ++taken) {
      const Block block = open.top();
      open.pop();
      const int half = 1 << (block.k - 1);
      for (const auto& [right, up] : {std::pair{0, 0}, {half, 0}, {0, half}, {half, half}}) {
        add_if_standable(block.level, block.k - 1, block.yaw, block.row + up, block.column + right);
      }
    }
    judge_fresh();
  }
  return result;
}

}  // namespace lodestone
