#include "frontends/simulation/magnetic_field.h"

#include <algorithm>
#include <cmath>

namespace lodestone::simulation {
namespace {

constexpr double mu0_over_4pi_ut = 0.1;      // µT·m³/(A·m²)
constexpr double negligible_ut = 5.0e-4;     // of one source
constexpr double fade_share = 0.75;          // the fading starts at this share of the reach
constexpr double cell_size = 4.0;            // m
constexpr double smallest_square = 1.0e-4;   // m², keeps a source finite within a centimetre

/// 1 at 0, 0 at 1, first and second derivative zero at both.
double fade(double t) { return 1.0 - t * t * t * (10.0 - t * (15.0 - 6.0 * t)); }

Vector3 pole_field(const Vector3& offset) {
  const double square = std::max(offset.squaredNorm(), smallest_square);
  return offset / (square * std::sqrt(square));
}

}  // namespace

Vector3 source_field_ut(const FieldSource& source, const Vector3& point) {
  const Vector3 offset = point - source.position;
  if (source.is_bar)
    return (mu0_over_4pi_ut * source.pole) * (pole_field(offset) - pole_field(point - source.south));
  const double square = std::max(offset.squaredNorm(), smallest_square);
  const double scale = mu0_over_4pi_ut / (square * std::sqrt(square));
  return (3.0 * scale * source.moment.dot(offset) / square) * offset - scale * source.moment;
}

MagneticField::MagneticField(const Vector3& earth_field_ut, std::vector<FieldSource> sources)
    : earth_(earth_field_ut), sources_(std::move(sources)) {
  if (sources_.empty()) return;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e12), high = -low;
  for (const FieldSource& source : sources_) {
    Reach reach;
    reach.center = source.is_bar ? Vector3(0.5 * (source.position + source.south)) : source.position;
    const double half_length = source.is_bar ? 0.5 * (source.position - source.south).norm() : 0.0;
    const double moment = source.is_bar ? std::abs(source.pole) * 2.0 * half_length : source.moment.norm();
    // On its axis a dipole's field is 2 μ0/4π m / r³.
    reach.start = fade_share * (half_length + std::cbrt(2.0 * mu0_over_4pi_ut * moment / negligible_ut));
    reach.end = reach.start / fade_share;
    reaches_.push_back(reach);
    low = low.cwiseMin((reach.center.head<2>().array() - reach.end).matrix());
    high = high.cwiseMax((reach.center.head<2>().array() + reach.end).matrix());
  }
  origin_ = low;
  columns_ = 1 + static_cast<int>((high.x() - low.x()) / cell_size);
  rows_ = 1 + static_cast<int>((high.y() - low.y()) / cell_size);

  std::vector<std::vector<std::uint32_t>> cells(static_cast<std::size_t>(columns_) * rows_);
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const Eigen::Vector2d center = reaches_[i].center.head<2>() - origin_;
    const double end = reaches_[i].end;
    const auto index = [&](double coordinate, int count) {
      return std::clamp(static_cast<int>(std::floor(coordinate / cell_size)), 0, count - 1);
    };
    for (int row = index(center.y() - end, rows_); row <= index(center.y() + end, rows_); ++row) {
      for (int column = index(center.x() - end, columns_); column <= index(center.x() + end, columns_); ++column) {
        const Eigen::Vector2d corner(column * cell_size, row * cell_size);
        const Eigen::Vector2d nearest = center.cwiseMax(corner).cwiseMin((corner.array() + cell_size).matrix());
        if ((nearest - center).squaredNorm() < end * end)
          cells[static_cast<std::size_t>(row) * columns_ + column].push_back(static_cast<std::uint32_t>(i));
      }
    }
  }
  for (const auto& cell : cells) {
    cell_begin_.push_back(static_cast<std::uint32_t>(cell_sources_.size()));
    cell_sources_.insert(cell_sources_.end(), cell.begin(), cell.end());
  }
  cell_begin_.push_back(static_cast<std::uint32_t>(cell_sources_.size()));
}

Vector3 MagneticField::field_ut(const Vector3& point) const {
  Vector3 field = earth_;
  const double x = (point.x() - origin_.x()) / cell_size;
  const double y = (point.y() - origin_.y()) / cell_size;
  if (!(x >= 0.0 && y >= 0.0 && x < columns_ && y < rows_)) return field;
  const std::size_t cell = static_cast<std::size_t>(y) * columns_ + static_cast<std::size_t>(x);
  for (std::uint32_t i = cell_begin_[cell]; i < cell_begin_[cell + 1]; ++i) {
    const std::uint32_t source = cell_sources_[i];
    const Reach& reach = reaches_[source];
    const double square = (point - reach.center).squaredNorm();
    if (square >= reach.end * reach.end) continue;
    if (square <= reach.start * reach.start) {
      field += source_field_ut(sources_[source], point);
    } else {
      const double share = (std::sqrt(square) - reach.start) / (reach.end - reach.start);
      field += fade(share) * source_field_ut(sources_[source], point);
    }
  }
  return field;
}

Vector3 MagneticField::field_of_all_ut(const Vector3& point) const {
  Vector3 field = earth_;
  for (const FieldSource& source : sources_) field += source_field_ut(source, point);
  return field;
}

}  // namespace lodestone::simulation
