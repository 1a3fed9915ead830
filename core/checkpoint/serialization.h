#pragma once

#include <cereal/archives/binary.hpp>
#include <cereal/types/string.hpp>
#include <cereal/types/vector.hpp>
#include <cstdint>

#include "core/checkpoint/archives.h"
#include "core/geometry/nav_state.h"
#include "core/measurements.h"
#include "core/observability/degeneracy.h"
#include "core/lidar/condensed_cost.h"

// How the core's values go into a checkpoint. Structures are taken apart by structured bindings: one that gets another
// field does not compile here until it is said what becomes of it.

namespace cereal {

template <class Archive, class Scalar, int Rows, int Columns, int Options, int MaxRows, int MaxColumns>
void save(Archive& archive, const Eigen::Matrix<Scalar, Rows, Columns, Options, MaxRows, MaxColumns>& matrix) {
  const auto rows = static_cast<std::int64_t>(matrix.rows());
  const auto columns = static_cast<std::int64_t>(matrix.cols());
  archive(rows, columns);
  archive(binary_data(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(Scalar)));
}

template <class Archive, class Scalar, int Rows, int Columns, int Options, int MaxRows, int MaxColumns>
void load(Archive& archive, Eigen::Matrix<Scalar, Rows, Columns, Options, MaxRows, MaxColumns>& matrix) {
  std::int64_t rows = 0;
  std::int64_t columns = 0;
  archive(rows, columns);
  matrix.resize(rows, columns);
  archive(binary_data(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(Scalar)));
}

template <class Archive, class Scalar, int Options>
void serialize(Archive& archive, Eigen::Quaternion<Scalar, Options>& quaternion) {
  archive(quaternion.coeffs());
}

}  // namespace cereal

namespace lodestone {

template <class Archive>
void serialize(Archive& archive, Pose& pose) {
  auto& [rotation, position] = pose;
  archive(rotation, position);
}

template <class Archive>
void serialize(Archive& archive, NavState& state) {
  auto& [pose, velocity, gyroscope_bias, accelerometer_bias, gravity] = state;
  archive(pose, velocity, gyroscope_bias, accelerometer_bias, gravity);
}

template <class Archive>
void serialize(Archive& archive, ImuSample& sample) {
  auto& [time, angular_velocity, linear_acceleration] = sample;
  archive(time, angular_velocity, linear_acceleration);
}

template <class Archive>
void serialize(Archive& archive, CondensedCost& cost) {
  auto& [moment, centroid, anchor, spurious_information, weight_sum, range_rms_m, count] = cost;
  archive(moment, centroid, anchor, spurious_information, weight_sum, range_rms_m, count);
}

template <class Archive>
void serialize(Archive& archive, Degeneracy& degeneracy) {
  auto& [directions, sigma_m, kept, lever_arm_m, degenerate_directions] = degeneracy;
  archive(directions, sigma_m, kept, lever_arm_m, degenerate_directions);
}

}  // namespace lodestone
