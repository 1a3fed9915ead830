// What a smoother leaves in a checkpoint: its window, what is known of each keyframe, and once for all those that a batch
// will come back to. Scans and readings are had from the log again.
#include "estimators/serialization.h"
#include "estimators/smoother/smoother.h"

namespace lodestone {

/// Without measurements (recall) and correspondences (looked for anew before they are used again).
template <class Archive>
void serialize(Archive& archive, Keyframe& keyframe) {
  auto& [scan_start, imu, points, magnetic, predicted, predicted_covariance, gate_covariance, averaging, variance_scale, planes,
         correspondences, lidar, lidar_information, seen_share, unit_hessian, degeneracy, associated, analysed, estimate, field_disagrees] = keyframe;
  archive(predicted, predicted_covariance, gate_covariance, averaging.information_of_scan, averaging.covariance);
  archive(lidar.cost, lidar_information, seen_share, unit_hessian, degeneracy, associated);
  archive(analysed, estimate, field_disagrees);
}

void Smoother::save(StateWriter& state, StateWriter& lasting) {
  state(agreement_, left_, keyframes_.size());
  if (window_ == nullptr) return;
  window_->save(state);
  for (const auto& keyframe : keyframes_) state(*keyframe);
  if (batch_ != nullptr) batch_->save(state, lasting);
}

void Smoother::load(StateReader& state, StateReader& lasting) {
  std::size_t keyframes = 0;
  state(agreement_, left_, keyframes);
  recalled_ = 0;
  if (keyframes == 0) return;
  const RunOptions& options = input_.options;
  window_ = std::make_unique<SlidingWindow>(state, input_.field, options.magnetic.interpolation,
                                            static_cast<int>(input_.suite.magnetometers.size()), input_.suite.imu,
                                            options.smoother.solver);
  for (std::size_t k = 0; k < keyframes; ++k) {
    keyframes_.push_back(std::make_unique<Keyframe>());
    state(*keyframes_.back());
  }
  if (options.smoother.refine != Refinement::batch) return;
  batch_ = std::make_unique<BatchRefinement>(input_, measurements_, InitialState{});
  batch_->load(state, lasting);
}

void Smoother::recall(const ScanBundle& bundle) {
  const std::size_t k = recalled_++;
  if (k >= left_) {
    take_measurements(*keyframes_.at(k - left_), bundle);
  } else if (batch_ != nullptr) {
    take_measurements(batch_->keyframe(k), bundle);
  }
}

void BatchRefinement::save(StateWriter& state, StateWriter& lasting) {
  state(start_.state, start_.covariance, keyframes_.size());
  for (; saved_ < keyframes_.size(); ++saved_) lasting(*keyframes_[saved_], biases_[saved_]);
}

void BatchRefinement::load(StateReader& state, StateReader& lasting) {
  std::size_t count = 0;
  state(start_.state, start_.covariance, count);
  for (; saved_ < count; ++saved_) {
    keyframes_.push_back(std::make_unique<Keyframe>());
    biases_.emplace_back();
    lasting(*keyframes_.back(), biases_.back());
  }
}

}  // namespace lodestone
