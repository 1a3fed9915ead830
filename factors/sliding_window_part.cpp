// Partial solution of the window, for alternating minimization.
#include <algorithm>

#include "factors/sliding_window_parts.h"

namespace lodestone {

int SlidingWindow::solve_part(Part part) {
  std::vector<double*> calibration;
  for (const auto& epoch : epochs_) {
    for (WindowBlock& bias : epoch->biases) calibration.push_back(bias.values.data());
  }
  for (std::size_t i = 0; i < matrices_priors_.size(); ++i) {
    if (matrices_priors_[i]) calibration.push_back(matrices_[i].values.data());
  }
  std::vector<double*> blocks;
  problem_->GetParameterBlocks(&blocks);
  std::vector<double*> constant;
  for (double* block : blocks) {
    const bool calibrates = std::ranges::find(calibration, block) != calibration.end();
    if (calibrates == (part == Part::magnetometers) || problem_->IsParameterBlockConstant(block)) continue;
    problem_->SetParameterBlockConstant(block);
    constant.push_back(block);
  }
  const int iterations = solve();
  for (double* block : constant) problem_->SetParameterBlockVariable(block);
  return iterations;
}

double SlidingWindow::cost() const {
  double sum = 0.0;
  for (const WindowFactor* factor : factors()) {
    std::vector<const double*> values;
    for (const WindowBlock* block : factor->blocks) values.push_back(block->values.data());
    Eigen::VectorXd residual(factor->function->num_residuals());
    factor->function->Evaluate(values.data(), residual.data(), nullptr);
    sum += 0.5 * residual.squaredNorm();
  }
  return sum;
}

}  // namespace lodestone
