#include "core/mapping/survey_offsets.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "core/bit_mix.h"
#include "core/middle_value.h"

namespace lodestone {
namespace {

constexpr double kVoxel_m = 0.1;
/// Readings of one magnetometer in one voxel with a longer pause between them belong to two passes.
constexpr Time kPause = from_seconds(1.0);
/// Errors of a drive's poses are alike over about 2 m of way, so 20 voxels say as much as one (docs/design/046).
constexpr double kVoxelsAlike = 20.0;
constexpr int kRounds = 10;
constexpr double kHuber = 1.345;  ///< 95 % efficiency for Gaussian errors (Huber 1981)
/// Median length of a vector of three standard normal components.
constexpr double kMedianLength = 1.538;

struct Pass {
  std::size_t voxel = 0;
  int magnetometer = 0;
  Vector3 position = Vector3::Zero();
  Vector3 field_ut = Vector3::Zero();
  Matrix3 rotation = Matrix3::Zero();  ///< mean of R_map_mag
  int count = 0;
  Time first = 0;
  Time last = 0;
};

/// Passes in order of their beginning; voxels are numbered in order of the readings.
std::vector<Pass> passes_of(const std::vector<FieldObservation>& observations) {
  struct Hash {
    std::size_t operator()(const std::array<std::int64_t, 4>& key) const {
      std::uint64_t hash = 0;
      for (const std::int64_t part : key) hash = mix(hash ^ static_cast<std::uint64_t>(part));
      return hash;
    }
  };
  std::unordered_map<std::array<std::int64_t, 4>, std::size_t, Hash> voxel_of, pass_of;
  std::vector<Pass> passes;
  for (const FieldObservation& one : observations) {
    if (one.magnetometer < 0 || !one.position.allFinite() || !one.field_ut.allFinite()) continue;
    std::array<std::int64_t, 4> key{0, 0, 0, -1};
    for (std::size_t i = 0; i < 3; ++i) {
      key[i] = static_cast<std::int64_t>(std::floor(one.position[static_cast<Eigen::Index>(i)] / kVoxel_m));
    }
    const std::size_t voxel = voxel_of.try_emplace(key, voxel_of.size()).first->second;
    key[3] = one.magnetometer;
    const auto [found, added] = pass_of.try_emplace(key, passes.size());
    if (!added && std::abs(one.time - passes[found->second].last) > kPause) found->second = passes.size();
    if (found->second == passes.size()) {
      passes.push_back({voxel, one.magnetometer});
      passes.back().first = one.time;
    }
    Pass& pass = passes[found->second];
    pass.position += one.position;
    pass.field_ut += one.field_ut;
    pass.rotation += one.R_map_mag.toRotationMatrix();
    pass.last = one.time;
    ++pass.count;
  }
  for (Pass& pass : passes) {
    pass.position /= pass.count;
    pass.field_ut /= pass.count;
    pass.rotation /= pass.count;
  }
  return passes;
}

/// Mean square of the field's slope in one component and direction, (µT/m)²: of passes that follow each other, so that
/// no offset affects it. `passes`: in order of their beginning.
double mean_square_slope(const std::vector<Pass>& passes, std::size_t magnetometers) {
  std::vector<const Pass*> before(magnetometers, nullptr);
  double squared_ut = 0.0, squared_m = 0.0;
  for (const Pass& pass : passes) {
    const Pass*& previous = before[static_cast<std::size_t>(pass.magnetometer)];
    if (previous != nullptr && pass.first - previous->last < kPause) {
      squared_ut += (pass.field_ut - previous->field_ut).squaredNorm() / 3.0;
      squared_m += (pass.position - previous->position).squaredNorm();
    }
    previous = &pass;
  }
  return squared_m > 0.0 ? squared_ut / squared_m : 0.0;
}

/// Calls visit(begin, end) for the passes of every voxel with more than one.
template <class Visit>
void for_each_shared_voxel(const std::vector<Pass>& passes, const Visit& visit) {
  for (std::size_t begin = 0, end = 0; begin < passes.size(); begin = end) {
    while (end < passes.size() && passes[end].voxel == passes[begin].voxel) ++end;
    if (end - begin > 1) visit(begin, end);
  }
}

class OffsetFit {
 public:
  OffsetFit(std::vector<Pass> passes, std::size_t magnetometers, double sigma_ut)
      : passes_(std::move(passes)),
        weights_(passes_.size(), 1.0),
        offsets_(Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(magnetometers))),
        prior_(1.0 / (sigma_ut * sigma_ut)),
        mean_square_slope_(std::max(mean_square_slope(passes_, magnetometers), 1e-6)) {
    std::stable_sort(passes_.begin(), passes_.end(), [](const Pass& a, const Pass& b) { return a.voxel < b.voxel; });
  }

  std::vector<Vector3> run() {
    for (int round = 0; round < kRounds && weigh(); ++round) solve();
    std::vector<Vector3> result;
    for (Eigen::Index j = 0; j < offsets_.size(); j += 3) result.emplace_back(offsets_.segment<3>(j));
    return result;
  }

 private:
  Vector3 without_offset(const Pass& pass) const {
    return pass.field_ut - pass.rotation * offsets_.segment<3>(3 * pass.magnetometer);
  }

  /// Coefficients of the voxel's field and slopes in pass i of the voxel that begins with pass `begin`.
  Eigen::Vector4d row(std::size_t i, std::size_t begin) const {
    Eigen::Vector4d result;
    result << 1.0, passes_[i].position - passes_[begin].position;
    return result;
  }

  /// Information of one component of the voxel's field and slopes, in units of 1/sigma².
  Eigen::LLT<Eigen::Matrix4d> factor(std::size_t begin, std::size_t end) const {
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    information.diagonal().tail<3>().setConstant(sigma_ut_ * sigma_ut_ / mean_square_slope_);
    for (std::size_t i = begin; i < end; ++i) information += weights_[i] * row(i, begin) * row(i, begin).transpose();
    return information.llt();
  }

  /// Huber weights by the residuals at the present offsets; false if no place was passed twice.
  bool weigh() {
    std::vector<double> lengths;
    std::vector<double> length_of(passes_.size(), 0.0);
    for_each_shared_voxel(passes_, [&](std::size_t begin, std::size_t end) {
      const auto voxel = factor(begin, end);
      Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
      for (std::size_t i = begin; i < end; ++i) {
        right += weights_[i] * row(i, begin) * without_offset(passes_[i]).transpose();
      }
      const Eigen::Matrix<double, 4, 3> field = voxel.solve(right);
      for (std::size_t i = begin; i < end; ++i) {
        // A residual from the fit is smaller than the error of a pass by the square root of `share`.
        const double share = 1.0 - weights_[i] * row(i, begin).dot(voxel.solve(row(i, begin)));
        const double residual = (without_offset(passes_[i]) - field.transpose() * row(i, begin)).norm();
        length_of[i] = residual / std::sqrt(std::max(share, 1e-9));
        lengths.push_back(length_of[i]);
      }
    });
    if (lengths.empty()) return false;
    sigma_ut_ = std::max(value_at_share(lengths, 0.5) / kMedianLength, 1e-6);
    for (std::size_t i = 0; i < passes_.size(); ++i) {
      const double limit = kHuber * std::sqrt(3.0) * sigma_ut_;
      weights_[i] = length_of[i] > limit ? limit / length_of[i] : 1.0;
    }
    return true;
  }

  void solve() {
    const Eigen::Index size = offsets_.size();
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    // Rows 0 to 2 for the voxel's field, 3 to 11 for its slopes.
    Eigen::MatrixXd coupling(12, size);
    Eigen::Matrix<double, 12, 1> field;
    for_each_shared_voxel(passes_, [&](std::size_t begin, std::size_t end) {
      const auto voxel = factor(begin, end);
      coupling.setZero();
      field.setZero();
      for (std::size_t i = begin; i < end; ++i) {
        const Pass& pass = passes_[i];
        const Eigen::Index at = 3 * pass.magnetometer;
        information.block<3, 3>(at, at) += weights_[i] * pass.rotation.transpose() * pass.rotation;
        right.segment<3>(at) += weights_[i] * pass.rotation.transpose() * pass.field_ut;
        // With L of L Lᵀ = `factor`: the voxel's field and slopes have the unit matrix as information.
        const Eigen::Vector4d whitened = voxel.matrixL().solve(row(i, begin));
        for (Eigen::Index k = 0; k < 4; ++k) {
          coupling.block<3, 3>(3 * k, at) += weights_[i] * whitened[k] * pass.rotation;
          field.segment<3>(3 * k) += weights_[i] * whitened[k] * pass.field_ut;
        }
      }
      information -= coupling.transpose() * coupling;
      right -= coupling.transpose() * field;
    });
    const double scale = 1.0 / (kVoxelsAlike * sigma_ut_ * sigma_ut_);
    information *= scale;
    information.diagonal().array() += prior_;
    offsets_ = information.ldlt().solve(scale * right);
  }

  std::vector<Pass> passes_;
  std::vector<double> weights_;
  Eigen::VectorXd offsets_;
  double prior_;
  double mean_square_slope_;
  double sigma_ut_ = 1.0;
};

}  // namespace

std::vector<Vector3> survey_offsets(const std::vector<FieldObservation>& observations, double offset_sigma_ut) {
  int count = 0;
  for (const FieldObservation& one : observations) count = std::max(count, one.magnetometer + 1);
  if (count == 0) return {};
  const auto magnetometers = static_cast<std::size_t>(count);
  return OffsetFit(passes_of(observations), magnetometers, offset_sigma_ut).run();
}

std::vector<FieldObservation> without_offsets(std::vector<FieldObservation> observations,
                                              const std::vector<Vector3>& offsets_ut) {
  for (FieldObservation& one : observations) {
    if (one.magnetometer < 0 || one.magnetometer >= static_cast<int>(offsets_ut.size())) continue;
    one.field_ut -= one.R_map_mag * offsets_ut[static_cast<std::size_t>(one.magnetometer)];
  }
  return observations;
}

double mean_square_offset(const std::vector<Vector3>& offsets_ut) {
  double sum = 0.0;
  for (const Vector3& offset : offsets_ut) sum += offset.squaredNorm() / 3.0;
  return offsets_ut.empty() ? 0.0 : sum / static_cast<double>(offsets_ut.size());
}

}  // namespace lodestone
