#include "core/mapping/laplace_basis.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lodestone {
namespace {

/// Calls `visit(mode)` for every mode within the cutoff, z slowest.
template <class Visit>
void for_each_mode(const Vector3& half_sides, const Vector3& length_scales_m, double cutoff, Visit&& visit) {
  const Vector3 step = 0.5 * std::numbers::pi * length_scales_m.cwiseQuotient(half_sides);  // ℓ_d ω_d of n = 1
  const double most = cutoff * cutoff;
  const auto square = [](double value) { return value * value; };
  for (int z = 1; square(step.z() * z) <= most; ++z) {
    for (int y = 1; square(step.y() * y) + square(step.z() * z) <= most; ++y) {
      for (int x = 1; square(step.x() * x) + square(step.y() * y) + square(step.z() * z) <= most; ++x) {
        visit(std::array<int, 3>{x, y, z});
      }
    }
  }
}

/// Σ_i x_ip y_iq z_ir: row p, column q + columns(y) r.
Eigen::MatrixXd separable_sums(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const Eigen::MatrixXd& z) {
  constexpr Eigen::Index piece = 256;  // points per batch; limits the memory of the products
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(x.cols(), y.cols() * z.cols());
  Eigen::MatrixXd products(piece, sums.cols());
  for (Eigen::Index begin = 0; begin < x.rows(); begin += piece) {
    const Eigen::Index count = std::min(piece, x.rows() - begin);
    for (Eigen::Index r = 0; r < z.cols(); ++r) {
      products.block(0, y.cols() * r, count, y.cols()) =
          (y.middleRows(begin, count).array().colwise() * z.col(r).segment(begin, count).array()).matrix();
    }
    sums.noalias() += x.middleRows(begin, count).transpose() * products.topRows(count);
  }
  return sums;
}

}  // namespace

LaplaceBasis::LaplaceBasis(const Vector3& centre, const Vector3& half_sides, const Vector3& length_scales_m,
                           double cutoff)
    : centre_(centre),
      half_sides_(half_sides),
      length_scales_(length_scales_m),
      wave_step_(0.5 * std::numbers::pi * half_sides.cwiseInverse()) {
  modes_.reserve(count(half_sides, length_scales_m, cutoff));
  for_each_mode(half_sides, length_scales_m, cutoff, [this](const Mode& mode) {
    modes_.push_back(mode);
    for (std::size_t d = 0; d < 3; ++d) highest_[d] = std::max(highest_[d], mode[d]);
  });
}

std::size_t LaplaceBasis::count(const Vector3& half_sides, const Vector3& length_scales_m, double cutoff) {
  std::size_t count = 0;
  for_each_mode(half_sides, length_scales_m, cutoff, [&count](const Mode&) { ++count; });
  return count;
}

Eigen::VectorXd LaplaceBasis::spectral_density() const {
  Eigen::VectorXd density(size());
  const double peak = std::pow(2.0 * std::numbers::pi, 1.5) * length_scales_.prod();
  for (Eigen::Index j = 0; j < size(); ++j) {
    const Mode& mode = modes_[static_cast<std::size_t>(j)];
    const Vector3 wave(wave_number(mode, 0), wave_number(mode, 1), wave_number(mode, 2));
    density[j] = peak * std::exp(-0.5 * length_scales_.cwiseProduct(wave).squaredNorm());
  }
  return density;
}

Eigen::MatrixXd LaplaceBasis::sines(const std::vector<Vector3>& points, int axis, int highest) const {
  Eigen::MatrixXd table = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(points.size()), highest + 1);
  for (Eigen::Index i = 0; i < table.rows(); ++i) {
    const double angle =
        wave_step_[axis] * (points[static_cast<std::size_t>(i)][axis] - centre_[axis] + half_sides_[axis]);
    for (int n = 1; n <= highest; ++n) table(i, n) = std::sin(n * angle);
  }
  return table;
}

Eigen::MatrixXd LaplaceBasis::cosines(const std::vector<Vector3>& points, int axis, int highest) const {
  Eigen::MatrixXd table(static_cast<Eigen::Index>(points.size()), highest + 1);
  for (Eigen::Index i = 0; i < table.rows(); ++i) {
    const double angle =
        wave_step_[axis] * (points[static_cast<std::size_t>(i)][axis] - centre_[axis] + half_sides_[axis]);
    for (int n = 0; n <= highest; ++n) table(i, n) = std::cos(n * angle);
  }
  return table;
}

Eigen::VectorXd LaplaceBasis::values(const Vector3& point) const {
  Eigen::VectorXd result(size());
  std::array<Eigen::MatrixXd, 3> sine;
  for (int d = 0; d < 3; ++d)
    sine[static_cast<std::size_t>(d)] = sines({point}, d, highest_[static_cast<std::size_t>(d)]);
  for (Eigen::Index j = 0; j < size(); ++j) {
    const Mode& mode = modes_[static_cast<std::size_t>(j)];
    result[j] = scale() * sine[0](0, mode[0]) * sine[1](0, mode[1]) * sine[2](0, mode[2]);
  }
  return result;
}

Eigen::MatrixXd LaplaceBasis::gradients(const std::vector<Vector3>& points) const {
  std::array<Eigen::MatrixXd, 3> sine;
  std::array<Eigen::MatrixXd, 3> slope;  // of the sines, ω cos
  for (int d = 0; d < 3; ++d) {
    const auto axis = static_cast<std::size_t>(d);
    // One column per point: then all functions of a point come from one column.
    sine[axis] = sines(points, d, highest_[axis]).transpose();
    slope[axis] = cosines(points, d, highest_[axis]).transpose();
    for (int n = 0; n <= highest_[axis]; ++n) slope[axis].row(n) *= wave_step_[d] * n;
  }
  const double norm = scale();
  Eigen::MatrixXd result(size(), 3 * static_cast<Eigen::Index>(points.size()));
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(points.size()); ++i) {
    const double* sx = sine[0].col(i).data();
    const double* sy = sine[1].col(i).data();
    const double* sz = sine[2].col(i).data();
    const double* cx = slope[0].col(i).data();
    const double* cy = slope[1].col(i).data();
    const double* cz = slope[2].col(i).data();
    for (Eigen::Index j = 0; j < size(); ++j) {
      const auto& [x, y, z] = modes_[static_cast<std::size_t>(j)];
      result(j, 3 * i) = norm * cx[x] * sy[y] * sz[z];
      result(j, 3 * i + 1) = norm * sx[x] * cy[y] * sz[z];
      result(j, 3 * i + 2) = norm * sx[x] * sy[y] * cz[z];
    }
  }
  return result;
}

Eigen::MatrixXd LaplaceBasis::gradient_products(const std::vector<Vector3>& points,
                                                const Eigen::VectorXd& weights) const {
  const Eigen::MatrixXd x = cosines(points, 0, 2 * highest_[0]).array().colwise() * weights.array();
  const Eigen::MatrixXd y = cosines(points, 1, 2 * highest_[1]);
  const Eigen::Index columns = y.cols();
  const Eigen::MatrixXd sums = separable_sums(x, y, cosines(points, 2, 2 * highest_[2]));
  // cos a cos b = ½ (cos(a − b) + cos(a + b)), sin a sin b = ½ (cos(a − b) − cos(a + b)). Of the eight sums of an
  // entry, those with opposite signs on all three axes have the same factor.
  const double norm = scale() * scale() / 8.0;
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size(), size());
  for (Eigen::Index k = 0; k < size(); ++k) {
    const Mode& b = modes_[static_cast<std::size_t>(k)];
    for (Eigen::Index j = k; j < size(); ++j) {
      const Mode& a = modes_[static_cast<std::size_t>(j)];
      const double wx = norm * wave_number(a, 0) * wave_number(b, 0);
      const double wy = norm * wave_number(a, 1) * wave_number(b, 1);
      const double wz = norm * wave_number(a, 2) * wave_number(b, 2);
      const int x0 = std::abs(a[0] - b[0]);
      const int x1 = a[0] + b[0];
      const int y0 = std::abs(a[1] - b[1]);
      const int y1 = a[1] + b[1];
      const Eigen::Index z0 = columns * std::abs(a[2] - b[2]);
      const Eigen::Index z1 = columns * (a[2] + b[2]);
      result(j, k) = (wx + wy + wz) * (sums(x0, y0 + z0) + sums(x1, y1 + z1)) +
                     (wx - wy - wz) * (sums(x1, y0 + z0) + sums(x0, y1 + z1)) +
                     (wy - wx - wz) * (sums(x0, y1 + z0) + sums(x1, y0 + z1)) +
                     (wz - wx - wy) * (sums(x0, y0 + z1) + sums(x1, y1 + z0));
    }
  }
  return result;
}

Eigen::MatrixX3d LaplaceBasis::gradient_sums(const std::vector<Vector3>& points,
                                             const Eigen::MatrixX3d& weights) const {
  std::array<Eigen::MatrixXd, 3> sine;
  std::array<Eigen::MatrixXd, 3> cosine;
  for (int d = 0; d < 3; ++d) {
    const auto axis = static_cast<std::size_t>(d);
    sine[axis] = sines(points, d, highest_[axis]);
    cosine[axis] = cosines(points, d, highest_[axis]);
  }
  Eigen::MatrixX3d result(size(), 3);
  for (int d = 0; d < 3; ++d) {
    const Eigen::MatrixXd x = (d == 0 ? cosine[0] : sine[0]).array().colwise() * weights.col(d).array();
    const Eigen::MatrixXd& y = d == 1 ? cosine[1] : sine[1];
    const Eigen::MatrixXd sums = separable_sums(x, y, d == 2 ? cosine[2] : sine[2]);
    for (Eigen::Index j = 0; j < size(); ++j) {
      const Mode& mode = modes_[static_cast<std::size_t>(j)];
      result(j, d) = scale() * wave_number(mode, d) * sums(mode[0], mode[1] + y.cols() * mode[2]);
    }
  }
  return result;
}

}  // namespace lodestone
