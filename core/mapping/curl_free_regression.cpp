#include "core/mapping/curl_free_regression.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <string>

#include "core/error.h"
#include "core/mapping/laplace_basis.h"

namespace lodestone {
namespace {

/// Posterior of the weights of the basis functions and of b, in units of their prior sigmas: a normal distribution with
/// information I + Fᵀ R⁻¹ F.
class Posterior {
 public:
  Posterior(const LaplaceBasis& basis, const CurlFreeKernel& kernel, const std::vector<FieldCell>& cells,
            const std::vector<int>& chosen)
      : basis_(basis), kernel_(kernel) {
    const double potential_sigma = kernel.signal_sigma_ut * kernel.length_scale_m;
    prior_sigma_ = potential_sigma * basis.spectral_density().cwiseSqrt();

    const auto count = static_cast<Eigen::Index>(chosen.size());
    std::vector<Vector3> positions;
    Eigen::VectorXd weights(count);
    Eigen::MatrixX3d weighted(count, 3);
    double sum_of_squares = 0.0;
    for (Eigen::Index i = 0; i < count; ++i) {
      const FieldCell& cell = cells[static_cast<std::size_t>(chosen[static_cast<std::size_t>(i)])];
      positions.push_back(cell.position);
      weights[i] = 1.0 / (cell.variance_ut2 + kernel.noise_sigma_ut * kernel.noise_sigma_ut);
      const Vector3 centred = cell.field_ut - kernel.mean_ut;
      weighted.row(i) = weights[i] * centred.transpose();
      sum_of_squares += weights[i] * centred.squaredNorm();
    }
    const Eigen::Index size = basis.size();
    const double linear = kernel.linear_sigma_ut;
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size + 3, size + 3);
    information.topLeftCorner(size, size) =
        prior_sigma_.asDiagonal() * basis.gradient_products(positions, weights) * prior_sigma_.asDiagonal();
    information.bottomLeftCorner(3, size) =
        -linear * (prior_sigma_.asDiagonal() * basis.gradient_sums(positions, weights.replicate(1, 3))).transpose();
    information.bottomRightCorner(3, 3).diagonal().setConstant(linear * linear * weights.sum());
    information.diagonal().array() += 1.0;
    Eigen::VectorXd right(size + 3);
    right.head(size) = -prior_sigma_.cwiseProduct(basis.gradient_sums(positions, weighted).rowwise().sum());
    right.tail<3>() = linear * weighted.colwise().sum().transpose();

    cholesky_.compute(information);
    if (cholesky_.info() != Eigen::Success) {
      throw std::invalid_argument(
          "curl-free regression: the information is not positive definite; check that all values are finite");
    }
    mean_ = cholesky_.solve(right);
    squared_mahalanobis_ = std::max(0.0, sum_of_squares - right.dot(mean_));
  }

  double squared_mahalanobis() const { return squared_mahalanobis_; }

  /// Mean and variance of B at points within the box.
  void predict(const std::vector<Vector3>& points, Eigen::Ref<Eigen::MatrixX3d> mean,
               Eigen::Ref<Eigen::MatrixX3d> variance) const {
    const Eigen::Index size = basis_.size();
    Eigen::MatrixXd rows(size + 3, 3 * static_cast<Eigen::Index>(points.size()));  // F, transposed
    rows.topRows(size) = -(prior_sigma_.asDiagonal() * basis_.gradients(points));
    rows.bottomRows<3>() =
        (kernel_.linear_sigma_ut * Matrix3::Identity()).replicate(1, static_cast<Eigen::Index>(points.size()));
    const Eigen::VectorXd field = rows.transpose() * mean_;
    const Eigen::VectorXd basis_prior = rows.topRows(size).colwise().squaredNorm();
    cholesky_.matrixL().solveInPlace(rows);
    const Eigen::VectorXd posterior = rows.colwise().squaredNorm();
    const Vector3 prior = kernel_.signal_sigmas_ut().cwiseAbs2();
    for (Eigen::Index i = 0; i < mean.rows(); ++i) {
      for (int k = 0; k < 3; ++k) {
        const Eigen::Index entry = 3 * i + k;
        mean(i, k) = kernel_.mean_ut[k] + field[entry];
        // Near the box's faces, the basis has less variance than the prior. The posterior is scaled accordingly.
        variance(i, k) = posterior[entry] * std::max(1.0, prior[k] / basis_prior[entry]);
      }
    }
  }

  Vector3 prior_variance() const {
    return kernel_.signal_sigmas_ut().cwiseAbs2().array() + kernel_.linear_sigma_ut * kernel_.linear_sigma_ut;
  }

 private:
  const LaplaceBasis& basis_;
  const CurlFreeKernel& kernel_;
  Eigen::VectorXd prior_sigma_;
  Eigen::LLT<Eigen::MatrixXd> cholesky_;
  Eigen::VectorXd mean_;
  double squared_mahalanobis_ = 0.0;
};

}  // namespace

CurlFreeRegression::CurlFreeRegression(std::vector<FieldCell> cells, const CurlFreeKernel& kernel,
                                       const SlidingGprOptions& options)
    : WindowedRegression(std::move(cells), kernel.length_scale_m, kernel.length_scale_m, options), kernel_(kernel) {}

WindowedRegression::WindowPrediction CurlFreeRegression::solve_window(std::int64_t row, std::int64_t column,
                                                                      const std::vector<Vector3>& points) const {
  Vector3 centre = window_centre(row, column);
  const std::vector<int> chosen = training_cells(centre, cells().size());
  double lowest = cells().front().position.z();
  double highest = lowest;
  if (!chosen.empty()) lowest = highest = cells()[static_cast<std::size_t>(chosen.front())].position.z();
  for (const int cell : chosen) {
    lowest = std::min(lowest, cells()[static_cast<std::size_t>(cell)].position.z());
    highest = std::max(highest, cells()[static_cast<std::size_t>(cell)].position.z());
  }
  centre.z() = 0.5 * (lowest + highest);
  const double margin = options().domain_margin_length_scales;
  const double half_side = training_half_side_m() + margin * kernel_.length_scale_m;
  // The cells are at the box's vertical centre; query points are at most the reach above or below them.
  const double reach = options().reach_length_scales * kernel_.vertical_length_scale_m;
  const double half_height = 0.5 * (highest - lowest) + reach + 0.5 * margin * kernel_.vertical_length_scale_m;
  const Vector3 half_sides(half_side, half_side, half_height);
  if (LaplaceBasis::count(half_sides, kernel_.length_scales_m(), options().basis_cutoff) > most_functions) {
    throw InputError("magnetic map: readings near x = " + std::to_string(centre.x()) +
                     ", y = " + std::to_string(centre.y()) + " m span " + std::to_string(highest - lowest) +
                     " m of height, too much for the curl-free regression. Survey one storey at a time, lower "
                     "regression.basis_cutoff, or use --method s-gpr");
  }
  const LaplaceBasis basis(centre, half_sides, kernel_.length_scales_m(), options().basis_cutoff);
  const Posterior posterior(basis, kernel_, cells(), chosen);

  const auto count = static_cast<Eigen::Index>(points.size());
  WindowPrediction result{Eigen::MatrixX3d(count, 3), Eigen::MatrixX3d(count, 3)};
  constexpr Eigen::Index piece = 128;  // points per batch; limits the memory of their rows
  for (Eigen::Index begin = 0; begin < count; begin += piece) {
    const Eigen::Index some = std::min(piece, count - begin);
    const std::vector<Vector3> targets(points.begin() + begin, points.begin() + begin + some);
    posterior.predict(targets, result.mean.middleRows(begin, some), result.variance.middleRows(begin, some));
  }
  result.variance *= variance_scale(posterior.squared_mahalanobis(), 3 * chosen.size());
  for (Eigen::Index i = 0; i < count; ++i) {
    const double height = points[static_cast<std::size_t>(i)].z();
    if (height >= lowest - reach && height <= highest + reach) continue;
    result.mean.row(i) = kernel_.mean_ut.transpose();
    result.variance.row(i) = posterior.prior_variance().transpose();
  }
  return result;
}

}  // namespace lodestone
