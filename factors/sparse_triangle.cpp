#include "factors/sparse_triangle.h"

#include <suitesparse/cholmod.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <suitesparse/SuiteSparseQR.hpp>

#include "factors/serial_openmp.h"

namespace lodestone {

namespace {

/// SuiteSparse's workspace and settings.
class SuiteSparse {
 public:
  SuiteSparse() {
    cholmod_l_start(&common);
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_NATURAL;
    common.postorder = 0;
    // Columns of similar pattern are factorized at once, and then stored one by one.
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.final_asis = 0;
    common.final_super = 0;
    common.final_ll = 1;
    common.print = 0;
  }
  ~SuiteSparse() { cholmod_l_finish(&common); }
  SuiteSparse(const SuiteSparse&) = delete;
  SuiteSparse& operator=(const SuiteSparse&) = delete;

  cholmod_common common;
};

static_assert(sizeof(SuiteSparse_long) == sizeof(SparseMatrix::StorageIndex));

/// SuiteSparse only reads through these pointers.
cholmod_sparse view(const SparseMatrix& matrix, bool lower) {
  cholmod_sparse result{};
  result.nrow = static_cast<std::size_t>(matrix.rows());
  result.ncol = static_cast<std::size_t>(matrix.cols());
  result.nzmax = static_cast<std::size_t>(matrix.nonZeros());
  result.p = const_cast<SparseMatrix::StorageIndex*>(matrix.outerIndexPtr());
  result.i = const_cast<SparseMatrix::StorageIndex*>(matrix.innerIndexPtr());
  result.x = const_cast<double*>(matrix.valuePtr());
  result.stype = lower ? -1 : 0;
  result.itype = CHOLMOD_LONG;
  result.xtype = CHOLMOD_REAL;
  result.dtype = CHOLMOD_DOUBLE;
  result.sorted = 1;
  result.packed = 1;
  return result;
}

/// Columns that are solved for at once, or twice as many: loops of fixed length become vector instructions.
constexpr std::size_t kPanel = 8;

/// Most columns of equal pattern in one step of the recursion for covariances.
constexpr std::size_t kGroup = 64;

template <std::size_t width, class Visit>
void visit_panel(Eigen::MatrixXd& matrix, Eigen::Index first, Eigen::Index count, Visit&& visit) {
  std::vector<std::array<double, width>> panel(static_cast<std::size_t>(matrix.rows()));
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, width, Eigen::RowMajor>> rows(panel.data()->data(), matrix.rows(),
                                                                                 width);
  rows.setZero();
  rows.leftCols(count) = matrix.middleCols(first, count);
  visit(std::span(panel));
  matrix.middleCols(first, count) = rows.leftCols(count);
}

/// The columns of a matrix as row-major panels of a fixed number of columns, filled up with zeros.
template <class Visit>
void for_each_panel(Eigen::MatrixXd& matrix, Visit&& visit) {
  if (matrix.rows() == 0) return;
  Eigen::Index first = 0;
  for (; matrix.cols() - first > static_cast<Eigen::Index>(kPanel); first += 2 * kPanel) {
    const Eigen::Index count = std::min<Eigen::Index>(2 * kPanel, matrix.cols() - first);
    visit_panel<2 * kPanel>(matrix, first, count, visit);
  }
  if (first < matrix.cols()) visit_panel<kPanel>(matrix, first, matrix.cols() - first, visit);
}

}  // namespace

std::optional<SparseTriangle> SparseTriangle::by_cholesky(const SparseMatrix& information) {
  const SerialOpenMp serial;
  SuiteSparse suite;
  cholmod_sparse matrix = view(information, true);
  cholmod_factor* factor = cholmod_l_analyze(&matrix, &suite.common);
  if (factor == nullptr) throw std::runtime_error("CHOLMOD: out of memory");
  cholmod_l_factorize(&matrix, factor, &suite.common);
  std::optional<SparseTriangle> result;
  if (suite.common.status == CHOLMOD_OK && factor->minor == factor->n) {
    result.emplace();
    const auto* begins = static_cast<const std::int64_t*>(factor->p);
    const auto* counts = static_cast<const std::int64_t*>(factor->nz);
    const auto* rows = static_cast<const std::int64_t*>(factor->i);
    const auto* values = static_cast<const double*>(factor->x);
    result->starts_.reserve(factor->n + 1);
    result->rows_.reserve(factor->nzmax);
    result->values_.reserve(factor->nzmax);
    result->starts_.push_back(0);
    for (std::size_t column = 0; column < factor->n; ++column) {
      result->rows_.insert(result->rows_.end(), rows + begins[column], rows + begins[column] + counts[column]);
      result->values_.insert(result->values_.end(), values + begins[column], values + begins[column] + counts[column]);
      result->starts_.push_back(static_cast<std::int64_t>(result->rows_.size()));
    }
  }
  cholmod_l_free_factor(&factor, &suite.common);
  return result;
}

SparseTriangle SparseTriangle::by_qr(const SparseMatrix& rows, const SparseMatrix& pattern) {
  // SuiteSparseQR drops zeros of R, but the recursion requires the complete pattern, which is that of any factor of H.
  SparseMatrix identity(pattern);
  std::fill_n(identity.valuePtr(), identity.nonZeros(), 0.0);
  for (Eigen::Index column = 0; column < identity.cols(); ++column) identity.coeffRef(column, column) = 1.0;
  SparseTriangle result = by_cholesky(identity).value();
  std::fill(result.values_.begin(), result.values_.end(), 0.0);

  SuiteSparse suite;
  cholmod_sparse matrix = view(rows, false);
  cholmod_sparse* triangle = nullptr;
  SuiteSparse_long* permutation = nullptr;  // remains null: the order is fixed
  SuiteSparseQR<double>(SPQR_ORDERING_FIXED, SPQR_NO_TOL, static_cast<SuiteSparse_long>(rows.cols()), &matrix,
                        &triangle, &permutation, &suite.common);
  if (triangle == nullptr || permutation != nullptr) throw std::runtime_error("SuiteSparseQR: out of memory");
  const auto* starts = static_cast<const std::int64_t*>(triangle->p);
  const auto* indices = static_cast<const std::int64_t*>(triangle->i);
  const auto* values = static_cast<const double*>(triangle->x);
  for (std::int64_t column = 0; column < static_cast<std::int64_t>(triangle->ncol); ++column) {
    for (std::int64_t at = starts[column]; at < starts[column + 1]; ++at) {
      // R(row, column) = L(column, row).
      const auto begin = result.rows_.begin() + result.starts_[static_cast<std::size_t>(indices[at])];
      const auto end = result.rows_.begin() + result.starts_[static_cast<std::size_t>(indices[at]) + 1];
      const auto place = std::lower_bound(begin, end, column);
      if (place == end || *place != column)
        throw std::logic_error("SparseTriangle: the rows of R do not match the pattern");
      result.values_[static_cast<std::size_t>(place - result.rows_.begin())] = values[at];
    }
  }
  cholmod_l_free_sparse(&triangle, &suite.common);
  return result;
}

double SparseTriangle::least_pivot_share(const SparseMatrix& information) const {
  double least = 1.0;
  for (Eigen::Index column = 0; column < information.cols(); ++column) {
    // The diagonal is the first entry of a column of the lower triangle.
    const double before = information.valuePtr()[information.outerIndexPtr()[column]];
    const double root = values_[static_cast<std::size_t>(starts_[static_cast<std::size_t>(column)])];
    least = std::min(least, root * root / before);
  }
  return least;
}

Eigen::MatrixXd SparseTriangle::covariance(std::span<const IndexRange> variables) const {
  const auto size = static_cast<Eigen::Index>(starts_.size()) - 1;
  Eigen::Index columns = 0;
  Eigen::Index first = size;
  for (const IndexRange& variable : variables) {
    columns += variable.size;
    first = std::min(first, variable.begin);
  }
  Eigen::MatrixXd solution = Eigen::MatrixXd::Zero(size - first, columns);
  Eigen::Index column = 0;
  for (const IndexRange& variable : variables) {
    for (Eigen::Index i = 0; i < variable.size; ++i) solution(variable.begin + i - first, column++) = 1.0;
  }
  // H⁻¹ = L⁻ᵀ L⁻¹.
  for_each_panel(solution, [&](auto panel) { forward(panel); });
  return solution.transpose() * solution;
}

Eigen::MatrixXd SparseTriangle::solve(const Eigen::MatrixXd& right) const {
  Eigen::MatrixXd solution = right;
  for_each_panel(solution, [&](auto panel) {
    forward(panel);
    backward(panel);
  });
  return solution;
}

template <std::size_t width>
void SparseTriangle::forward(std::span<std::array<double, width>> panel) const {
  const std::size_t first = starts_.size() - 1 - panel.size();
  for (std::size_t j = first; j + 1 < starts_.size(); ++j) {
    const auto begin = static_cast<std::size_t>(starts_[j]);
    const auto end = static_cast<std::size_t>(starts_[j + 1]);
    std::array<double, width> pivot = panel[j - first];
    if (std::ranges::all_of(pivot, [](double value) { return value == 0.0; })) continue;
    for (double& value : pivot) value /= values_[begin];
    panel[j - first] = pivot;
    for (std::size_t at = begin + 1; at < end; ++at) {
      std::array<double, width>& row = panel[static_cast<std::size_t>(rows_[at]) - first];
      for (std::size_t i = 0; i < width; ++i) row[i] -= values_[at] * pivot[i];
    }
  }
}

template <std::size_t width>
void SparseTriangle::backward(std::span<std::array<double, width>> panel) const {
  for (std::size_t j = panel.size(); j-- > 0;) {
    const auto begin = static_cast<std::size_t>(starts_[j]);
    const auto end = static_cast<std::size_t>(starts_[j + 1]);
    std::array<double, width> pivot = panel[j];
    for (std::size_t at = begin + 1; at < end; ++at) {
      const std::array<double, width>& row = panel[static_cast<std::size_t>(rows_[at])];
      for (std::size_t i = 0; i < width; ++i) pivot[i] -= values_[at] * row[i];
    }
    for (double& value : pivot) value /= values_[begin];
    panel[j] = pivot;
  }
}

std::size_t SparseTriangle::group_begin(std::size_t end) const {
  std::size_t begin = end - 1;
  const auto rows_of = [&](std::size_t column) {
    return std::span(rows_).subspan(static_cast<std::size_t>(starts_[column]),
                                    static_cast<std::size_t>(starts_[column + 1] - starts_[column]));
  };
  while (begin > 0 && end - begin < kGroup && std::ranges::equal(rows_of(begin - 1).subspan(1), rows_of(begin)))
    --begin;
  return begin;
}

std::vector<double> SparseTriangle::inverse_on_pattern() const {
  // Z = H⁻¹ on the pattern of L, from the last columns to the first. Columns J with the same rows S below them are one
  // step: with W = L_SJ L_JJ⁻¹, Z_SJ = -Z_SS W and Z_JJ = (L_JJ L_JJᵀ)⁻¹ - Wᵀ Z_SJ. Z_SS is in the pattern.
  std::vector<double> inverse(values_.size());
  Eigen::MatrixXd own, root, below, known, found;
  for (std::size_t end = starts_.size() - 1, begin = end; end > 0; end = begin) {
    begin = group_begin(end);
    const auto width = static_cast<Eigen::Index>(end - begin);
    const auto last = static_cast<std::size_t>(starts_[end - 1]);
    const std::span rows = std::span(rows_).subspan(last + 1, static_cast<std::size_t>(starts_[end]) - last - 1);
    const auto count = static_cast<Eigen::Index>(rows.size());
    own.setZero(width, width);
    below.resize(count, width);
    for (Eigen::Index j = 0; j < width; ++j) {
      const double* column = values_.data() + starts_[begin + static_cast<std::size_t>(j)];
      own.col(j).tail(width - j) = Eigen::Map<const Eigen::VectorXd>(column, width - j);
      below.col(j) = Eigen::Map<const Eigen::VectorXd>(column + width - j, count);
    }
    known.resize(count, count);
    for (Eigen::Index j = 0; j < count; ++j) {
      auto at = static_cast<std::size_t>(starts_[static_cast<std::size_t>(rows[static_cast<std::size_t>(j)])]);
      for (Eigen::Index i = j; i < count; ++i, ++at) {
        while (rows_[at] != rows[static_cast<std::size_t>(i)]) ++at;
        known(i, j) = inverse[at];
      }
    }
    root.setIdentity(width, width);
    own.triangularView<Eigen::Lower>().solveInPlace(root);
    if (count > 0) own.triangularView<Eigen::Lower>().solveInPlace<Eigen::OnTheRight>(below);
    found.setZero(count, width);
    if (count > 0) found.noalias() -= known.selfadjointView<Eigen::Lower>() * below;
    own.noalias() = root.transpose() * root;
    if (count > 0) own.noalias() -= below.transpose() * found;
    for (Eigen::Index j = 0; j < width; ++j) {
      double* column = inverse.data() + starts_[begin + static_cast<std::size_t>(j)];
      Eigen::Map<Eigen::VectorXd>(column, width - j) = own.col(j).tail(width - j);
      Eigen::Map<Eigen::VectorXd>(column + width - j, count) = found.col(j);
    }
  }
  return inverse;
}

std::vector<Eigen::MatrixXd> SparseTriangle::diagonal_covariances(std::span<const IndexRange> variables) const {
  const std::vector<double> inverse = inverse_on_pattern();
  std::vector<Eigen::MatrixXd> result;
  for (const IndexRange& variable : variables) {
    Eigen::MatrixXd block(variable.size, variable.size);
    for (Eigen::Index j = 0; j < variable.size; ++j) {
      // A variable's own block is dense: its rows are the first of the column.
      const auto begin = static_cast<std::size_t>(starts_[static_cast<std::size_t>(variable.begin + j)]);
      for (Eigen::Index i = j; i < variable.size; ++i) {
        block(i, j) = block(j, i) = inverse[begin + static_cast<std::size_t>(i - j)];
      }
    }
    result.push_back(std::move(block));
  }
  return result;
}

}  // namespace lodestone
