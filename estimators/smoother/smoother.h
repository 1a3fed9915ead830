#pragma once

#include <deque>
#include <memory>
#include <optional>

#include "core/imu/white_noise.h"
#include "estimators/factory.h"
#include "estimators/smoother/batch_refinement.h"
#include "estimators/smoother/keyframe_measurements.h"
#include "estimators/smoother/relocation.h"
#include "estimators/smoother/repeated_map_error.h"
#include "estimators/wheel_watch.h"
#include "factors/sliding_window.h"

namespace lodestone {

/// The sliding-window smoother (docs/design/architecture.md). Per scan: predict by preintegration, deskew, associate,
/// condense, analyse degeneracy, weight, solve, associate moved keyframes again, marginalize the oldest.
class Smoother final : public Estimator {
 public:
  explicit Smoother(EstimatorInput input);
  ~Smoother() override;

  void process(const ScanBundle& bundle, EstimateSink& sink) override;
  void finish(EstimateSink& sink) override;
  bool move(const Pose& T_new_old) override;
  std::string solver() const override { return SlidingWindow::solver_description(); }
  const CalibrationEstimate* calibration() const override { return &calibration_; }

 private:
  void take_measurements(Keyframe& keyframe, const ScanBundle& bundle) const;
  void relocate();
  void warn_of_move(const char* kind, const std::string& detail, const Pose& from, const Pose& to, Time time);
  void follow_residuals(const Keyframe& keyframe, const SlidingWindow::ClockOffset& clock);
  void renew(std::size_t k);
  Matrix6 marginal_information(std::size_t k, double noise_subtracted) const;
  Matrix6 narrower_gate(std::size_t k) const;
  bool gate_is_wide(std::size_t k) const;
  bool begins_to_narrow(std::size_t k);
  bool has_moved(std::size_t k) const;
  void share_slide();
  std::size_t leaving_keyframes() const;
  void report(std::size_t k, const Matrix6& covariance, EstimateSink& sink);

  EstimatorInput input_;
  KeyframeMeasurements measurements_;
  Relocation relocation_;
  std::unique_ptr<SlidingWindow> window_;
  std::optional<SlidingWindow::NewestCovariance> newest_covariance_;  ///< as of the last scan
  std::deque<std::unique_ptr<Keyframe>> keyframes_;
  ImuWhiteNoise imu_white_noise_;
  double variance_scale_ = 1.0;  // of LiDAR residuals
  RepeatedMapError map_error_;   // of the map's cubes, from residuals
  WheelWatch wheel_watch_;
  FieldError field_error_;                  // of the field and its map, from residuals
  CalibrationEstimate calibration_;         // the final estimate, valid after finish
  std::unique_ptr<BatchRefinement> batch_;  // null: no refinement
};

}  // namespace lodestone
