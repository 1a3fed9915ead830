#include "factors/marginalization.h"

#include <Eigen/QR>
#include <algorithm>

namespace lodestone {

namespace {

struct Columns {
  std::vector<WindowBlock*> blocks;
  std::vector<int> starts;
  int size = 0;

  void add(WindowBlock* block) {
    if (std::find(blocks.begin(), blocks.end(), block) != blocks.end()) return;
    blocks.push_back(block);
    starts.push_back(size);
    size += block->tangent_size();
  }

  int start(const WindowBlock* block) const {
    return starts[static_cast<std::size_t>(std::find(blocks.begin(), blocks.end(), block) - blocks.begin())];
  }
};

}  // namespace

MarginalPrior marginalize(std::span<const WindowFactor> factors, std::span<WindowBlock* const> eliminated,
                          std::span<const Eigen::MatrixXd> disturbances) {
  Columns columns;
  for (WindowBlock* block : eliminated) columns.add(block);
  const int eliminated_size = columns.size;
  Eigen::Index rows = 0;
  for (const WindowFactor& factor : factors) {
    for (WindowBlock* block : factor.blocks) columns.add(block);
    rows += factor.function->num_residuals();
  }

  Eigen::Index errors = 0;
  for (const Eigen::MatrixXd& disturbance : disturbances) errors = std::max(errors, disturbance.cols());

  // [eliminated | remaining | residual | disturbances]
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(rows, columns.size + 1 + errors);
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < factors.size(); ++i) {
    const WindowFactor& factor = factors[i];
    const LinearizedFactor part = linearize(factor);
    int column = 0;
    for (WindowBlock* block : factor.blocks) {
      const int size = block->tangent_size();
      system.block(row, columns.start(block), part.residual.size(), size) += part.jacobian.middleCols(column, size);
      column += size;
    }
    system.block(row, columns.size, part.residual.size(), 1) = part.residual;
    if (i < disturbances.size() && disturbances[i].size() > 0) {
      system.block(row, columns.size + 1, part.residual.size(), disturbances[i].cols()) = disturbances[i];
    }
    row += part.residual.size();
  }

  MarginalPrior prior;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factorization(system.leftCols(eliminated_size));
  Eigen::MatrixXd rest = system.rightCols(columns.size + 1 + errors - eliminated_size);
  rest.applyOnTheLeft(factorization.householderQ().adjoint());
  Eigen::MatrixXd remaining = rest.bottomRows(rows - factorization.rank());
  const Eigen::Index kept = columns.size - eliminated_size;
  if (remaining.rows() > kept) {
    // Triangular in the remaining variables; rows below contribute only a constant cost.
    Eigen::HouseholderQR<Eigen::MatrixXd> triangle(remaining.leftCols(kept));
    Eigen::MatrixXd right = remaining.rightCols(1 + errors);
    right.applyOnTheLeft(triangle.householderQ().adjoint());
    Eigen::MatrixXd compressed(kept, kept + 1 + errors);
    compressed.leftCols(kept) = triangle.matrixQR().topRows(kept).triangularView<Eigen::Upper>();
    compressed.rightCols(1 + errors) = right.topRows(kept);
    remaining = compressed;
  }
  prior.root = remaining.leftCols(kept);
  prior.offset = remaining.col(kept);
  prior.disturbance = remaining.rightCols(errors);

  prior.blocks.assign(columns.blocks.begin() + static_cast<std::ptrdiff_t>(eliminated.size()), columns.blocks.end());
  return prior;
}

}  // namespace lodestone
