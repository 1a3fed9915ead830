#include "core/mapping/survey_errors.h"

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
/// Steps of the clock's offset, and the share of its sigma below which a step is the last.
constexpr int kSteps = 5;
constexpr double kSmallStep = 0.1;
/// Prior sigma of what is not estimated, in its unit.
constexpr double kHeld = 1e-9;
constexpr double kHuber = 1.345;  ///< 95 % efficiency for Gaussian errors (Huber 1981)
/// Median length of a vector of three standard normal components.
constexpr double kMedianLength = 1.538;

std::size_t count_magnetometers(const std::vector<FieldObservation>& observations) {
  int count = 0;
  for (const FieldObservation& one : observations) count = std::max(count, one.magnetometer + 1);
  return static_cast<std::size_t>(count);
}

struct Pass {
  std::size_t voxel = 0;
  int magnetometer = 0;
  Vector3 position = Vector3::Zero();
  Vector3 field_ut = Vector3::Zero();
  Matrix3 rotation = Matrix3::Zero();   ///< mean of R_map_mag
  Vector3 rate_ut_s = Vector3::Zero();  ///< of the reading, in the magnetometer's axes, then rotated
  int count = 0;
  Time first = 0;
  Time last = 0;

  double middle_s() const { return 0.5 * (to_seconds(first) + to_seconds(last)); }
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

/// Rates of change, from passes of the same magnetometer at least a voxel's edge before and after, since at less noise
/// would dominate. Zero where the magnetometer rests. `passes`: in order of their beginning.
void add_rates(std::vector<Pass>& passes, std::size_t magnetometers) {
  std::vector<std::vector<Pass*>> ways(magnetometers);
  for (Pass& pass : passes) ways[static_cast<std::size_t>(pass.magnetometer)].push_back(&pass);
  for (const std::vector<Pass*>& way : ways) {
    for (std::size_t i = 0; i < way.size(); ++i) {
      const auto is_far = [&](const Pass& other) { return (other.position - way[i]->position).norm() > kVoxel_m; };
      std::size_t first = i, last = i;
      while (first > 0 && way[i]->first - way[first - 1]->last < kPause && !is_far(*way[first])) --first;
      while (last + 1 < way.size() && way[last + 1]->first - way[i]->last < kPause && !is_far(*way[last])) ++last;
      const Pass& before = *way[first];
      const Pass& after = *way[last];
      if ((after.position - before.position).norm() < kVoxel_m) continue;
      const double duration_s = after.middle_s() - before.middle_s();
      if (!(duration_s > 0.0)) continue;
      const Vector3 change =
          after.rotation.transpose() * after.field_ut - before.rotation.transpose() * before.field_ut;
      way[i]->rate_ut_s = way[i]->rotation * change / duration_s;
    }
  }
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

/// The unknowns are the offsets of all magnetometers, and the clock's offset in seconds, the last.
class ErrorFit {
 public:
  /// `clock_s`: of which the passes are free already.
  ErrorFit(std::vector<Pass> passes, std::size_t magnetometers, const SurveyErrorSigmas& sigmas, double clock_s)
      : passes_(std::move(passes)),
        weights_(passes_.size(), 1.0),
        errors_(Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(magnetometers) + 1)),
        prior_(errors_.size()),
        prior_mean_(Eigen::VectorXd::Zero(errors_.size())) {
    const auto information = [](double sigma) { return 1.0 / std::pow(sigma > 0.0 ? sigma : kHeld, 2); };
    prior_.setConstant(information(sigmas.offset_ut));
    prior_.tail<1>().setConstant(information(sigmas.clock_s));
    prior_mean_.tail<1>().setConstant(-clock_s);
    mean_square_slope_ = std::max(mean_square_slope(passes_, magnetometers), 1e-6);
    add_rates(passes_, magnetometers);
    std::stable_sort(passes_.begin(), passes_.end(), [](const Pass& a, const Pass& b) { return a.voxel < b.voxel; });
  }

  SurveyErrors run() {
    for (int round = 0; round < kRounds && weigh(); ++round) solve();
    SurveyErrors result;
    for (Eigen::Index j = 0; j + 1 < errors_.size(); j += 3) result.offsets_ut.emplace_back(errors_.segment<3>(j));
    result.clock_s = errors_.tail<1>().value();
    result.clock_sigma_s = clock_sigma_s_;
    return result;
  }

 private:
  Vector3 without_error(const Pass& pass) const {
    return pass.field_ut - pass.rotation * errors_.segment<3>(3 * pass.magnetometer) +
           errors_.tail<1>().value() * pass.rate_ut_s;
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

  /// Huber weights by the residuals at the present errors; false if no place was passed twice.
  bool weigh() {
    std::vector<double> lengths;
    std::vector<double> length_of(passes_.size(), 0.0);
    for_each_shared_voxel(passes_, [&](std::size_t begin, std::size_t end) {
      const auto voxel = factor(begin, end);
      Eigen::Matrix<double, 4, 3> right = Eigen::Matrix<double, 4, 3>::Zero();
      for (std::size_t i = begin; i < end; ++i) {
        right += weights_[i] * row(i, begin) * without_error(passes_[i]).transpose();
      }
      const Eigen::Matrix<double, 4, 3> field = voxel.solve(right);
      for (std::size_t i = begin; i < end; ++i) {
        // A residual from the fit is smaller than the error of a pass by the square root of `share`.
        const double share = 1.0 - weights_[i] * row(i, begin).dot(voxel.solve(row(i, begin)));
        const double residual = (without_error(passes_[i]) - field.transpose() * row(i, begin)).norm();
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
    const Eigen::Index size = errors_.size();
    const Eigen::Index clock = size - 1;
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
        const Vector3 across = weights_[i] * pass.rotation.transpose() * pass.rate_ut_s;
        information.block<3, 3>(at, at) += weights_[i] * pass.rotation.transpose() * pass.rotation;
        information.block<3, 1>(at, clock) -= across;
        information.block<1, 3>(clock, at) -= across.transpose();
        information(clock, clock) += weights_[i] * pass.rate_ut_s.squaredNorm();
        right.segment<3>(at) += weights_[i] * pass.rotation.transpose() * pass.field_ut;
        right[clock] -= weights_[i] * pass.rate_ut_s.dot(pass.field_ut);
        // With L of L Lᵀ = `factor`: the voxel's field and slopes have the unit matrix as information.
        const Eigen::Vector4d whitened = voxel.matrixL().solve(row(i, begin));
        for (Eigen::Index k = 0; k < 4; ++k) {
          coupling.block<3, 3>(3 * k, at) += weights_[i] * whitened[k] * pass.rotation;
          coupling.block<3, 1>(3 * k, clock) -= weights_[i] * whitened[k] * pass.rate_ut_s;
          field.segment<3>(3 * k) += weights_[i] * whitened[k] * pass.field_ut;
        }
      }
      information -= coupling.transpose() * coupling;
      right -= coupling.transpose() * field;
    });
    const double scale = 1.0 / (kVoxelsAlike * sigma_ut_ * sigma_ut_);
    information *= scale;
    information.diagonal() += prior_;
    const Eigen::LDLT<Eigen::MatrixXd> factor(information);
    errors_ = factor.solve(scale * right + prior_.cwiseProduct(prior_mean_));
    clock_sigma_s_ = std::sqrt(factor.solve(Eigen::VectorXd::Unit(size, clock))[clock]);
  }

  std::vector<Pass> passes_;
  std::vector<double> weights_;
  Eigen::VectorXd errors_;
  Eigen::VectorXd prior_;  ///< information
  Eigen::VectorXd prior_mean_;
  double mean_square_slope_ = 0.0;
  double sigma_ut_ = 1.0;
  double clock_sigma_s_ = 0.0;
};

/// Poses of one magnetometer, in order of time.
class Way {
 public:
  void add(const FieldObservation& one) { observations_.push_back(one); }
  void sort() { std::ranges::stable_sort(observations_, {}, &FieldObservation::time); }

  /// Between the two observations round `time`; in a pause, and beyond the ends, as the two nearest move.
  void set_pose(Time time, FieldObservation& one) const {
    if (observations_.size() < 2) return;
    const auto first = observations_.begin() + 1;
    const auto last = observations_.end() - 1;
    auto after = std::clamp(std::ranges::upper_bound(observations_, time, {}, &FieldObservation::time), first, last);
    if (after->time - (after - 1)->time > kPause) {
      const bool near_begin = time - (after - 1)->time < after->time - time;
      after = near_begin ? std::max(after - 1, first) : std::min(after + 1, last);
    }
    const FieldObservation& a = *(after - 1);
    const FieldObservation& b = *after;
    if (b.time == a.time || b.time - a.time > kPause) return;
    const double share = to_seconds(time - a.time) / to_seconds(b.time - a.time);
    one.position = a.position + share * (b.position - a.position);
    one.R_map_mag = a.R_map_mag.slerp(share, b.R_map_mag);
  }

 private:
  std::vector<FieldObservation> observations_;
};

}  // namespace

SurveyErrors survey_errors(const std::vector<FieldObservation>& observations, const SurveyErrorSigmas& sigmas) {
  const std::size_t magnetometers = count_magnetometers(observations);
  if (magnetometers == 0) return {};
  SurveyErrors result;
  // Rates of change are those between voxels, and noisy, so that a step is too small.
  for (int step = 0; step < kSteps; ++step) {
    const double before_s = result.clock_s;
    std::vector<Pass> passes =
        before_s == 0.0 ? passes_of(observations) : passes_of(without_errors(observations, {{}, before_s}));
    result = ErrorFit(std::move(passes), magnetometers, sigmas, before_s).run();
    const double step_s = result.clock_s;
    result.clock_s += before_s;
    if (sigmas.clock_s == 0.0 || std::abs(step_s) < kSmallStep * result.clock_sigma_s) break;
  }
  if (sigmas.clock_s == 0.0) result.clock_s = result.clock_sigma_s = 0.0;
  if (sigmas.offset_ut == 0.0) result.offsets_ut.clear();
  return result;
}

std::vector<FieldObservation> without_errors(std::vector<FieldObservation> observations, const SurveyErrors& errors) {
  if (errors.clock_s != 0.0) {
    std::vector<Way> ways(count_magnetometers(observations));
    for (const FieldObservation& one : observations) {
      if (one.magnetometer >= 0) ways[static_cast<std::size_t>(one.magnetometer)].add(one);
    }
    for (Way& way : ways) way.sort();
    for (FieldObservation& one : observations) {
      if (one.magnetometer < 0) continue;
      const Vector3 reading_ut = one.R_map_mag.conjugate() * one.field_ut;
      ways[static_cast<std::size_t>(one.magnetometer)].set_pose(one.time - from_seconds(errors.clock_s), one);
      one.field_ut = one.R_map_mag * reading_ut;
    }
  }
  for (FieldObservation& one : observations) {
    if (one.magnetometer < 0 || one.magnetometer >= static_cast<int>(errors.offsets_ut.size())) continue;
    one.field_ut -= one.R_map_mag * errors.offsets_ut[static_cast<std::size_t>(one.magnetometer)];
  }
  return observations;
}

double mean_square_offset(const std::vector<Vector3>& offsets_ut) {
  double sum = 0.0;
  for (const Vector3& offset : offsets_ut) sum += offset.squaredNorm() / 3.0;
  return offsets_ut.empty() ? 0.0 : sum / static_cast<double>(offsets_ut.size());
}

}  // namespace lodestone
