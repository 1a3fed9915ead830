#pragma once

#include <Eigen/Core>

namespace lodestone {

/// A block of a Jacobian as Ceres stores it, row by row.
template <int rows, int columns>
Eigen::Map<Eigen::Matrix<double, rows, columns, Eigen::RowMajor>> row_major(double* values) {
  return Eigen::Map<Eigen::Matrix<double, rows, columns, Eigen::RowMajor>>(values);
}

}  // namespace lodestone
