#include "core/mapping/dense_cholesky.h"

#include <cstddef>
#include <utility>

#include "core/thread_limit.h"

// The interface of LAPACK and BLAS (Fortran: addresses, and the lengths of texts at the end).
extern "C" {
void dpotrf_(const char* triangle, const int* size, double* matrix, const int* stride, int* failure, std::size_t);
void dpotri_(const char* triangle, const int* size, double* matrix, const int* stride, int* failure, std::size_t);
void dtrsm_(const char* side, const char* triangle, const char* transposed, const char* unit, const int* rows,
            const int* columns, const double* factor, const double* matrix, const int* matrix_stride, double* b,
            const int* b_stride, std::size_t, std::size_t, std::size_t, std::size_t);
}

namespace lodestone {

namespace {

void divide_by(const char* transposed, const Eigen::MatrixXd& factor, double* b, Eigen::Index columns) {
  const int rows = static_cast<int>(factor.rows()), count = static_cast<int>(columns);
  const double one = 1.0;
  if (rows == 0 || count == 0) return;
  dtrsm_("L", "L", transposed, "N", &rows, &count, &one, factor.data(), &rows, b, &rows, 1, 1, 1, 1);
}

}  // namespace

DenseCholesky::DenseCholesky(Eigen::MatrixXd matrix) : factor_(std::move(matrix)) {
  [[maybe_unused]] static const bool limited = (limit_blas(), true);
  const int size = static_cast<int>(factor_.rows());
  if (size == 0) return;
  int failure = 0;
  dpotrf_("L", &size, factor_.data(), &size, &failure, 1);
  positive_definite_ = failure == 0 && factor_.diagonal().allFinite();
}

void DenseCholesky::solve_lower(Eigen::MatrixXd& b) const {
  divide_by("N", factor_, b.data(), b.cols());
}

Eigen::VectorXd DenseCholesky::solve(Eigen::VectorXd b) const {
  divide_by("N", factor_, b.data(), 1);
  divide_by("T", factor_, b.data(), 1);
  return b;
}

Eigen::MatrixXd DenseCholesky::inverse() const {
  Eigen::MatrixXd result = factor_;
  const int size = static_cast<int>(result.rows());
  int failure = 0;
  dpotri_("L", &size, result.data(), &size, &failure, 1);
  result.triangularView<Eigen::StrictlyUpper>() = result.transpose();
  return result;
}

}  // namespace lodestone
