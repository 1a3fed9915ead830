#include "core/mapping/curl_free_kernel.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/mapping/likelihood_maximum.h"

namespace lodestone {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;

constexpr int curl_free_evaluations = 60;
constexpr double curl_free_tolerance = 1e-2;  // nats, for some thousand values

/// The kernel in units of the length scales. With a_i = d_i / ℓ_i and g_i = ℓ / ℓ_i, the kernel is
/// σ² g_i g_j (δ_ij − a_i a_j) E.
struct ScaledOffset {
  Vector3 a;
  Matrix3 form;        ///< δ − a aᵀ
  Matrix3 amplitudes;  ///< σ² g gᵀ E

  ScaledOffset(const CurlFreeKernel& kernel, const Vector3& offset)
      : a(offset.cwiseQuotient(kernel.length_scales_m())), form(Matrix3::Identity() - a * a.transpose()) {
    const Vector3 sigmas = kernel.signal_sigmas_ut();
    amplitudes = std::exp(-0.5 * a.squaredNorm()) * sigmas * sigmas.transpose();
  }

  Matrix3 covariance() const { return amplitudes.cwiseProduct(form); }

  /// Derivative by log ℓ with constant σ. The sigma of B_z grows with ℓ.
  Matrix3 derivative_by_length_scale() const {
    Matrix3 result = a.head<2>().squaredNorm() * form;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const int vertical = (i == 2) + (j == 2);
        result(i, j) += vertical * form(i, j) + (2 - vertical) * a[i] * a[j];
      }
    }
    return amplitudes.cwiseProduct(result);
  }

  /// Derivative by log ℓ_z.
  Matrix3 derivative_by_vertical_length_scale() const {
    Matrix3 result = a.z() * a.z() * form;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) result(i, j) += ((i == 2) + (j == 2)) * (a[i] * a[j] - form(i, j));
    }
    return amplitudes.cwiseProduct(result);
  }
};

Vector5 logarithms_of(const CurlFreeKernel& kernel) {
  Vector5 result;
  result << kernel.signal_sigma_ut, kernel.length_scale_m, kernel.vertical_length_scale_m, kernel.noise_sigma_ut,
      kernel.linear_sigma_ut;
  return result.array().log();
}

CurlFreeKernel kernel_of(const Vector5& logarithms, const Vector3& mean_ut) {
  const Vector5 values = logarithms.array().exp();
  return {mean_ut, values[4], values[0], values[1], values[2], values[3]};
}

}  // namespace

Matrix3 curl_free_covariance(const CurlFreeKernel& kernel, const Vector3& offset) {
  return ScaledOffset(kernel, offset).covariance();
}

double log_marginal_likelihood(const std::vector<FieldCell>& cells, const CurlFreeKernel& kernel, Vector5* gradient) {
  if (cells.empty()) throw std::invalid_argument("log_marginal_likelihood: expected at least one training cell");
  const auto count = static_cast<Eigen::Index>(cells.size());
  const double linear = kernel.linear_sigma_ut * kernel.linear_sigma_ut;
  const double noise = kernel.noise_sigma_ut * kernel.noise_sigma_ut;
  const double jitter = 1e-9 * (linear + kernel.signal_sigmas_ut().squaredNorm());
  Eigen::MatrixXd covariance(3 * count, 3 * count);
  Eigen::VectorXd centred(3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {  // Cholesky reads the lower triangle only
      covariance.block<3, 3>(3 * i, 3 * j) = curl_free_covariance(kernel, cells[i].position - cells[j].position);
      covariance.block<3, 3>(3 * i, 3 * j).diagonal().array() += linear;
    }
    covariance.diagonal().segment<3>(3 * i).array() += noise + cells[i].variance_ut2 + jitter;
    centred.segment<3>(3 * i) = cells[i].field_ut - kernel.mean_ut;
  }
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> cholesky(covariance);  // in place
  if (cholesky.info() != Eigen::Success) {
    throw std::invalid_argument(
        "log_marginal_likelihood: the covariance is not positive definite; check that all values are finite");
  }
  const Eigen::VectorXd weights = cholesky.solve(centred);
  const double value = -0.5 * centred.dot(weights) - cholesky.matrixLLT().diagonal().array().log().sum() -
                       1.5 * static_cast<double>(count) * std::log(2.0 * std::numbers::pi);
  if (gradient == nullptr) return value;

  // ½ tr((α αᵀ − K⁻¹) ∂K/∂θ): each pair of cells once, doubled.
  Eigen::MatrixXd inner = -cholesky.solve(Eigen::MatrixXd::Identity(3 * count, 3 * count));
  inner.noalias() += weights * weights.transpose();
  gradient->setZero();
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const ScaledOffset offset(kernel, cells[i].position - cells[j].position);
      const Matrix3 block = (i == j ? 0.5 : 1.0) * inner.block<3, 3>(3 * i, 3 * j);
      (*gradient)[0] += 2.0 * block.cwiseProduct(offset.covariance()).sum();
      (*gradient)[1] += block.cwiseProduct(offset.derivative_by_length_scale()).sum();
      (*gradient)[2] += block.cwiseProduct(offset.derivative_by_vertical_length_scale()).sum();
      (*gradient)[4] += 2.0 * linear * block.trace();
    }
  }
  (*gradient)[3] = noise * inner.trace();
  return value;
}

CurlFreeFit fit_curl_free_kernel(const std::vector<std::vector<FieldCell>>& sets, const CurlFreeKernel& start,
                                 const KernelBounds& bounds) {
  if (sets.empty()) throw std::invalid_argument("fit_curl_free_kernel: expected at least one data set");
  Vector5 lower;
  lower << bounds.min_sigma, bounds.min_length_scale_m, bounds.min_length_scale_m, bounds.min_sigma, bounds.min_sigma;
  Vector5 upper;
  upper << bounds.max_sigma, bounds.max_length_scale_m, bounds.max_length_scale_m, bounds.max_sigma, bounds.max_sigma;
  std::vector<Vector5> starts;
  for (const double factor : {1.0, 0.35, 3.0}) {
    CurlFreeKernel other = start;
    other.length_scale_m *= factor;
    other.vertical_length_scale_m *= factor;
    starts.push_back(logarithms_of(other));
  }
  double values = 0.0;
  for (const auto& set : sets) values += 3.0 * static_cast<double>(set.size());
  const auto likelihood = [&](const std::vector<FieldCell>& cells, const Vector5& logarithms, Vector5* gradient) {
    return log_marginal_likelihood(cells, kernel_of(logarithms, start.mean_ut), gradient);
  };
  const BoundedMinimum<5> found = maximize_likelihood<5>(sets, starts, lower.array().log(), upper.array().log(), values,
                                                         curl_free_tolerance, curl_free_evaluations, likelihood);
  return {kernel_of(found.point, start.mean_ut), -found.value, found.evaluations, found.converged};
}

}  // namespace lodestone
