#include "estimators/baselines/continuous_time/localizability_sampling.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

// Limits of the authors' program: cos 70° and cos 30°.
constexpr double kLeastContribution = 0.34;
constexpr double kLargeContribution = 0.87;

/// Marks the points to keep for one direction. `contributions`: of each point. `score`: of the windows before.
void keep_for_direction(const std::vector<double>& contributions, double score, double least, std::vector<char>& kept) {
  double reachable = score;
  std::vector<std::size_t> large;
  for (std::size_t i = 0; i < contributions.size(); ++i) {
    if (contributions[i] < kLargeContribution) continue;
    reachable += contributions[i];
    large.push_back(i);
  }
  if (reachable < least) {
    for (std::size_t i = 0; i < contributions.size(); ++i) {
      if (contributions[i] >= kLeastContribution) kept[i] = 1;
    }
    return;
  }
  std::stable_sort(large.begin(), large.end(),
                   [&](std::size_t a, std::size_t b) { return contributions[a] > contributions[b]; });
  for (const std::size_t i : large) {
    if (score > least) return;
    kept[i] = 1;
    score += contributions[i];
  }
}

/// Both kinds of directions are treated alike. `member`: translation or rotation.
void keep_for(Vector3 ObservedDirections::*member, std::span<const ObservedDirections> points,
              const std::deque<std::vector<ObservedDirections>>& before, double least, std::vector<char>& kept) {
  Matrix3 sum = Matrix3::Zero();
  const auto add = [&](const ObservedDirections& point) { sum += point.*member * (point.*member).transpose(); };
  for (const ObservedDirections& point : points) add(point);
  for (const auto& window : before) std::for_each(window.begin(), window.end(), add);
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(sum);
  std::vector<double> contributions(points.size());
  for (int direction = 0; direction < 3; ++direction) {
    const Vector3 axis = solver.eigenvectors().col(direction);
    for (std::size_t i = 0; i < points.size(); ++i) contributions[i] = std::abs(axis.dot(points[i].*member));
    double score = 0.0;
    for (const auto& window : before) {
      for (const ObservedDirections& point : window) score += std::abs(axis.dot(point.*member));
    }
    keep_for_direction(contributions, score, least, kept);
  }
}

}  // namespace

std::vector<std::size_t> LocalizabilitySampling::sample(std::span<const ObservedDirections> points) {
  std::vector<char> marked(points.size(), 0);
  keep_for(&ObservedDirections::translation, points, before_, least_, marked);
  keep_for(&ObservedDirections::rotation, points, before_, least_, marked);
  std::vector<std::size_t> kept;
  std::vector<ObservedDirections> observed;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (marked[i] == 0) continue;
    kept.push_back(i);
    observed.push_back(points[i]);
  }
  before_.push_back(std::move(observed));
  while (before_.size() >= static_cast<std::size_t>(windows_)) before_.pop_front();
  return kept;
}

}  // namespace lodestone
