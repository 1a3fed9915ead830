#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace lodestone {

/// Normal equations of variables of a few numbers each, sparse by blocks and factorized (Cholesky) in the order given.
/// Time and memory are linear in the number of variables where the order is that of time and none but a few last ones
/// touch all. Sums have a fixed order. Covariances come from the factorization by the recursion of Takahashi et al. (1973),
/// never from an inverse of the whole.
class BlockSystem {
 public:
  using Clique = std::vector<int>;

  /// `sizes`: of the variables, in the order of elimination. `cliques`: which variables each factor joins.
  BlockSystem(std::vector<int> sizes, std::span<const Clique> cliques);

  void clear();

  /// Adds a factor's share: `hessian` (symmetric) and `gradient` over the variables of `clique` one after the other. The clique
  /// must be one that the constructor was told, or part of one.
  void add(const Clique& clique, const Eigen::MatrixXd& hessian, const Eigen::VectorXd& gradient);

  /// Factorizes with the diagonal raised by the share `damping`; false where it is not positive.
  bool factorize(double damping);

  /// The Gauss-Newton step of the last factorization.
  void step(std::vector<double>& result) const;

  /// Diagonal blocks of the inverse, of the last factorization: one a variable.
  std::vector<Eigen::MatrixXd> covariances() const;

 private:
  using Rows = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;

  /// A variable's rows [own | later variables it is joined to, by elimination | gradient].
  struct Node {
    int size = 0;
    int width = 0;
    std::size_t begin = 0;         // of its rows
    std::size_t first = 0;         // of its numbers in a step
    std::vector<int> later;
    std::vector<int> columns;      // of each of `later`
  };
  Rows rows(std::vector<double>& of, std::size_t i) const { return {of.data() + nodes_[i].begin, nodes_[i].size, nodes_[i].width}; }
  int column_of(int own, int other) const;
  Eigen::MatrixXd gather(std::vector<double>& of, const Node& node) const;

  std::vector<Node> nodes_;
  std::vector<double> normal_;
  mutable std::vector<double> factor_;  // read only once factorized; Eigen's maps want it so
};

}  // namespace lodestone
