#include "estimators/factory.h"

#include <array>

#include "core/error.h"
#include "core/nearest_name.h"
#include "estimators/baselines/continuous_time/continuous_time.h"
#include "estimators/baselines/magnetic_calibrating/magnetic_calibrating.h"
#include "estimators/baselines/magnetic_particle/magnetic_particle_filter.h"
#include "estimators/baselines/magnetic_stochastic/magnetic_stochastic_filter.h"
#include "estimators/baselines/ndt/ndt_localization.h"
#include "estimators/ieskf/ieskf.h"
#include "estimators/layer_height_variance.h"
#include "estimators/mixture/guarded_smoother.h"
#include "estimators/mixture/magnetic_mixture.h"
#include "estimators/monitored.h"
#include "estimators/smoother/smoother.h"
#include "estimators/supervised.h"

namespace lodestone {

namespace {

enum class Sensors {
  all,       ///< LiDAR, magnetometers, or both, as there are maps
  lidar,     ///< requires a cloud map; never sees the field map
  magnetic,  ///< requires a field map and magnetometers; never sees the scans' map
};

struct EstimatorKind {
  const char* name;
  Sensors sensors;
  bool refines;
  Reckoning reckoning;
  bool constrains_height;  ///< to the layer's, with a field map of one layer, where there is no scan or no cloud map
  std::unique_ptr<Estimator> (*make)(EstimatorInput input);
};

/// The default first.
constexpr std::array kEstimators{
    EstimatorKind{"smoother", Sensors::all, true, Reckoning::learned_imu, true,
                  [](EstimatorInput input) -> std::unique_ptr<Estimator> {
                    return std::make_unique<Smoother>(std::move(input));
                  }},
    EstimatorKind{"ieskf", Sensors::all, false, Reckoning::learned_imu, false,
                  [](EstimatorInput input) -> std::unique_ptr<Estimator> {
                    return std::make_unique<IteratedFilter>(std::move(input));
                  }},
    EstimatorKind{"lidar-inertial", Sensors::lidar, false, Reckoning::learned_imu, false,
                  [](EstimatorInput input) -> std::unique_ptr<Estimator> {
                    return std::make_unique<IteratedFilter>(std::move(input));
                  }},
    EstimatorKind{"magnetic", Sensors::magnetic, true, Reckoning::learned_imu, true,
                  [](EstimatorInput input) -> std::unique_ptr<Estimator> {
                    input.options.magnetic.measurement = MagneticMeasurement::pose;
                    return std::make_unique<Smoother>(std::move(input));
                  }},
    EstimatorKind{"ndt", Sensors::lidar, false, Reckoning::scans, false,
                  [](EstimatorInput input) -> std::unique_ptr<Estimator> {
                    return std::make_unique<NdtLocalization>(input, input.matcher, input.options.ndt);
                  }},
    EstimatorKind{"continuous-time", Sensors::lidar, false, Reckoning::mounted_imu, false,
                  [](EstimatorInput input) -> std::unique_ptr<Estimator> {
                    return std::make_unique<ContinuousTime>(input, input.options.continuous_time);
                  }},
    EstimatorKind{"magnetic-calibrating", Sensors::magnetic, false, Reckoning::learned_imu, true,
                  [](EstimatorInput input) -> std::unique_ptr<Estimator> {
                    return std::make_unique<MagneticCalibrating>(input, input.options.magnetic_calibrating);
                  }},
    EstimatorKind{"magnetic-mixture", Sensors::magnetic, false, Reckoning::learned_imu, true,
                  [](EstimatorInput input) -> std::unique_ptr<Estimator> {
                    return std::make_unique<MagneticMixture>(std::move(input));
                  }},
    EstimatorKind{"magnetic-particle", Sensors::magnetic, false, Reckoning::learned_imu, true,
                  [](EstimatorInput input) -> std::unique_ptr<Estimator> {
                    return std::make_unique<MagneticParticleFilter>(input, input.options.magnetic_particle);
                  }},
    EstimatorKind{"magnetic-stochastic", Sensors::magnetic, false, Reckoning::learned_imu, true,
                  [](EstimatorInput input) -> std::unique_ptr<Estimator> {
                    return std::make_unique<MagneticStochasticFilter>(input, input.options.magnetic_stochastic);
                  }},
};

const EstimatorKind& kind_of(const std::string& name) {
  for (const EstimatorKind& kind : kEstimators) {
    if (kind.name == name) return kind;
  }
  throw InputError("no estimator is called '" + name + "'" + suggestion(name, estimator_names()) +
                   " (known: " + join_names(estimator_names()) + ")");
}

void require_input(const EstimatorKind& kind, const EstimatorInput& input) {
  const std::string requires_input = "estimator " + std::string(kind.name) + " requires ";
  const bool no_cloud = input.planes == nullptr || (needs_scan_matcher(kind.name) && input.matcher == nullptr);
  if (kind.sensors == Sensors::lidar && no_cloud) {
    throw InputError(requires_input + "a cloud map: pass --cloud MAP.pcd");
  }
  if (kind.sensors == Sensors::magnetic && input.field == nullptr) {
    throw InputError(requires_input + "a field map: pass --magnetic FIELD.yaml");
  }
  if (kind.sensors == Sensors::magnetic && input.suite.magnetometers.empty()) {
    throw InputError(requires_input + "magnetometers: add them to the section magnetometers of the platform file");
  }
}

std::unique_ptr<Estimator> make_unmonitored(const EstimatorKind& kind, EstimatorInput input) {
  require_input(kind, input);
  if (kind.sensors == Sensors::magnetic) input.planes = nullptr;
  const bool has_cloud = input.planes != nullptr;
  const std::shared_ptr<const MagneticMap> field = input.suite.magnetometers.empty() ? nullptr : input.field;
  const bool field_alone = !has_cloud && field != nullptr;
  const bool one_layer = field != nullptr && field->grid().heights_m.size() == 1;
  std::unique_ptr<Estimator> estimator;
  if (kind.refines && field_alone && input.linearize_at == nullptr) {
    estimator = std::make_unique<GuardedSmoother>(std::move(input), kind.make);
  } else {
    estimator = kind.make(std::move(input));
  }
  if (!kind.constrains_height || !one_layer) return estimator;
  return std::make_unique<LayerHeightVariance>(std::move(estimator), field->errors().height_sigma_m, has_cloud);
}

}  // namespace

std::vector<std::string> estimator_names() {
  std::vector<std::string> names;
  names.reserve(kEstimators.size());
  for (const EstimatorKind& kind : kEstimators) names.emplace_back(kind.name);
  return names;
}

bool uses_field(const std::string& name) {
  return kind_of(name).sensors != Sensors::lidar;
}

bool needs_scan_matcher(const std::string& name) {
  return name == "ndt";
}

bool can_refine(const std::string& name) {
  return kind_of(name).refines;
}

std::unique_ptr<Estimator> make_estimator(const std::string& name, const EstimatorInput& all) {
  const EstimatorKind& kind = kind_of(name);
  if (all.planes == nullptr && all.field == nullptr) {
    throw InputError("no map given: pass --cloud MAP.pcd, --magnetic FIELD.yaml or both");
  }
  EstimatorInput input = all;
  if (!input.options.wheels.enabled) input.suite.wheels.reset();
  if (kind.sensors == Sensors::lidar) input.field = nullptr;
  std::unique_ptr<Estimator> estimator = std::make_unique<Supervised>(
      input, kind.reckoning, [&kind](const EstimatorInput& again) { return make_unmonitored(kind, again); });
  if (input.field == nullptr || !input.options.magnetic.monitor) return estimator;
  return std::make_unique<Monitored>(std::move(estimator), input.suite, input.warnings);
}

}  // namespace lodestone
