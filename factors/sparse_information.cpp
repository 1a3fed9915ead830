#include "factors/sparse_information.h"

#include <Eigen/QR>
#include <algorithm>

#include "core/parallel.h"

namespace lodestone {

namespace {

/// Factors linearized at the same time: enough for all cores, few enough for memory.
constexpr std::size_t kFactorsAtOnce = 1024;

/// Below this remaining share of a diagonal element, Cholesky's variances have fewer than five digits.
constexpr double kLeastPivotShare = 1e-11;

constexpr double kUnknownSigma = 1e6;

/// Jacobian by the tangents of the factor's variables, without columns of constant blocks.
Eigen::MatrixXd jacobian_of(const WindowFactor& factor, const std::unordered_map<const WindowBlock*, int>& numbers) {
  Eigen::MatrixXd jacobian = linearize(factor).jacobian;
  keep_columns(
      factor.blocks, [&](const WindowBlock* block) { return numbers.contains(block); }, jacobian);
  return jacobian;
}

}  // namespace

SparseInformation::SparseInformation(std::vector<const WindowBlock*> variables,
                                     std::span<const WindowFactor* const> factors) {
  Eigen::Index size = 0;
  for (const WindowBlock* block : variables) {
    numbers_.emplace(block, static_cast<int>(ranges_.size()));
    ranges_.push_back({size, block->tangent_size()});
    size += block->tangent_size();
  }
  std::vector<Clique> cliques;
  for (const WindowFactor* factor : factors) {
    Clique clique{factor, {}};
    for (const WindowBlock* block : factor->blocks) {
      const auto found = numbers_.find(block);
      if (found != numbers_.end()) clique.variables.push_back(found->second);
    }
    if (!clique.variables.empty()) cliques.push_back(std::move(clique));
  }
  lay_out(cliques);
  add_factors(cliques);
  const auto& values = information_.coeffs();
  if (!values.isFinite().all()) return;
  root_ = SparseTriangle::by_cholesky(information_);
  if (!root_ || root_->least_pivot_share(information_) < kLeastPivotShare) {
    by_qr_ = true;
    root_ = SparseTriangle::by_qr(whitened_rows(cliques), information_);
  }
}

void SparseInformation::lay_out(std::span<const Clique> cliques) {
  later_.resize(ranges_.size());
  for (const Clique& clique : cliques) {
    for (const int own : clique.variables) {
      for (const int other : clique.variables) {
        if (other > own) later_[static_cast<std::size_t>(own)].push_back(other);
      }
    }
  }
  const Eigen::Index size = ranges_.empty() ? 0 : ranges_.back().begin + ranges_.back().size;
  information_.resize(size, size);
  std::vector<std::int64_t> rows;
  for (std::size_t i = 0; i < ranges_.size(); ++i) {
    std::vector<int>& later = later_[i];
    std::sort(later.begin(), later.end());
    later.erase(std::unique(later.begin(), later.end()), later.end());
    for (Eigen::Index column = 0; column < ranges_[i].size; ++column) {
      for (Eigen::Index row = column; row < ranges_[i].size; ++row) rows.push_back(ranges_[i].begin + row);
      for (const int other : later) {
        const IndexRange& range = ranges_[static_cast<std::size_t>(other)];
        for (Eigen::Index row = 0; row < range.size; ++row) rows.push_back(range.begin + row);
      }
      information_.outerIndexPtr()[ranges_[i].begin + column + 1] = static_cast<std::int64_t>(rows.size());
    }
  }
  information_.resizeNonZeros(static_cast<Eigen::Index>(rows.size()));
  std::copy(rows.begin(), rows.end(), information_.innerIndexPtr());
  std::fill_n(information_.valuePtr(), rows.size(), 0.0);
}

void SparseInformation::add_factors(std::span<const Clique> cliques) {
  std::vector<Eigen::MatrixXd> shares(std::min(kFactorsAtOnce, cliques.size()));  // lower triangles
  for (std::size_t first = 0; first < cliques.size(); first += kFactorsAtOnce) {
    const std::size_t count = std::min(kFactorsAtOnce, cliques.size() - first);
    parallel_for(
        std::size_t{0}, count,
        [&](std::size_t i) {
          const Eigen::MatrixXd jacobian = jacobian_of(*cliques[first + i].factor, numbers_);
          shares[i].setZero(jacobian.cols(), jacobian.cols());
          shares[i].selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose());
        },
        4);
    for (std::size_t i = 0; i < count; ++i) add_share(cliques[first + i].variables, shares[i]);
  }
}

void SparseInformation::add_share(std::span<const int> variables, const Eigen::MatrixXd& share) {
  Eigen::Index column_begin = 0;
  for (const int own : variables) {
    const IndexRange& columns = ranges_[static_cast<std::size_t>(own)];
    Eigen::Index row_begin = 0;
    for (const int other : variables) {
      const IndexRange& rows = ranges_[static_cast<std::size_t>(other)];
      const Eigen::Index offset = other > own ? columns.size + offset_of(other, own) : 0;
      for (Eigen::Index column = 0; other >= own && column < columns.size; ++column) {
        // A column begins at its diagonal, `column` rows below its variable's first.
        double* to = information_.valuePtr() + information_.outerIndexPtr()[columns.begin + column] + offset - column;
        for (Eigen::Index row = other == own ? column : 0; row < rows.size; ++row) {
          const Eigen::Index i = row_begin + row;
          const Eigen::Index j = column_begin + column;
          to[row] += i >= j ? share(i, j) : share(j, i);
        }
      }
      row_begin += rows.size;
    }
    column_begin += columns.size;
  }
}

Eigen::Index SparseInformation::offset_of(int row_variable, int column_variable) const {
  Eigen::Index offset = 0;
  for (const int other : later_[static_cast<std::size_t>(column_variable)]) {
    if (other == row_variable) break;
    offset += ranges_[static_cast<std::size_t>(other)].size;
  }
  return offset;
}

SparseMatrix SparseInformation::whitened_rows(std::span<const Clique> cliques) const {
  std::vector<Eigen::MatrixXd> parts(cliques.size());
  parallel_for(
      std::size_t{0}, cliques.size(),
      [&](std::size_t i) {
        parts[i] = jacobian_of(*cliques[i].factor, numbers_);
        if (parts[i].rows() <= parts[i].cols()) return;
        const Eigen::HouseholderQR<Eigen::MatrixXd> triangle(parts[i]);
        const Eigen::Index size = parts[i].cols();
        parts[i] = triangle.matrixQR().topRows(size).triangularView<Eigen::Upper>().toDenseMatrix();
      },
      4);
  std::vector<Eigen::Triplet<double, std::int64_t>> entries;
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < cliques.size(); ++i) {
    Eigen::Index column = 0;
    for (const int variable : cliques[i].variables) {
      const IndexRange& range = ranges_[static_cast<std::size_t>(variable)];
      for (Eigen::Index j = 0; j < range.size; ++j, ++column) {
        for (Eigen::Index k = 0; k < parts[i].rows(); ++k) {
          if (parts[i](k, column) != 0.0) entries.emplace_back(row + k, range.begin + j, parts[i](k, column));
        }
      }
    }
    row += parts[i].rows();
  }
  for (Eigen::Index column = 0; column < information_.cols(); ++column)
    entries.emplace_back(row++, column, 1.0 / kUnknownSigma);
  SparseMatrix rows(row, information_.cols());
  rows.setFromTriplets(entries.begin(), entries.end());
  return rows;
}

Eigen::MatrixXd SparseInformation::covariance(std::span<const WindowBlock* const> variables) const {
  std::vector<IndexRange> ranges;
  Eigen::Index size = 0;
  for (const WindowBlock* block : variables) {
    ranges.push_back(ranges_[static_cast<std::size_t>(numbers_.at(block))]);
    size += ranges.back().size;
  }
  if (!root_) return kUnknownSigma * kUnknownSigma * Eigen::MatrixXd::Identity(size, size);
  return root_->covariance(ranges);
}

Eigen::MatrixXd SparseInformation::solve(const Eigen::MatrixXd& right) const {
  return root_ ? root_->solve(right) : (kUnknownSigma * kUnknownSigma * right).eval();
}

std::vector<Eigen::MatrixXd> SparseInformation::covariances() const {
  if (root_) return root_->diagonal_covariances(ranges_);
  std::vector<Eigen::MatrixXd> result;
  for (const IndexRange& range : ranges_) {
    result.push_back(kUnknownSigma * kUnknownSigma * Eigen::MatrixXd::Identity(range.size, range.size));
  }
  return result;
}

}  // namespace lodestone
