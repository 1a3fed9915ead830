// Map errors over tens of metres. Scans and readings share them, but on a path of minutes they cannot be distinguished
// from motion. They are therefore considered, not estimated (Schmidt, Advances in Control Systems 1966): they increase
// covariances and leave estimates unchanged (docs/design/042-repeated-map-error.md,
// docs/design/063-displacement-between-the-maps.md).
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "core/parallel.h"
#include "factors/sliding_window_parts.h"
#include "factors/sparse_information.h"

namespace lodestone {

namespace {

constexpr Eigen::Index kCloud = 6;  // components of the cloud map's error
constexpr Eigen::Index kField = 3;  // of the field map's displacement against the cloud map
constexpr Eigen::Index kSize = kCloud + kField;

/// Columns that are solved for together, and how many such groups at the same time: enough for all cores, few enough
/// for memory.
constexpr Eigen::Index kColumns = 16;
constexpr Eigen::Index kAtOnce = 8;

/// Compresses to at most as many columns as rows, with the same D Dᵀ.
Eigen::MatrixXd compressed(const Eigen::MatrixXd& columns) {
  if (columns.cols() <= columns.rows()) return columns;
  const Eigen::HouseholderQR<Eigen::MatrixXd> triangle(columns.transpose());
  const Eigen::MatrixXd upper = triangle.matrixQR().topRows(columns.rows()).triangularView<Eigen::Upper>();
  return upper.transpose();
}

}  // namespace

/// A scan's error is L u, with u of its stretch of the path: components of unit variance. The last three are those of
/// the field map, and do not act on the scan. From stretch to stretch u = decay u_before + √(1 − decay²) w. The sources
/// are u of the first stretch and all w; u of each stretch is the sum of the sources with its `weights`.
struct SlidingWindow::LongErrors {
  Eigen::Index sources = 0;
  std::unordered_map<const MapErrorEpoch*, Eigen::VectorXd> weights;  // for look-up only
};

SlidingWindow::LongErrors SlidingWindow::long_errors() const {
  LongErrors result;
  for (std::size_t i = 0; i < map_errors_.size(); ++i) {
    if (i == 0 || map_errors_[i]->long_decay < 1.0) ++result.sources;
  }
  Eigen::VectorXd now = Eigen::VectorXd::Zero(result.sources);
  Eigen::Index source = 0;
  for (std::size_t i = 0; i < map_errors_.size(); ++i) {
    const double decay = i == 0 ? 0.0 : map_errors_[i]->long_decay;
    if (decay < 1.0) {
      now *= decay;
      now[source++] = std::sqrt(1.0 - decay * decay);
    }
    result.weights.emplace(map_errors_[i].get(), now);
  }
  return result;
}

/// Columns: those of the sources of `errors`, kSize each; then independent ones from marginalized keyframes.
Eigen::MatrixXd SlidingWindow::prior_disturbance(const LongErrors& errors) const {
  const Eigen::Index known = kSize * prior_sources_;
  const Eigen::Index independent = prior_disturbance_.cols() - known;
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(prior_.content().root().rows(), kSize * errors.sources + independent);
  if (prior_disturbance_.cols() == 0) return result;
  result.leftCols(known) = prior_disturbance_.leftCols(known);
  result.rightCols(independent) = prior_disturbance_.rightCols(independent);
  return result;
}

/// The factors of a keyframe that map errors act on: its scan, and its readings if the map of the field may be
/// displaced against that of the cloud.
std::vector<const WindowFactor*> SlidingWindow::disturbed(const KeyframeFactors& keyframe) const {
  std::vector<const WindowFactor*> result;
  if (keyframe.lidar && keyframe.map_error != nullptr) result.push_back(&keyframe.lidar);
  if (!(calibration_.magnetometers.survey_pose_sigma_m > 0.0)) return result;
  for (const WindowFactor& field : keyframe.fields) {
    if (field) result.push_back(&field);
  }
  return result;
}

/// Derivative of such a factor's residual by u of its stretch: rows × kSize.
Eigen::MatrixXd SlidingWindow::disturbance(const KeyframeFactors& keyframe, const WindowFactor& factor,
                                           const LinearizedFactor& part) const {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(part.jacobian.rows(), kSize);
  if (factor.id == keyframe.lidar.id) {
    result.leftCols<kCloud>() = part.jacobian.rightCols<kCloud>() * keyframe.lidar.content().long_map_error_root();
  } else {
    result.rightCols<kField>() =
        calibration_.magnetometers.survey_pose_sigma_m * part.jacobian.middleCols<3>(3);  // by the position
  }
  return result;
}

/// Weights of the sources in u of each keyframe's stretch. Without a scan: of the stretch before.
std::vector<const Eigen::VectorXd*> SlidingWindow::source_weights(const LongErrors& errors) const {
  std::vector<const Eigen::VectorXd*> result;
  const MapErrorEpoch* stretch = map_errors_.front().get();
  for (const auto& keyframe : keyframes_) {
    if (keyframe->map_error != nullptr) stretch = keyframe->map_error;
    result.push_back(&errors.weights.at(stretch));
  }
  return result;
}

std::vector<Eigen::MatrixXd> SlidingWindow::disturbances(std::span<const WindowFactor> involved,
                                                         const LongErrors& errors) const {
  std::vector<Eigen::MatrixXd> result(involved.size());
  if (map_errors_.empty()) return result;
  const Eigen::MatrixXd prior = prior_disturbance(errors);
  const std::vector<const Eigen::VectorXd*> weights = source_weights(errors);
  for (std::size_t i = 0; i < involved.size(); ++i) {
    if (involved[i].id == prior_.id) result[i] = prior;
  }
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    for (const WindowFactor* factor : disturbed(*keyframes_[k])) {
      const auto found = std::find_if(involved.begin(), involved.end(),
                                      [&](const WindowFactor& other) { return other.id == factor->id; });
      if (found == involved.end()) continue;
      const Eigen::MatrixXd own = disturbance(*keyframes_[k], *factor, linearize(*factor));
      Eigen::MatrixXd& all = result[static_cast<std::size_t>(found - involved.begin())];
      all = Eigen::MatrixXd::Zero(own.rows(), prior.cols());
      for (Eigen::Index s = 0; s < errors.sources; ++s) all.middleCols<kSize>(kSize * s) = (*weights[k])[s] * own;
    }
  }
  return result;
}

MarginalPrior SlidingWindow::marginalize_disturbed(std::span<const WindowFactor> involved,
                                                   std::span<WindowBlock* const> eliminated,
                                                   bool first_stretch_leaves) {
  const LongErrors errors = long_errors();
  MarginalPrior result = marginalize(involved, eliminated, disturbances(involved, errors));
  Eigen::MatrixXd disturbance = std::move(result.disturbance);
  prior_sources_ = disturbance.cols() > 0 ? errors.sources : 0;
  const double decay = first_stretch_leaves ? map_errors_[1]->long_decay : 1.0;
  if (decay < 1.0 && prior_sources_ > 1) {
    // u of the second stretch replaces that of the first; the independent part is appended.
    const double turned = std::sqrt(1.0 - decay * decay);
    const Eigen::MatrixXd first = disturbance.leftCols<kSize>();
    const Eigen::MatrixXd step = disturbance.middleCols<kSize>(kSize);
    disturbance.middleCols<kSize>(kSize) = decay * first + turned * step;
    Eigen::MatrixXd moved(disturbance.rows(), disturbance.cols());
    moved << disturbance.rightCols(disturbance.cols() - kSize), turned * first - decay * step;
    disturbance = moved;
    --prior_sources_;
  }
  const Eigen::Index known = kSize * prior_sources_;
  const Eigen::MatrixXd independent = compressed(disturbance.rightCols(disturbance.cols() - known));
  prior_disturbance_.resize(disturbance.rows(), known + independent.cols());
  prior_disturbance_ << disturbance.leftCols(known), independent;
  return result;
}

Eigen::MatrixXd SlidingWindow::covariance(const SparseInformation& known,
                                          std::span<const WindowBlock* const> variables) const {
  if (map_errors_.empty()) return known.covariance(variables);
  Eigen::Index columns = 0;
  for (const WindowBlock* variable : variables) columns += variable->tangent_size();
  Eigen::MatrixXd wanted = Eigen::MatrixXd::Zero(known.size(), columns);
  Eigen::Index column = 0;
  for (const WindowBlock* variable : variables) {
    const IndexRange range = *known.range(variable);
    wanted.block(range.begin, column, range.size, range.size).setIdentity();
    column += range.size;
  }
  const Eigen::MatrixXd by_tangents = known.solve(wanted);
  Eigen::MatrixXd result = wanted.transpose() * by_tangents;
  result = (0.5 * (result + result.transpose())).eval();
  const auto by_residual = [&](const WindowFactor& factor, const LinearizedFactor& part) {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(part.jacobian.rows(), by_tangents.cols());
    Eigen::Index begin = 0;
    for (const WindowBlock* block : factor.blocks) {
      const Eigen::Index size = block->tangent_size();
      if (const auto range = known.range(block)) {
        sum.noalias() += part.jacobian.middleCols(begin, size) * by_tangents.middleRows(range->begin, size);
      }
      begin += size;
    }
    return sum;
  };
  const LongErrors errors = long_errors();
  Eigen::MatrixXd by_errors = by_residual(prior_, linearize(prior_)).transpose() * prior_disturbance(errors);
  const std::vector<const Eigen::VectorXd*> weights = source_weights(errors);
  std::vector<Eigen::MatrixXd> by_stretch(keyframes_.size());
  parallel_for(std::size_t{0}, keyframes_.size(), [&](std::size_t k) {
    by_stretch[k] = Eigen::MatrixXd::Zero(by_tangents.cols(), kSize);
    for (const WindowFactor* factor : disturbed(*keyframes_[k])) {
      const LinearizedFactor part = linearize(*factor);
      by_stretch[k].noalias() += by_residual(*factor, part).transpose() * disturbance(*keyframes_[k], *factor, part);
    }
  });
  for (std::size_t k = 0; k < keyframes_.size(); ++k) {
    for (Eigen::Index s = 0; s < errors.sources; ++s) {
      by_errors.middleCols<kSize>(kSize * s) += (*weights[k])[s] * by_stretch[k];
    }
  }
  result.noalias() += by_errors * by_errors.transpose();
  return result;
}

void SlidingWindow::add_long_errors(const SparseInformation& known, std::vector<Matrix6>& poses) const {
  if (map_errors_.empty()) return;
  const LongErrors errors = long_errors();
  const Eigen::MatrixXd prior_by = prior_disturbance(errors);
  const std::vector<const Eigen::VectorXd*> weights = source_weights(errors);
  // Jᵀ D of each factor: contribution of u of its stretch to the gradient.
  using Gradients = std::vector<std::pair<const WindowFactor*, Eigen::MatrixXd>>;
  std::vector<Gradients> gradients(keyframes_.size());
  parallel_for(
      std::size_t{0}, keyframes_.size(),
      [&](std::size_t k) {
        for (const WindowFactor* factor : disturbed(*keyframes_[k])) {
          const LinearizedFactor part = linearize(*factor);
          gradients[k].emplace_back(factor, part.jacobian.transpose() * disturbance(*keyframes_[k], *factor, part));
        }
      },
      4);
  const auto add = [&](const WindowFactor& factor, const Eigen::MatrixXd& gradient, double weight,
                       Eigen::Ref<Eigen::MatrixXd> right) {
    Eigen::Index begin = 0;
    for (const WindowBlock* block : factor.blocks) {
      const Eigen::Index size = block->tangent_size();
      if (const auto range = known.range(block)) {
        right.block(range->begin, 0, size, gradient.cols()) += weight * gradient.middleRows(begin, size);
      }
      begin += size;
    }
  };
  const Eigen::MatrixXd prior_gradient = linearize(prior_).jacobian.transpose() * prior_by;
  std::vector<Eigen::MatrixXd> moved(static_cast<std::size_t>(kAtOnce));
  for (Eigen::Index first = 0; first < prior_by.cols(); first += kAtOnce * kColumns) {
    const Eigen::Index count = std::min(kAtOnce, (prior_by.cols() - first + kColumns - 1) / kColumns);
    parallel_for(std::size_t{0}, static_cast<std::size_t>(count), [&](std::size_t i) {
      const Eigen::Index begin = first + static_cast<Eigen::Index>(i) * kColumns;
      const Eigen::Index width = std::min(kColumns, prior_by.cols() - begin);
      Eigen::MatrixXd right = Eigen::MatrixXd::Zero(known.size(), width);
      add(prior_, prior_gradient.middleCols(begin, width), 1.0, right);
      for (Eigen::Index source = begin / kSize; source < errors.sources; ++source) {
        // The group's columns of this source.
        const Eigen::Index from = std::max(begin, source * kSize);
        const Eigen::Index size = std::min(begin + width, (source + 1) * kSize) - from;
        if (size <= 0) break;
        for (std::size_t k = 0; k < keyframes_.size(); ++k) {
          const double weight = (*weights[k])[source];
          if (weight == 0.0) continue;
          for (const auto& [factor, gradient] : gradients[k]) {
            add(*factor, gradient.middleCols(from - source * kSize, size), weight,
                right.middleCols(from - begin, size));
          }
        }
      }
      moved[i] = known.solve(right);
    });
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      for (std::size_t k = 0; k < poses.size(); ++k) {
        const auto pose = moved[i].middleRows<6>(known.range(&keyframes_[k]->pose)->begin);
        poses[k].noalias() += pose * pose.transpose();
      }
    }
  }
}

}  // namespace lodestone
