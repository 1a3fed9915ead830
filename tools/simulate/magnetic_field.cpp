#include "tools/simulate/magnetic_field.h"

#include <tbb/concurrent_unordered_map.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/bit_mix.h"

namespace lodestone::simulation {
namespace {

constexpr double mu0_over_4pi_ut = 0.1;     // µT·m³/(A·m²)
constexpr double smallest_square = 1.0e-4;  // m², keeps the field finite within a centimetre of a source

const Vector3 cell_size(2.5, 2.5, 0.5);  // m: robots move in a plane
constexpr double near_distance = 6.0;    // m from a cell's centre; nearer steel is summed exactly

/// Interpolation at Chebyshev nodes over [-1, 1]. The nearest far source is about 5 half-widths away: five nodes leave
/// an error of 1e-5 of the far field, and so do three nodes in the flat direction.
template <int count>
struct Chebyshev {
  static double node(int i) { return std::cos(std::numbers::pi * (i + 0.5) / count); }

  /// Values of the Lagrange polynomials at x, barycentric form.
  static std::array<double, count> weights(double x) {
    std::array<double, count> result;
    double sum = 0.0;
    for (int i = 0; i < count; ++i) {
      const double difference = x - node(i);
      if (std::abs(difference) < 1e-14) {
        result.fill(0.0);
        result[i] = 1.0;
        return result;
      }
      const double sign = i % 2 == 0 ? 1.0 : -1.0;
      result[i] = sign * std::sin(std::numbers::pi * (i + 0.5) / count) / difference;
      sum += result[i];
    }
    for (double& value : result) value /= sum;
    return result;
  }
};

using Horizontal = Chebyshev<5>;
using Vertical = Chebyshev<3>;

Vector3 pole_field(const Vector3& offset) {
  const double square = std::max(offset.squaredNorm(), smallest_square);
  return offset / (square * std::sqrt(square));
}

}  // namespace

Vector3 source_field_ut(const FieldSource& source, const Vector3& point) {
  const Vector3 offset = point - source.position;
  if (source.is_bar) return (mu0_over_4pi_ut * source.pole) * (pole_field(offset) - pole_field(point - source.south));
  const double square = std::max(offset.squaredNorm(), smallest_square);
  const double scale = mu0_over_4pi_ut / (square * std::sqrt(square));
  return (3.0 * scale * source.moment.dot(offset) / square) * offset - scale * source.moment;
}

struct MagneticField::Cell {
  std::vector<FieldSource> near;
  std::array<Vector3, 5 * 5 * 3> far;  ///< at the nodes, x fastest
};

struct MagneticField::Cells {
  struct Hash {
    std::size_t operator()(const std::array<int, 3>& index) const {
      std::uint64_t hash = 0;
      for (const int part : index) hash = mix(hash + static_cast<std::uint32_t>(part) + 0x9e3779b97f4a7c15ULL);
      return hash;
    }
  };
  tbb::concurrent_unordered_map<std::array<int, 3>, std::shared_ptr<const Cell>, Hash> map;
};

MagneticField::MagneticField(const Vector3& earth_field_ut, std::vector<FieldSource> sources)
    : earth_(earth_field_ut), sources_(std::move(sources)), cells_(std::make_unique<Cells>()) {}

MagneticField::~MagneticField() = default;

std::shared_ptr<const MagneticField::Cell> MagneticField::make_cell(const Eigen::Vector3i& index) const {
  const Vector3 center = (index.cast<double>().array() + 0.5).matrix().cwiseProduct(cell_size);
  const auto is_near = [&](const Vector3& place) {
    return (place - center).squaredNorm() < near_distance * near_distance;
  };
  auto cell = std::make_shared<Cell>();
  std::vector<const FieldSource*> far;
  for (const FieldSource& source : sources_) {
    if (is_near(source.position) || (source.is_bar && is_near(source.south))) {
      cell->near.push_back(source);
    } else {
      far.push_back(&source);
    }
  }
  std::size_t node = 0;
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 5; ++j) {
      for (int i = 0; i < 5; ++i, ++node) {
        const Vector3 share(Horizontal::node(i), Horizontal::node(j), Vertical::node(k));
        const Vector3 place = center + 0.5 * share.cwiseProduct(cell_size);
        cell->far[node] = earth_;
        for (const FieldSource* source : far) cell->far[node] += source_field_ut(*source, place);
      }
    }
  }
  return cell;
}

Vector3 MagneticField::field_ut(const Vector3& point) const {
  const Vector3 scaled = point.cwiseQuotient(cell_size);
  const Eigen::Vector3i index = scaled.array().floor().cast<int>();
  const std::array<int, 3> key{index.x(), index.y(), index.z()};
  auto found = cells_->map.find(key);
  // Two threads may compute the same cell with the same bits; the first insertion is kept.
  if (found == cells_->map.end()) found = cells_->map.emplace(key, make_cell(index)).first;
  const Cell& cell = *found->second;

  const Vector3 share = 2.0 * (scaled - index.cast<double>()).array() - 1.0;
  const auto x = Horizontal::weights(share.x()), y = Horizontal::weights(share.y());
  const auto z = Vertical::weights(share.z());
  Vector3 field = Vector3::Zero();
  std::size_t node = 0;
  for (int k = 0; k < 3; ++k)
    for (int j = 0; j < 5; ++j)
      for (int i = 0; i < 5; ++i, ++node) field += (x[i] * y[j] * z[k]) * cell.far[node];
  for (const FieldSource& source : cell.near) field += source_field_ut(source, point);
  return field;
}

Vector3 MagneticField::field_of_all_ut(const Vector3& point) const {
  Vector3 field = earth_;
  for (const FieldSource& source : sources_) field += source_field_ut(source, point);
  return field;
}

}  // namespace lodestone::simulation
