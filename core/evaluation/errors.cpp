#include "core/evaluation/errors.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace lodestone {

namespace {

template <class Function>
std::vector<double> for_each_pair(const PosePairs& pairs, Function function) {
  std::vector<double> values;
  values.reserve(pairs.size());
  for (const PosePair& pair : pairs) values.push_back(function(pair));
  return values;
}

double angle_between(const Quaternion& a, const Quaternion& b) {
  return so3::log(a.conjugate() * b).norm();
}

}  // namespace

std::vector<double> translation_errors(const PosePairs& pairs) {
  return for_each_pair(pairs,
                       [](const PosePair& pair) { return (pair.estimate.position - pair.truth.position).norm(); });
}

std::vector<double> angle_errors(const PosePairs& pairs) {
  return for_each_pair(pairs,
                       [](const PosePair& pair) { return angle_between(pair.truth.rotation, pair.estimate.rotation); });
}

std::vector<double> heading_errors(const PosePairs& pairs) {
  return for_each_pair(pairs, [](const PosePair& pair) {
    const Quaternion difference = pair.estimate.rotation * pair.truth.rotation.conjugate();
    return std::remainder(2.0 * std::atan2(difference.z(), difference.w()), 2.0 * std::numbers::pi);
  });
}

std::vector<IndexPair> segments_by_count(std::size_t pose_count, std::size_t step, bool all) {
  if (step == 0) throw std::invalid_argument("segments_by_count: expected a step of at least 1");
  std::vector<IndexPair> segments;
  for (std::size_t i = 0; i + step < pose_count; i += all ? 1 : step) segments.emplace_back(i, i + step);
  return segments;
}

std::vector<IndexPair> segments_by_distance(const PosePairs& pairs, double distance, double relative_tolerance) {
  std::vector<double> path(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    path[i] = path[i - 1] + (pairs[i].estimate.position - pairs[i - 1].estimate.position).norm();
  }
  const double tolerance = distance * relative_tolerance;
  std::vector<IndexPair> segments;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    // The path length never decreases. The nearest pose is the last one below the target or the first one not below it.
    const auto after = std::lower_bound(path.begin() + static_cast<std::ptrdiff_t>(i) + 1, path.end(), distance,
                                        [&](double length, double target) { return length - path[i] < target; });
    auto best = static_cast<std::size_t>(after - path.begin());
    const auto miss = [&](std::size_t j) { return std::abs(path[j] - path[i] - distance); };
    if (best == path.size() || (best > i + 1 && miss(best - 1) <= miss(best))) --best;
    while (best > i + 1 && path[best - 1] == path[best]) --best;  // at standstill, evo uses the first of equal lengths
    if (miss(best) <= tolerance) segments.emplace_back(i, best);
  }
  return segments;
}

std::vector<Pose> relative_errors(const PosePairs& pairs, const std::vector<IndexPair>& segments) {
  std::vector<Pose> errors;
  errors.reserve(segments.size());
  for (const auto& [i, j] : segments) {
    const Pose true_motion = pairs[i].truth.inverse() * pairs[j].truth;
    const Pose estimated_motion = pairs[i].estimate.inverse() * pairs[j].estimate;
    errors.push_back(true_motion.inverse() * estimated_motion);
  }
  return errors;
}

std::vector<double> translations_of(const std::vector<Pose>& errors) {
  std::vector<double> values;
  values.reserve(errors.size());
  for (const Pose& error : errors) values.push_back(error.position.norm());
  return values;
}

std::vector<double> angles_of(const std::vector<Pose>& errors) {
  std::vector<double> values;
  values.reserve(errors.size());
  for (const Pose& error : errors) values.push_back(so3::log(error.rotation).norm());
  return values;
}

}  // namespace lodestone
