#include "core/lidar/map_error_moments.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace lodestone {

namespace {

using Matrix3x6 = Eigen::Matrix<double, 3, 6>;

constexpr std::size_t kFewestCommon = 4;

/// Upper limits of the distance of two cells, m, in the rows from the third.
constexpr std::array<double, kMapErrorMoments - 3> kDistances_m{15.0, 30.0, 60.0};

int row_of(double squared_distance_m2) {
  int row = 2;
  for (const double limit_m : kDistances_m) row += squared_distance_m2 > limit_m * limit_m ? 1 : 0;
  return row;
}

/// One part of the displacement d in two scans. The fitted pose absorbs c = inverse Σ coupling d.
struct Part {
  std::vector<Matrix3x6> place_with_b;  // at each cell of a: Cov(d, c_b); of cubes: Σ gain Cov(d, c_b)
  std::vector<Matrix6x3> a_with_place;  // at each cell of b: Cov(c_a, d); of cubes: Σ Cov(c_a, d) gain
  Matrix6 a_with_b = Matrix6::Zero();   // Cov(c_a, c_b)
};

/// Pairs of the same key in two sorted lists.
template <typename Visit>
void for_each_common(const std::vector<PlaceOffset>& a, const std::vector<PlaceOffset>& b, Visit&& visit) {
  std::size_t j = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    while (j < b.size() && b[j].key < a[i].key) ++j;
    if (j == b.size()) return;
    if (b[j].key == a[i].key) visit(i, j);
  }
}

std::size_t index_of(const std::vector<PlaceOffset>& places, const MapErrorCube& key) {
  const auto found = std::lower_bound(places.begin(), places.end(), key,
                                      [](const PlaceOffset& place, const MapErrorCube& k) { return place.key < k; });
  return static_cast<std::size_t>(found - places.begin());
}

double inner(const Matrix6x3& a, const Matrix6x3& b) {
  return a.cwiseProduct(b).sum();
}

class Comparison {
 public:
  Comparison(const MapError& a, const MapError& b) : a_(a), b_(b) {
    set_cubes();
    for (int part = 1; part < kMapErrorParts; ++part) set_smooth(part);
  }

  MapErrorMoments moments() const {
    MapErrorMoments result;
    add_cubes(result);
    add_cells(result);
    return result;
  }

 private:
  void clear(Part& part) const {
    part.place_with_b.assign(a_.cells.size(), Matrix3x6::Zero());
    part.a_with_place.assign(b_.cells.size(), Matrix6x3::Zero());
  }

  void set_cubes() {
    Part& part = parts_[0];
    clear(part);
    displaced_.assign(a_.cells.size(), 0.0);
    for_each_common(a_.cubes, b_.cubes, [&](std::size_t i, std::size_t j) {
      const PlaceOffset& own = a_.cubes[i];
      const PlaceOffset& other = b_.cubes[j];
      const std::size_t cell = index_of(a_.cells, cell_of(own.key));
      part.place_with_b[cell] += own.gain * other.coupling.transpose() * b_.inverse;
      part.a_with_place[index_of(b_.cells, cell_of(other.key))] += a_.inverse * own.coupling * other.gain;
      part.a_with_b += own.coupling * other.coupling.transpose();
      displaced_[cell] += own.gain.cwiseProduct(other.gain).sum();
    });
    part.a_with_b = a_.inverse * part.a_with_b * b_.inverse;
  }

  void set_smooth(int index) {
    Part& part = parts_[static_cast<std::size_t>(index)];
    clear(part);
    for (std::size_t i = 0; i < a_.cells.size(); ++i) {
      for (std::size_t j = 0; j < b_.cells.size(); ++j) {
        const double k = map_error_correlation((a_.cells[i].center - b_.cells[j].center).squaredNorm(), index);
        if (!(k > 0.0)) continue;
        part.place_with_b[i] += k * b_.cells[j].coupling.transpose();
        part.a_with_place[j] += k * a_.cells[i].coupling;
      }
      part.a_with_b += a_.cells[i].coupling * part.place_with_b[i];
    }
    for (Matrix3x6& with : part.place_with_b) with = with * b_.inverse;
    for (Matrix6x3& with : part.a_with_place) with = a_.inverse * with;
    part.a_with_b = a_.inverse * part.a_with_b * b_.inverse;
  }

  /// The expected product of two offsets: that of the displacements, minus the part that the poses absorb.
  void add_cubes(MapErrorMoments& result) const {
    for_each_common(a_.cubes, b_.cubes, [&](std::size_t i, std::size_t j) {
      const PlaceOffset& own = a_.cubes[i];
      const PlaceOffset& other = b_.cubes[j];
      const double gains = own.gain.cwiseProduct(other.gain).sum();
      result.products_m2[0] += own.offset_m.dot(other.offset_m);
      result.scatter[0] += own.gain.squaredNorm() * other.gain.squaredNorm();
      const std::size_t cell = index_of(a_.cells, cell_of(own.key));
      const std::size_t other_cell = index_of(b_.cells, cell_of(other.key));
      for (int p = 0; p < kMapErrorParts; ++p) {
        const Part& part = parts_[static_cast<std::size_t>(p)];
        const double k = p == 0 ? 1.0 : map_error_correlation((own.center - other.center).squaredNorm(), p);
        const Matrix3x6 place_with_b =
            own.gain * (p == 0 ? Matrix3x6(other.coupling.transpose() * b_.inverse) : part.place_with_b[cell]);
        const Matrix6x3 a_with_place =
            (p == 0 ? Matrix6x3(a_.inverse * own.coupling) : part.a_with_place[other_cell]) * other.gain;
        result.gains(0, p) += k * gains - inner(place_with_b.transpose(), other.by_pose) -
                              inner(own.by_pose, a_with_place - part.a_with_b * other.by_pose);
      }
    });
  }

  /// The same for all pairs of cells.
  void add_cells(MapErrorMoments& result) const {
    std::array<std::vector<Matrix6x3>, kMapErrorParts> own_places;
    std::array<std::vector<Matrix6x3>, kMapErrorParts> other_places;
    for (std::size_t p = 0; p < kMapErrorParts; ++p) {
      const Part& part = parts_[p];
      for (std::size_t i = 0; i < a_.cells.size(); ++i) {
        const Matrix3x6 place = p == 0 ? part.place_with_b[i] : Matrix3x6(a_.cells[i].gain * part.place_with_b[i]);
        own_places[p].push_back(place.transpose());
      }
      for (std::size_t j = 0; j < b_.cells.size(); ++j) {
        const PlaceOffset& cell = b_.cells[j];
        other_places[p].push_back((p == 0 ? part.a_with_place[j] : Matrix6x3(part.a_with_place[j] * cell.gain)) -
                                  part.a_with_b * cell.by_pose);
      }
    }
    for (std::size_t i = 0; i < a_.cells.size(); ++i) {
      const PlaceOffset& own = a_.cells[i];
      for (std::size_t j = 0; j < b_.cells.size(); ++j) {
        const PlaceOffset& other = b_.cells[j];
        const bool same = own.key == other.key;
        const double squared_distance_m2 = (own.center - other.center).squaredNorm();
        const int row = same ? 1 : row_of(squared_distance_m2);
        const double gains = own.gain.cwiseProduct(other.gain).sum();
        result.products_m2[row] += own.offset_m.dot(other.offset_m);
        result.scatter[row] += own.gain.squaredNorm() * other.gain.squaredNorm();
        for (int part = 0; part < kMapErrorParts; ++part) {
          const auto p = static_cast<std::size_t>(part);
          const double displaced =
              part > 0 ? gains * map_error_correlation(squared_distance_m2, part) : (same ? displaced_[i] : 0.0);
          result.gains(row, part) +=
              displaced - inner(own_places[p][i], other.by_pose) - inner(own.by_pose, other_places[p][j]);
        }
      }
    }
  }

  const MapError& a_;
  const MapError& b_;
  std::array<Part, kMapErrorParts> parts_;
  std::vector<double> displaced_;  // for cubes: Σ of the products of gains, for each cell of a
};

}  // namespace

double degrees_of_freedom(const MapError& error, const MapErrorVariances& variances_m2) {
  const auto count = static_cast<Eigen::Index>(error.cells.size());
  // Offset = gain d - by_poseᵀ c, with c = inverse Σ coupling d of all cells.
  Eigen::MatrixXd covariance(3 * count, 3 * count);  // of gain d at two cells
  Eigen::MatrixXd with_pose(3 * count, 6);           // of gain d and c
  Eigen::MatrixXd by_pose(6, 3 * count);
  Matrix6 pose = Matrix6::Zero();  // of c
  for (Eigen::Index i = 0; i < count; ++i) {
    const PlaceOffset& cell = error.cells[static_cast<std::size_t>(i)];
    Matrix3x6 with = Matrix3x6::Zero();
    for (Eigen::Index j = 0; j < count; ++j) {
      const PlaceOffset& other = error.cells[static_cast<std::size_t>(j)];
      double displaced_m2 = 0.0;
      for (int part = 1; part < kMapErrorParts; ++part) {
        if (!(variances_m2[part] > 0.0)) continue;
        displaced_m2 += variances_m2[part] * map_error_correlation((cell.center - other.center).squaredNorm(), part);
      }
      with += displaced_m2 * other.coupling.transpose();
      covariance.block<3, 3>(3 * i, 3 * j) = displaced_m2 * cell.gain * other.gain;
    }
    with_pose.middleRows<3>(3 * i) = cell.gain * with * error.inverse;
    by_pose.middleCols<3>(3 * i) = cell.by_pose;
    pose += cell.coupling * with;
  }
  pose = error.inverse * pose * error.inverse;
  const Eigen::MatrixXd taken = with_pose * by_pose;
  covariance += by_pose.transpose() * pose * by_pose - taken - taken.transpose();
  const double squares = covariance.squaredNorm();
  return squares > 0.0 ? std::pow(covariance.trace(), 2) / squares : 0.0;
}

std::optional<MapErrorMoments> compare_map_errors(const MapError& a, const MapError& b) {
  std::size_t common = 0;
  for_each_common(a.cubes, b.cubes, [&](std::size_t, std::size_t) { ++common; });
  if (common < kFewestCommon) return std::nullopt;
  const MapErrorMoments result = Comparison(a, b).moments();
  if (!(result.gains(0, 0) > 0.0)) return std::nullopt;
  return result;
}

void MapErrorMoments::approach(const MapErrorMoments& other, double share) {
  products_m2 += share * (other.products_m2 - products_m2);
  gains += share * (other.gains - gains);
  scatter += share * (other.scatter - scatter);
}

MapErrorVariances MapErrorMoments::variances_m2() const {
  // A weak prior at zero, for parts that the moments do not show.
  constexpr double kBelief = 0.02;
  Eigen::Matrix<double, kMapErrorMoments + kMapErrorParts, kMapErrorParts> rows;
  Eigen::Matrix<double, kMapErrorMoments + kMapErrorParts, 1> wanted;
  rows.setZero();
  wanted.setZero();
  for (int row = 0; row < kMapErrorMoments; ++row) {
    if (!(scatter[row] > 0.0)) continue;
    rows.row(row) = gains.row(row) / std::sqrt(scatter[row]);
    wanted[row] = products_m2[row] / std::sqrt(scatter[row]);
  }
  const double most = rows.colwise().norm().maxCoeff();
  if (!(most > 0.0)) return MapErrorVariances::Zero();
  rows.bottomRows<kMapErrorParts>() =
      kBelief * most * Eigen::Matrix<double, kMapErrorParts, kMapErrorParts>::Identity();

  MapErrorVariances best = MapErrorVariances::Zero();
  double least = wanted.squaredNorm();
  for (int subset = 1; subset < 1 << kMapErrorParts; ++subset) {
    std::vector<int> used;
    for (int part = 0; part < kMapErrorParts; ++part) {
      if ((subset & (1 << part)) != 0) used.push_back(part);
    }
    const Eigen::MatrixXd some = rows(Eigen::all, used);
    const Eigen::VectorXd found = some.householderQr().solve(wanted);
    const double rest = (wanted - some * found).squaredNorm();
    if (found.minCoeff() < 0.0 || rest >= least) continue;
    least = rest;
    best.setZero();
    for (std::size_t i = 0; i < used.size(); ++i) best[used[i]] = found[static_cast<Eigen::Index>(i)];
  }
  return best;
}

double MapErrorMoments::cube_variance_m2() const {
  return gains(0, 0) > 0.0 ? std::max(0.0, products_m2[0] / gains(0, 0)) : 0.0;
}

}  // namespace lodestone
