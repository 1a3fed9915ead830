#include "core/magnetometer/difference_significance.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include "core/parallel.h"

namespace lodestone {
namespace {

const boost::math::chi_squared three_components(3.0);

/// Nodes beyond this quantile of the scaled differences may have changed. Correlations are estimated without them.
constexpr double correlation_quantile = 0.999;

/// The probability that one node that did not change has |ΔB|² over its scaled variance above `square`.
double node_tail(double square) {
  return boost::math::cdf(boost::math::complement(three_components, square));
}

/// ΔB over its stated sigma at all nodes of a piece, laid out as they are; NaN where not compared or without a sigma.
std::vector<Eigen::Vector3f> normalized(const DifferencePiece& piece) {
  std::vector<Eigen::Vector3f> result;
  result.reserve(piece.nodes.size());
  for (const Eigen::Vector4f& node : piece.nodes) {
    const float change = node.head<3>().norm();
    const bool certain = change > 0.0F && node[3] == 0.0F;  // both sigmas are 0
    if (!std::isfinite(node[3]) || certain) {
      result.push_back(Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
    } else if (change > 0.0F) {
      result.push_back(node.head<3>() * (node[3] / change));
    } else {
      result.push_back(Eigen::Vector3f::Zero());
    }
  }
  return result;
}

using NormalizedPieces = std::vector<std::vector<Eigen::Vector3f>>;

/// The median of |ΔB|² over the variance of one component; 0 without a node.
double median_square(const NormalizedPieces& pieces) {
  std::vector<float> squares;
  for (const auto& piece : pieces) {
    for (const Eigen::Vector3f& node : piece) {
      if (std::isfinite(node.x())) squares.push_back(node.squaredNorm());
    }
  }
  if (squares.empty()) return 0.0;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return *middle;
}

struct Lag {
  int rows, columns;
};

/// 1 − ρ at one lag: half of the squared differences over the variance (the variogram). NaN without a pair that varies.
/// Pairs lie within one piece.
double decorrelation(const MagneticDifference& difference, const NormalizedPieces& values, Lag lag,
                     double largest_square) {
  struct Sums {
    double differences = 0.0, squares = 0.0;
  };
  std::vector<Sums> sums(values.size());
  const int layers = static_cast<int>(difference.grid.heights_m.size());
  parallel_for(std::size_t{0}, values.size(), [&](std::size_t i) {
    const DifferencePiece& piece = difference.pieces[i];
    for (int line = 0; line < layers * piece.rows; ++line) {
      if (line % piece.rows + lag.rows >= piece.rows) continue;
      const Eigen::Vector3f* here = values[i].data() + static_cast<std::ptrdiff_t>(line) * piece.columns;
      const Eigen::Vector3f* there = here + static_cast<std::ptrdiff_t>(lag.rows) * piece.columns + lag.columns;
      for (int column = 0; column + lag.columns < piece.columns; ++column, ++here, ++there) {
        const double a = here->squaredNorm();
        const double b = there->squaredNorm();
        if (!(std::max(a, b) <= largest_square) || !std::isfinite(a + b)) continue;
        sums[i].differences += (*here - *there).squaredNorm();
        sums[i].squares += a + b;
      }
    }
  });
  Sums all;
  for (const Sums& one : sums) {
    all.differences += one.differences;
    all.squares += one.squares;
  }
  return all.squares > 0.0 ? all.differences / all.squares : std::numeric_limits<double>::quiet_NaN();
}

/// Nodes, edges along x and y, and squares of the lattice of compared nodes, all layers.
struct Lattice {
  std::int64_t nodes = 0, edges_x = 0, edges_y = 0, squares = 0;
};

Lattice lattice_of(const MagneticDifference& difference) {
  std::map<std::pair<int, int>, const DifferencePiece*> by_corner;
  for (const DifferencePiece& piece : difference.pieces) by_corner[{piece.row, piece.column}] = &piece;
  Lattice result;
  for (const DifferencePiece& piece : difference.pieces) {
    const auto at_corner = [&](int row, int column) {
      const auto found = by_corner.find({row, column});
      return found == by_corner.end() ? nullptr : found->second;
    };
    const DifferencePiece* around[2][2] = {{&piece, at_corner(piece.row, piece.column + piece.columns)},
                                           {at_corner(piece.row + piece.rows, piece.column),
                                            at_corner(piece.row + piece.rows, piece.column + piece.columns)}};
    for (int layer = 0; layer < static_cast<int>(difference.grid.heights_m.size()); ++layer) {
      const auto compared = [&](int row, int column) {
        const bool up = row >= piece.rows;
        const bool right = column >= piece.columns;
        const DifferencePiece* owner = around[up][right];
        return owner != nullptr && std::isfinite(owner->at(layer, up ? 0 : row, right ? 0 : column)[3]);
      };
      for (int row = 0; row < piece.rows; ++row) {
        for (int column = 0; column < piece.columns; ++column) {
          if (!compared(row, column)) continue;
          const bool right = compared(row, column + 1);
          const bool up = compared(row + 1, column);
          ++result.nodes;
          result.edges_x += right;
          result.edges_y += up;
          result.squares += right && up && compared(row + 1, column + 1);
        }
      }
    }
  }
  return result;
}

}  // namespace

DifferenceSignificance::DifferenceSignificance(const MagneticDifference& difference) {
  NormalizedPieces values(difference.pieces.size());
  parallel_for(std::size_t{0}, values.size(), [&](std::size_t i) { values[i] = normalized(difference.pieces[i]); });
  const double chi_median = boost::math::median(three_components);
  median_ratio_ = std::sqrt(median_square(values) / chi_median);
  const double scale_square = sigma_scale() * sigma_scale();
  const double largest_square = scale_square * boost::math::quantile(three_components, correlation_quantile);

  const Lattice lattice = lattice_of(difference);
  nodes_ = lattice.nodes;
  const auto layers = static_cast<double>(difference.grid.heights_m.size());
  // 1 − ρ(h) = λ h² / 2 for small h, with λ the variance of the slope of one normalized component.
  const double slope_x = std::sqrt(2.0 * decorrelation(difference, values, {0, 1}, largest_square));
  const double slope_y = std::sqrt(2.0 * decorrelation(difference, values, {1, 0}, largest_square));
  smooth_ = slope_x > 0.0 && slope_y > 0.0;
  if (!smooth_) return;
  correlation_length_m_ = difference.grid.resolution_m / std::sqrt(slope_x * slope_y);
  volumes_[0] =
      std::max(layers, static_cast<double>(lattice.nodes - lattice.edges_x - lattice.edges_y + lattice.squares));
  volumes_[1] = static_cast<double>(lattice.edges_x - lattice.squares) * slope_x +
                static_cast<double>(lattice.edges_y - lattice.squares) * slope_y;
  volumes_[2] = static_cast<double>(lattice.squares) * slope_x * slope_y;
}

// Worsley (1994), corollary 3.6, for three degrees of freedom in two dimensions.
double DifferenceSignificance::field_tail(double square) const {
  const double decay = std::exp(-0.5 * square) / std::numbers::pi;
  const double line = square * decay;
  const double plane = std::sqrt(square / (2.0 * std::numbers::pi)) * (square - 2.0) * decay;
  return volumes_[0] * node_tail(square) + volumes_[1] * line + volumes_[2] * plane;
}

double DifferenceSignificance::p_value(double stated_sigmas) const {
  if (std::isinf(stated_sigmas)) return 0.0;
  const double square = std::pow(stated_sigmas / sigma_scale(), 2);
  // The term of the area, √u (u − 2) exp(−u/2), falls only beyond u = (5 + √17) / 2.
  const double falling = 0.5 * (5.0 + std::sqrt(17.0));
  const double bonferroni = static_cast<double>(nodes_) * node_tail(square);
  return std::min({1.0, bonferroni, smooth_ && square > falling ? field_tail(square) : 1.0});
}

double DifferenceSignificance::critical_sigmas(double level) const {
  double low = 0.0;
  double high = sigma_scale();
  while (p_value(high) > level) high *= 2.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (p_value(middle) > level ? low : high) = middle;
  }
  return high / sigma_scale();
}

double DifferenceSignificance::independent_places(double level) const {
  const double critical = critical_sigmas(level);
  return std::max(1.0, level / node_tail(critical * critical));
}

}  // namespace lodestone
