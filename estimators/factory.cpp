#include "estimators/factory.h"

#include "core/error.h"
#include "core/nearest_name.h"
#include "estimators/baselines/continuous_time/continuous_time.h"
#include "estimators/baselines/magnetic_calibrating/magnetic_calibrating.h"
#include "estimators/baselines/magnetic_particle/magnetic_particle_filter.h"
#include "estimators/baselines/magnetic_stochastic/magnetic_stochastic_filter.h"
#include "estimators/baselines/ndt/ndt_localization.h"
#include "estimators/health/supervised.h"
#include "estimators/ieskf/ieskf.h"
#include "estimators/monitored.h"
#include "estimators/smoother/smoother.h"

namespace lodestone {

std::vector<std::string> estimator_names() {
  return {"smoother",
          "ieskf",
          "lidar-inertial",
          "magnetic",
          "ndt",
          "continuous-time",
          "magnetic-calibrating",
          "magnetic-particle",
          "magnetic-stochastic"};
}

bool uses_field(const std::string& name) {
  return name != "lidar-inertial" && name != "ndt" && name != "continuous-time";
}

bool needs_scan_matcher(const std::string& name) {
  return name == "ndt";
}

bool can_refine(const std::string& name) {
  return name == "smoother" || name == "magnetic";
}

namespace {

std::unique_ptr<Estimator> make_unmonitored(const std::string& name, const EstimatorInput& input) {
  if (name == "smoother") return std::make_unique<Smoother>(input);
  if (name == "ieskf") return std::make_unique<IteratedFilter>(input);
  if (name == "lidar-inertial") {
    if (input.planes == nullptr)
      throw InputError("estimator lidar-inertial requires a cloud map: pass --cloud MAP.pcd");
    return std::make_unique<IteratedFilter>(input);
  }
  if (name == "magnetic") {
    if (input.field == nullptr) throw InputError("estimator magnetic requires a field map: pass --magnetic FIELD.yaml");
    EstimatorInput without_lidar = input;
    without_lidar.planes = nullptr;
    without_lidar.options.magnetic.measurement = MagneticMeasurement::pose;
    return std::make_unique<Smoother>(without_lidar);
  }
  if (name == "continuous-time") {
    if (input.planes == nullptr)
      throw InputError("estimator continuous-time requires a cloud map: pass --cloud MAP.pcd");
    return std::make_unique<ContinuousTime>(input, input.options.continuous_time);
  }
  if (name == "magnetic-calibrating") {
    if (input.field == nullptr) {
      throw InputError("estimator magnetic-calibrating requires a field map: pass --magnetic FIELD.yaml");
    }
    return std::make_unique<MagneticCalibrating>(input, input.options.magnetic_calibrating);
  }
  if (name == "magnetic-particle" || name == "magnetic-stochastic") {
    if (input.field == nullptr) {
      throw InputError("estimator " + name + " requires a field map: pass --magnetic FIELD.yaml");
    }
    if (input.suite.magnetometers.empty()) {
      throw InputError("estimator " + name + " requires magnetometers: add them to the section magnetometers of the " +
                       "platform file");
    }
    EstimatorInput without_lidar = input;
    without_lidar.planes = nullptr;
    if (name == "magnetic-particle") {
      return std::make_unique<MagneticParticleFilter>(std::move(without_lidar), input.options.magnetic_particle);
    }
    return std::make_unique<MagneticStochasticFilter>(std::move(without_lidar), input.options.magnetic_stochastic);
  }
  if (name == "ndt") {
    if (input.matcher == nullptr) throw InputError("estimator ndt requires a cloud map: pass --cloud MAP.pcd");
    return std::make_unique<NdtLocalization>(input, input.matcher, input.options.ndt);
  }
  throw InputError("no estimator is called '" + name + "'" + suggestion(name, estimator_names()) +
                   " (known: " + join_names(estimator_names()) + ")");
}

}  // namespace

std::unique_ptr<Estimator> make_estimator(const std::string& name, const EstimatorInput& all) {
  if (all.planes == nullptr && all.field == nullptr) {
    throw InputError("no map given: pass --cloud MAP.pcd, --magnetic FIELD.yaml or both");
  }
  EstimatorInput input = all;
  if (!input.options.wheels.enabled) input.suite.wheels.reset();
  if (!uses_field(name)) input.field = nullptr;
  std::unique_ptr<Estimator> estimator = std::make_unique<Supervised>(
      input, [name](const EstimatorInput& again) { return make_unmonitored(name, again); });
  if (input.field == nullptr || !input.options.magnetic.monitor) return estimator;
  return std::make_unique<Monitored>(std::move(estimator), input.suite, input.warnings);
}

}  // namespace lodestone
