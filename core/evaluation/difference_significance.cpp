#include "core/evaluation/difference_significance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "core/evaluation/stale_map.h"
#include "core/middle_value.h"

namespace lodestone {
namespace {

double middle_or_zero(std::vector<float> values) {
  return values.empty() ? 0.0 : middle_value(std::move(values));
}

/// The nodes of a difference by layer, row and column of its grid.
class NodeLookup {
 public:
  explicit NodeLookup(const MagneticDifference& difference) {
    for (const DifferencePiece& piece : difference.pieces) pieces_[{piece.row, piece.column}] = &piece;
  }

  /// The node of this row and column of the piece, or of the next piece above or to the right; null where nothing was
  /// compared.
  const Eigen::Vector4f* at(const DifferencePiece& piece, int layer, int row, int column) const {
    const DifferencePiece* there = &piece;
    if (row >= piece.rows || column >= piece.columns) {
      const auto found = pieces_.find({piece.row + (row >= piece.rows ? piece.rows : 0),
                                       piece.column + (column >= piece.columns ? piece.columns : 0)});
      if (found == pieces_.end()) return nullptr;
      there = found->second;
      row -= row >= piece.rows ? piece.rows : 0;
      column -= column >= piece.columns ? piece.columns : 0;
    }
    if (row >= there->rows || column >= there->columns) return nullptr;
    const Eigen::Vector4f& node = there->at(layer, row, column);
    return std::isfinite(node[3]) ? &node : nullptr;
  }

 private:
  std::map<std::pair<int, int>, const DifferencePiece*> pieces_;  ///< by their lower left node
};

constexpr double exact_change = 1e6;            // χ² of a change between maps without errors
constexpr double normal_median = 0.6745;        // of |x|, x normal
constexpr double chi_square_median_1 = 0.4549;  // of x²

}  // namespace

double DifferenceSignificance::chi_square(const Eigen::Vector4f& node) const {
  if (!(node[3] > 0.0F)) return node.head<3>().norm() > 0.0F ? exact_change : 0.0;
  const Vector3 change = node.head<3>().cast<double>() - common_ut;
  return (change.cwiseQuotient(scale) / static_cast<double>(node[3])).squaredNorm();
}

double DifferenceSignificance::p_value(double chi_square) const {
  if (!(chi_square > 0.0)) return 1.0;
  // Densities of the Euler characteristic of a χ² field with n = 3 in 0, 1 and 2 dimensions, for unit roughness
  // (Worsley 1994, theorem 3.5).
  const double pi = std::numbers::pi;
  const double gamma = std::sqrt(pi / 2.0);  // 2^((n−2)/2) Γ(n/2)
  const double tail = chi_square_tail(chi_square);
  const double decay = std::exp(-0.5 * chi_square) / gamma;
  const double by_length = chi_square * decay / std::sqrt(2.0 * pi);
  const double by_area = std::sqrt(chi_square) * decay * (chi_square - 2.0) / (2.0 * pi);
  // Below its maximum, the expectation is not a probability.
  if (chi_square < 6.0) return 1.0;
  const double expected = std::max(1.0, regions) * tail + half_edge * by_length + area * by_area;
  return std::min({1.0, expected, std::max(1.0, nodes) * tail});
}

double DifferenceSignificance::critical(double probability) const {
  double low = 0.0;
  double high = 1000.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (p_value(middle) > probability ? low : high) = middle;
  }
  return high;
}

DifferenceSignificance significance_of(const MagneticDifference& difference) {
  DifferenceSignificance result;
  const int layers = static_cast<int>(difference.grid.heights_m.size());
  const auto for_each_node = [&](auto&& visit) {
    for (const DifferencePiece& piece : difference.pieces) {
      for (const Eigen::Vector4f& node : piece.nodes) {
        if (std::isfinite(node[3]) && node[3] > 0.0F) visit(node);
      }
    }
  };
  Vector3 spread = Vector3::Zero();  // of most nodes over σ
  for (int k = 0; k < 3; ++k) {
    std::vector<float> values;
    for_each_node([&](const Eigen::Vector4f& node) { values.push_back(node[k]); });
    result.common_ut[k] = middle_or_zero(std::move(values));
    values = {};
    for_each_node([&](const Eigen::Vector4f& node) {
      values.push_back(std::abs(node[k] - static_cast<float>(result.common_ut[k])) / node[3]);
    });
    spread[k] = middle_or_zero(std::move(values)) / normal_median;
  }
  // Roughness: variance of the slope of a component of unit variance, from differences between neighbours; the median
  // ignores steel that moved.
  std::array<std::vector<float>, 3> steps;
  double edges = 0.0, faces = 0.0;
  const NodeLookup lookup(difference);
  for (const DifferencePiece& piece : difference.pieces) {
    for (int layer = 0; layer < layers; ++layer) {
      for (int row = 0; row < piece.rows; ++row) {
        for (int column = 0; column < piece.columns; ++column) {
          const Eigen::Vector4f* here = lookup.at(piece, layer, row, column);
          if (here == nullptr) continue;
          const Eigen::Vector4f* right = lookup.at(piece, layer, row, column + 1);
          const Eigen::Vector4f* above = lookup.at(piece, layer, row + 1, column);
          const bool face =
              right != nullptr && above != nullptr && lookup.at(piece, layer, row + 1, column + 1) != nullptr;
          result.nodes += 1.0;
          faces += face;
          for (const Eigen::Vector4f* other : {right, above}) {
            if (other == nullptr) continue;
            edges += 1.0;
            if (!((*here)[3] > 0.0F) || !((*other)[3] > 0.0F)) continue;
            for (int k = 0; k < 3; ++k) {
              const auto common = static_cast<float>(result.common_ut[k]);
              const float step = ((*here)[k] - common) / (*here)[3] - ((*other)[k] - common) / (*other)[3];
              steps[static_cast<std::size_t>(k)].push_back(step * step);
            }
          }
        }
      }
    }
  }
  // Intrinsic volumes of the lattice of compared nodes (Worsley et al. 1996, Human Brain Mapping 4, pages 58-73).
  double roughness = 0.0;  // over squared node spacings
  for (int k = 0; k < 3; ++k) {
    if (!(spread[k] > 0.0)) continue;
    roughness += middle_or_zero(std::move(steps[static_cast<std::size_t>(k)])) /
                 (chi_square_median_1 * spread[k] * spread[k]) / 3.0;
  }
  // A spread above the stated sigma counts if it exceeds two of its own standard errors: 1.17 / √(2 N), N patches.
  const double patches = std::max(1.0, faces * roughness / (2.0 * std::numbers::pi));
  const double beyond_chance = 1.0 + 2.0 * 1.17 / std::sqrt(2.0 * patches);
  for (int k = 0; k < 3; ++k) {
    const double stated = difference.sigma_shares[k];
    result.scale[k] = spread[k] > beyond_chance * stated ? spread[k] : stated;
  }
  result.regions = result.nodes - edges + faces;
  result.half_edge = (edges - 2.0 * faces) * std::sqrt(roughness);
  result.area = faces * roughness;
  return result;
}

}  // namespace lodestone
