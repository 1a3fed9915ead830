// A window written down and made again. Variables are named by their places in the problem's order, factors by their
// places among all that there may be; both come back in the order in which the problem had them, for sums go by it.
#include <algorithm>

#include "core/checkpoint/serialization.h"
#include "factors/condensed_lidar_factor.h"
#include "factors/point_plane_factor.h"
#include "factors/preintegration_factor.h"
#include "factors/prior_factor.h"
#include "factors/random_walk_factor.h"
#include "factors/sliding_window_parts.h"

namespace lodestone {

template <class Archive>
void serialize(Archive& archive, FieldReading& reading) {
  auto& [T_end_mag, measured_ut, magnetometer, sigma_ut, weight, velocity_m_s, turn_rad_s] = reading;
  archive(T_end_mag, measured_ut, magnetometer, sigma_ut, weight, velocity_m_s, turn_rad_s);
}

template <class Archive>
void serialize(Archive& archive, MeasuredPose& measured) {
  auto& [T_map_imu, root] = measured;
  archive(T_map_imu, root);
}

template <class Archive>
void serialize(Archive& archive, PriorBlock& block) {
  auto& [kind, linearization] = block;
  archive(kind, linearization);
}

template <class Archive>
void serialize(Archive& archive, WindowBlock& block) {
  auto& [kind, values] = block;
  archive(kind, values);
}

namespace {

/// Where a factor stands in `factor_places`: prior, clock, three a keyframe, then walks.
enum class FactorRole { prior, clock, imu, lidar, field, walk };

FactorRole role_of(std::size_t place, std::size_t keyframes) {
  if (place < 2) return place == 0 ? FactorRole::prior : FactorRole::clock;
  if (place >= 2 + 3 * keyframes) return FactorRole::walk;
  constexpr FactorRole kOfKeyframe[] = {FactorRole::imu, FactorRole::lidar, FactorRole::field};
  return kOfKeyframe[(place - 2) % 3];
}

std::size_t keyframe_of(std::size_t place) { return (place - 2) / 3; }

template <class T>
std::size_t place_of(const std::vector<T*>& all, const T* one) {
  return static_cast<std::size_t>(std::find(all.begin(), all.end(), one) - all.begin());
}

void save_points(StateWriter& state, const PointPlaneFactor& factor) {
  state(factor.mask(), factor.correspondences().size());
  for (const Correspondence& one : factor.correspondences()) {
    state(one.point, one.plane->normal, one.plane->center, one.variance, one.robust_weight);
  }
}

/// With planes of its own: the map that it pointed into is gone. The factor asks them for normal and centre alone.
std::unique_ptr<ceres::CostFunction> load_points(StateReader& state) {
  PoseMask mask;
  std::size_t count = 0;
  state(mask, count);
  const auto planes = std::make_shared<std::vector<Plane>>(count);
  std::vector<Correspondence> correspondences(count);
  for (std::size_t i = 0; i < count; ++i) {
    Plane& plane = (*planes)[i];
    state(correspondences[i].point, plane.normal, plane.center, correspondences[i].variance, correspondences[i].robust_weight);
    correspondences[i].plane = &plane;
  }
  auto factor = std::make_unique<PointPlaneFactor>(std::move(correspondences), mask);
  factor->keep(planes);
  return factor;
}

}  // namespace

std::vector<WindowFactor*> SlidingWindow::factor_places() {
  std::vector<WindowFactor*> result{&prior_, &clock_prior_};
  for (const auto& keyframe : keyframes_) result.insert(result.end(), {&keyframe->imu, &keyframe->lidar, &keyframe->field});
  for (const auto& epoch : epochs_) result.push_back(&epoch->walk);
  return result;
}

void SlidingWindow::save_factor(StateWriter& state, std::size_t place, const WindowFactor& factor) const {
  switch (role_of(place, keyframes_.size())) {
    case FactorRole::prior: {
      const auto* prior = static_cast<const PriorFactor*>(factor.function);
      state(prior->blocks(), prior->root(), prior->offset(), prior->slide());
      return;
    }
    case FactorRole::clock:
    case FactorRole::walk:
      state(*static_cast<const RandomWalkFactor*>(factor.function));
      return;
    case FactorRole::imu: {
      const Preintegration& integrated = static_cast<const PreintegrationFactor*>(factor.function)->preintegration();
      state(integrated.gyroscope_bias(), integrated.accelerometer_bias());
      return;
    }
    case FactorRole::lidar:
      if (options_.condensed) {
        state(*static_cast<const CondensedLidarFactor*>(factor.function));
      } else {
        save_points(state, *static_cast<const PointPlaneFactor*>(factor.function));
      }
      return;
    case FactorRole::field: {
      const auto* pose = dynamic_cast<const PoseFactor*>(factor.function);
      state(pose != nullptr);
      if (pose != nullptr) {
        state(*pose);
      } else {
        const auto* field = static_cast<const FieldFactor*>(factor.function);
        state(field->readings(), field->mask());
      }
    }
  }
}

std::unique_ptr<ceres::CostFunction> SlidingWindow::load_factor(StateReader& state, std::size_t place,
                                                                const std::vector<WindowBlock*>& blocks,
                                                                const std::shared_ptr<const MagneticMap>& map,
                                                                FieldInterpolation interpolation) const {
  switch (role_of(place, keyframes_.size())) {
    case FactorRole::prior: {
      Eigen::MatrixXd root;
      Eigen::VectorXd offset;
      std::vector<PriorBlock> known;
      Slide slide;
      state(known, root, offset, slide);
      return std::make_unique<PriorFactor>(std::move(known), std::move(root), std::move(offset), slide);
    }
    case FactorRole::clock:
    case FactorRole::walk: {
      const int size = static_cast<int>(blocks.back()->values.size());
      auto walk = std::make_unique<RandomWalkFactor>(size, 1.0, blocks.size() == 1);
      state(*walk);
      return walk;
    }
    case FactorRole::imu: {
      Vector3 gyroscope_bias;
      Vector3 accelerometer_bias;
      state(gyroscope_bias, accelerometer_bias);
      // The same sum over the same samples.
      const Preintegration integrated(keyframes_[keyframe_of(place)]->samples, gyroscope_bias, accelerometer_bias, noise_);
      return std::make_unique<PreintegrationFactor>(integrated, noise_);
    }
    case FactorRole::lidar: {
      if (!options_.condensed) return load_points(state);
      auto condensed = std::make_unique<CondensedLidarFactor>(CondensedScan{}, PoseMask{}, blocks.size() > 2);
      state(*condensed);
      return condensed;
    }
    case FactorRole::field:
      break;
  }
  bool is_pose = false;
  state(is_pose);
  if (is_pose) {
    auto pose = std::make_unique<PoseFactor>(MeasuredPose{}, PoseMask{});
    state(*pose);
    return pose;
  }
  std::vector<FieldReading> readings;
  PoseMask mask;
  state(readings, mask);
  return std::make_unique<FieldFactor>(map, interpolation, magnetometers_, std::move(readings), mask, blocks.size() > 2);
}

void SlidingWindow::save(StateWriter& state) const {
  // Only looks: the places are named for a reader that fills them.
  const std::vector<WindowFactor*> places = const_cast<SlidingWindow*>(this)->factor_places();
  const bool clock = static_cast<bool>(clock_prior_);
  state(keyframes_.size(), epochs_.size(), clock, clock_sigma_s_);
  const auto save_block = [&](const WindowBlock& block) { state(place_of<WindowBlock>(blocks_, &block), block); };
  save_block(gravity_);
  if (clock) save_block(clock_);
  for (const auto& epoch : epochs_) {
    state(epoch->start, epoch->keyframes);
    save_block(epoch->biases);
  }
  for (const auto& keyframe : keyframes_) {
    const auto epoch = std::find_if(epochs_.begin(), epochs_.end(), [&](const auto& one) { return one.get() == keyframe->epoch; });
    state(keyframe->time, keyframe->samples, keyframe->lidar_in_prior, epoch - epochs_.begin());
    save_block(keyframe->pose);
    save_block(keyframe->motion);
  }
  std::vector<ceres::ResidualBlockId> order;
  problem_->GetResidualBlocks(&order);
  state(order.size());
  for (const ceres::ResidualBlockId id : order) {
    const auto found = std::find_if(places.begin(), places.end(), [&](const WindowFactor* one) { return one->id == id; });
    const auto place = static_cast<std::size_t>(found - places.begin());
    state(place, (*found)->blocks.size());
    for (const WindowBlock* block : (*found)->blocks) state(place_of<WindowBlock>(blocks_, block));
    save_factor(state, place, **found);
  }
}

SlidingWindow::SlidingWindow(StateReader& state, std::shared_ptr<const MagneticMap> map, FieldInterpolation interpolation,
                             int magnetometers, const ImuNoise& noise, const SlidingWindowOptions& options)
    : SlidingWindow(magnetometers, noise, options) {
  std::size_t keyframes = 0;
  std::size_t epochs = 0;
  bool clock = false;
  state(keyframes, epochs, clock, clock_sigma_s_);
  std::vector<WindowBlock*> blocks(1 + (clock ? 1 : 0) + epochs + 2 * keyframes);
  const auto load_block = [&](WindowBlock& block) {
    std::size_t place = 0;
    state(place, block);
    blocks.at(place) = &block;
  };
  load_block(gravity_);
  if (clock) load_block(clock_);
  for (std::size_t i = 0; i < epochs; ++i) {
    epochs_.push_back(std::make_unique<BiasEpoch>());
    state(epochs_[i]->start, epochs_[i]->keyframes);
    load_block(epochs_[i]->biases);
  }
  for (std::size_t k = 0; k < keyframes; ++k) {
    keyframes_.push_back(std::make_unique<Keyframe>());
    std::ptrdiff_t epoch = 0;
    state(keyframes_[k]->time, keyframes_[k]->samples, keyframes_[k]->lidar_in_prior, epoch);
    if (epoch < std::ssize(epochs_)) keyframes_[k]->epoch = epochs_[static_cast<std::size_t>(epoch)].get();
    load_block(keyframes_[k]->pose);
    load_block(keyframes_[k]->motion);
  }
  for (WindowBlock* block : blocks) add_block(*block);
  for (const auto& epoch : epochs_) {
    if (!options_.magnetometer_bias_states) problem_->SetParameterBlockConstant(epoch->biases.values.data());
  }
  const std::vector<WindowFactor*> places = factor_places();
  std::size_t factors = 0;
  state(factors);
  for (std::size_t i = 0; i < factors; ++i) {
    std::size_t place = 0;
    std::size_t size = 0;
    state(place, size);
    std::vector<WindowBlock*> touched;
    for (std::size_t j = 0; j < size; ++j) {
      std::size_t block = 0;
      state(block);
      touched.push_back(blocks.at(block));
    }
    std::unique_ptr<ceres::CostFunction> function = load_factor(state, place, touched, map, interpolation);
    *places.at(place) = add_factor(std::move(function), std::move(touched));
  }
}

}  // namespace lodestone
