#include "core/lidar/plane_thickness.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

namespace lodestone {

namespace {

constexpr double kStandardDeviations = 3.0;

/// Bins by the upper half of a float's bits: positive floats have the order of their bits.
constexpr int kThicknessBits = 16;
constexpr std::size_t kThicknessBins = std::size_t{1} << (31 - kThicknessBits);
constexpr std::size_t kThicknessBinsAnOctave = std::size_t{1} << (23 - kThicknessBits);

/// Between 1.3 (as the limit relative to the median) and 2, where a map is too uneven to tell noise from clutter
/// (docs/design/067).
constexpr double kLeastOverMode = 1.3;
constexpr double kMostOverMode = 2.0;

/// One standard deviation below the median, and below the mode if half of all values were below it.
constexpr double kLowShare = 0.159;

std::size_t thickness_bin(float thickness) {
  return std::bit_cast<std::uint32_t>(std::max(thickness, 0.0F)) >> kThicknessBits;
}

double middle_of_bin_m(std::size_t bin) {
  constexpr std::uint32_t kHalf = 1U << (kThicknessBits - 1);
  return std::bit_cast<float>(static_cast<std::uint32_t>(bin) << kThicknessBits | kHalf);
}

/// The bin with the largest density for each metre. A triangle of a fifth of the thickness to both sides smooths.
std::size_t most_frequent_bin(const std::vector<std::int64_t>& counts) {
  constexpr std::size_t kWidth = kThicknessBinsAnOctave / 4;
  constexpr double kThinnest_m = 1e-4;  // thinner planes are exact: no noise to be found
  std::size_t mode = 0;
  double most = 0.0;
  for (std::size_t bin = thickness_bin(static_cast<float>(kThinnest_m)); bin + kWidth < kThicknessBins; ++bin) {
    std::int64_t sum = 0;
    for (std::size_t k = 0; k <= 2 * kWidth; ++k) {
      sum += static_cast<std::int64_t>(std::min(k, 2 * kWidth - k) + 1) * counts[bin + k - kWidth];
    }
    const double density = static_cast<double>(sum) / middle_of_bin_m(bin);
    if (density > most) {
      most = density;
      mode = bin;
    }
  }
  return mode;
}

/// Counts the thickness of planes in bins of 0.8 % or less. Sums of integers do not depend on the order.
class ThicknessCounts {
 public:
  void add(const Plane& plane) {
    ++counts_[thickness_bin(plane.thickness)];
    ++planes_;
    // The logarithm of a standard deviation with n − 3 degrees of freedom has a variance of 1 / (2 (n − 3)).
    chance_millionths_ += std::llround(0.5e6 / std::max(1.0, static_cast<double>(plane.count) - 3.0));
  }

  /// Largest thickness, m, that the noise of most planes explains: the most frequent thickness times three standard
  /// deviations of the thickness below it, between 1.3 and 2 times. 0 without planes.
  double noise_limit_m() const {
    const std::size_t mode = most_frequent_bin(counts_);
    if (mode == 0) return 0.0;
    const std::int64_t thinner =
        std::accumulate(counts_.begin(), counts_.begin() + static_cast<std::ptrdiff_t>(mode) + 1, std::int64_t{0});
    const double mode_m = middle_of_bin_m(mode);
    const auto low_rank = static_cast<std::int64_t>(2.0 * kLowShare * static_cast<double>(thinner));
    const double log_spread = std::log(mode_m / below(mode_m, of_rank(low_rank)));
    return mode_m * std::clamp(std::exp(kStandardDeviations * log_spread), kLeastOverMode, kMostOverMode);
  }

  /// Median and lower rank, with the spread by chance subtracted.
  PlaneThickness thickness(double noise_limit_m) const {
    if (planes_ == 0) return {0.0, 0.0, noise_limit_m};
    const double median_m = of_rank(planes_ / 2);
    const double low_m = of_rank(static_cast<std::int64_t>(kLowShare * static_cast<double>(planes_)));
    return {median_m, below(median_m, low_m), noise_limit_m};
  }

 private:
  double of_rank(std::int64_t rank) const {
    for (std::size_t bin = 0; bin < kThicknessBins; ++bin) {
      rank -= counts_[bin];
      if (rank < 0) return middle_of_bin_m(bin);
    }
    return 0.0;
  }

  /// `low_m`, moved towards `high_m` by what chance explains of their distance: each plane has few points.
  double below(double high_m, double low_m) const {
    if (!(low_m > 0.0)) return low_m;
    const double chance = 1e-6 * static_cast<double>(chance_millionths_) / static_cast<double>(planes_);
    const double uneven = std::max(0.0, std::pow(std::log(high_m / low_m), 2) - chance);
    return high_m * std::exp(-std::sqrt(uneven));
  }

  std::vector<std::int64_t> counts_ = std::vector<std::int64_t>(kThicknessBins, 0);
  std::int64_t planes_ = 0;
  std::int64_t chance_millionths_ = 0;
};

/// Whether a voxel holds a plane by the limits that do not depend on the map's other planes.
bool allowed_alone(const VoxelPlane& voxel, const PlaneFitOptions& fit, double noise_limit_m) {
  return voxel.is_flat != 0 &&
         (static_cast<double>(voxel.plane.thickness) <= noise_limit_m || within_limits(voxel.plane, fit));
}

}  // namespace

double PlaneThickness::log_spread() const {
  return low_m > 0.0 ? std::log(median_m / low_m) : 0.0;
}

PlaneLimits::PlaneLimits(const PlaneThickness& thickness, const PlaneMapOptions& options)
    : fit_(options.fit),
      noise_limit_m_(thickness.noise_limit_m),
      relative_limit_m_(std::numeric_limits<double>::infinity()) {
  if (!(options.max_thickness_over_median > 0.0)) return;
  relative_limit_m_ = thickness.median_m * std::max(options.max_thickness_over_median,
                                                    std::exp(kStandardDeviations * thickness.log_spread()));
}

bool PlaneLimits::allow(const VoxelPlane& voxel) const {
  return static_cast<double>(voxel.plane.thickness) <= relative_limit_m_ && allowed_alone(voxel, fit_, noise_limit_m_);
}

PlaneThickness thickness_of(const std::function<void(const VoxelPlaneVisitor&)>& for_each,
                            const PlaneMapOptions& options) {
  ThicknessCounts flat;
  for_each([&flat](const VoxelPlane& voxel) {
    if (voxel.is_flat != 0) flat.add(voxel.plane);
  });
  const double noise_limit_m = flat.noise_limit_m();
  ThicknessCounts planes;
  for_each([&](const VoxelPlane& voxel) {
    if (allowed_alone(voxel, options.fit, noise_limit_m)) planes.add(voxel.plane);
  });
  return planes.thickness(noise_limit_m);
}

Plane with_shared_thickness(Plane plane, const PlaneThickness& thickness) {
  constexpr double kMostPriorPoints = 30.0;  // docs/design/001-voxel-planes.md
  // The logarithm of a variance of ν degrees of freedom has a variance of about 2 / ν.
  const double variance_of_log = std::pow(2.0 * thickness.log_spread(), 2);
  const double prior = variance_of_log > 0.0 ? std::min(kMostPriorPoints, 2.0 / variance_of_log) : kMostPriorPoints;
  const double own = static_cast<double>(plane.count) - 3.0;
  const double squared = std::pow(static_cast<double>(plane.thickness), 2);
  if (own <= 0.0 || squared <= 0.0) return plane;
  const auto factor = static_cast<float>((prior * std::pow(thickness.median_m, 2) / squared + own) / (prior + own));
  plane.offset_variance *= factor;
  plane.major_tilt_variance *= factor;
  plane.minor_tilt_variance *= factor;
  return plane;
}

}  // namespace lodestone
