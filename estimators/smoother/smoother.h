#pragma once

#include <deque>
#include <memory>

#include "estimators/factory.h"
#include "estimators/health.h"
#include "factors/sliding_window.h"
#include "frontends/magnetometer/array_reading.h"

namespace lodestone {

/// The sliding-window smoother (docs/architecture.md). Per scan: predict by preintegration, deskew, associate, condense,
/// analyse, weigh, solve, associate again what moved, marginalize the oldest.
class Smoother final : public Estimator {
 public:
  explicit Smoother(EstimatorInput input);
  ~Smoother() override;

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override;

 private:
  struct Frame;
  void register_scan(std::size_t k);
  void hold_height(std::size_t k);
  Degeneracy analyse(std::size_t k) const;
  void weigh(std::size_t k);
  bool moved(std::size_t k) const;
  void renew_moved(bool newest_only);
  void hand_out_oldest(const Matrix6& covariance, EstimateSink& sink);

  EstimatorInput input_;
  std::unique_ptr<Plane> level_;  // the field map's height, where no cloud map tells it
  std::vector<double> crowding_;  // of the magnetometers
  FieldAgreement agreement_;      // judged only where there is no LiDAR
  std::unique_ptr<SlidingWindow> window_;
  std::deque<std::unique_ptr<Frame>> frames_;
};

}  // namespace lodestone
