#include "factors/block_system.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <stdexcept>

namespace lodestone {

BlockSystem::BlockSystem(std::vector<int> sizes, std::span<const Clique> cliques) : nodes_(sizes.size()) {
  for (std::size_t i = 0; i < sizes.size(); ++i) nodes_[i].size = sizes[i];
  const auto join = [](std::vector<int>& set, int value) {
    const auto place = std::lower_bound(set.begin(), set.end(), value);
    if (place == set.end() || *place != value) set.insert(place, value);
  };
  for (const Clique& clique : cliques) {
    if (clique.empty()) continue;
    const int first = *std::min_element(clique.begin(), clique.end());
    for (const int other : clique) {
      if (other != first) join(nodes_[static_cast<std::size_t>(first)].later, other);
    }
  }
  std::size_t end = 0;
  std::size_t number = 0;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    Node& node = nodes_[i];
    // Eliminating a variable joins all that it was joined to: the first of them hears of the others.
    for (std::size_t j = 1; j < node.later.size(); ++j) {
      join(nodes_[static_cast<std::size_t>(node.later.front())].later, node.later[j]);
    }
    node.width = node.size;
    for (const int other : node.later) {
      node.columns.push_back(node.width);
      node.width += nodes_[static_cast<std::size_t>(other)].size;
    }
    ++node.width;  // the gradient
    node.begin = end;
    node.first = number;
    end += static_cast<std::size_t>(node.size * node.width);
    number += static_cast<std::size_t>(node.size);
  }
  normal_.assign(end, 0.0);
}

void BlockSystem::clear() { std::fill(normal_.begin(), normal_.end(), 0.0); }

int BlockSystem::column_of(int own, int other) const {
  if (own == other) return 0;
  const Node& node = nodes_[static_cast<std::size_t>(own)];
  const auto place = std::find(node.later.begin(), node.later.end(), other);
  if (place == node.later.end()) throw std::logic_error("BlockSystem: a factor joins variables that it did not name");
  return node.columns[static_cast<std::size_t>(place - node.later.begin())];
}

void BlockSystem::add(const Clique& clique, const Eigen::MatrixXd& hessian, const Eigen::VectorXd& gradient) {
  Eigen::Index row = 0;
  for (const int own : clique) {
    const int size = nodes_[static_cast<std::size_t>(own)].size;
    Rows to = rows(normal_, static_cast<std::size_t>(own));
    Eigen::Index column = 0;
    for (const int other : clique) {
      const int other_size = nodes_[static_cast<std::size_t>(other)].size;
      if (other >= own) to.block(0, column_of(own, other), size, other_size) += hessian.block(row, column, size, other_size);
      column += other_size;
    }
    to.rightCols<1>() += gradient.segment(row, size);
    row += size;
  }
}

bool BlockSystem::factorize(double damping) {
  factor_ = normal_;
  Eigen::MatrixXd update;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const Node& node = nodes_[i];
    Rows own = rows(factor_, i);
    own.leftCols(node.size).diagonal() += damping * rows(normal_, i).leftCols(node.size).diagonal();
    // H = L Lᵀ: L goes to the own block, L⁻¹ times the rest to its place.
    const Eigen::LLT<Eigen::MatrixXd> root(own.leftCols(node.size));
    if (root.info() != Eigen::Success) return false;
    own.leftCols(node.size) = root.matrixL();
    auto rest = own.rightCols(node.width - node.size);
    root.matrixL().solveInPlace(rest);
    for (std::size_t a = 0; a < node.later.size(); ++a) {
      const Node& target = nodes_[static_cast<std::size_t>(node.later[a])];
      Rows to = rows(factor_, static_cast<std::size_t>(node.later[a]));
      const int from = node.columns[a];
      update.noalias() = own.middleCols(from, target.size).transpose() * own.rightCols(node.width - from);
      for (std::size_t b = a; b < node.later.size(); ++b) {
        const int size = nodes_[static_cast<std::size_t>(node.later[b])].size;
        to.middleCols(column_of(node.later[a], node.later[b]), size) -= update.middleCols(node.columns[b] - from, size);
      }
      to.rightCols<1>() -= update.rightCols<1>();
    }
  }
  return true;
}

void BlockSystem::step(std::vector<double>& result) const {
  result.assign(nodes_.empty() ? 0 : nodes_.back().first + static_cast<std::size_t>(nodes_.back().size), 0.0);
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    const Node& node = nodes_[i];
    const Rows own = rows(factor_, i);
    Eigen::VectorXd right = -own.rightCols<1>();
    for (std::size_t j = 0; j < node.later.size(); ++j) {
      const Node& other = nodes_[static_cast<std::size_t>(node.later[j])];
      right.noalias() -=
          own.middleCols(node.columns[j], other.size) * Eigen::Map<const Eigen::VectorXd>(result.data() + other.first, other.size);
    }
    own.leftCols(node.size).triangularView<Eigen::Lower>().transpose().solveInPlace(right);
    Eigen::Map<Eigen::VectorXd>(result.data() + node.first, node.size) = right;
  }
}

Eigen::MatrixXd BlockSystem::gather(std::vector<double>& of, const Node& node) const {
  const int size = node.width - node.size - 1;
  Eigen::MatrixXd result(size, size);
  for (std::size_t a = 0; a < node.later.size(); ++a) {
    const Rows from = rows(of, static_cast<std::size_t>(node.later[a]));
    for (std::size_t b = a; b < node.later.size(); ++b) {
      const int columns = nodes_[static_cast<std::size_t>(node.later[b])].size;
      const auto block = from.middleCols(column_of(node.later[a], node.later[b]), columns);
      result.block(node.columns[a] - node.size, node.columns[b] - node.size, block.rows(), columns) = block;
      result.block(node.columns[b] - node.size, node.columns[a] - node.size, columns, block.rows()) = block.transpose();
    }
  }
  return result;
}

std::vector<Eigen::MatrixXd> BlockSystem::covariances() const {
  // Of the inverse only those blocks where the factor has one are needed, and they need no others.
  std::vector<double> inverse(factor_.size());
  std::vector<Eigen::MatrixXd> result(nodes_.size());
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    const Node& node = nodes_[i];
    const Rows own = rows(factor_, i);
    const auto root = own.leftCols(node.size).triangularView<Eigen::Lower>();
    const Eigen::MatrixXd unit = root.solve(Eigen::MatrixXd::Identity(node.size, node.size));
    Eigen::MatrixXd block = unit.transpose() * unit;
    Rows to = rows(inverse, i);
    if (!node.later.empty()) {
      const Eigen::MatrixXd gain = unit.transpose() * own.middleCols(node.size, node.width - node.size - 1);
      const Eigen::MatrixXd cross = -gain * gather(inverse, node);
      block.noalias() -= cross * gain.transpose();
      to.middleCols(node.size, node.width - node.size - 1) = cross;
    }
    result[i] = 0.5 * (block + block.transpose());
    to.leftCols(node.size) = result[i];
  }
  return result;
}

}  // namespace lodestone
