#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/geometry/trajectory.h"
#include "core/measurement_source.h"
#include "tools/simulate/magnetic_field.h"
#include "tools/simulate/motion.h"
#include "tools/simulate/moved_objects.h"
#include "tools/simulate/movers.h"
#include "tools/simulate/ray_caster.h"
#include "tools/simulate/reality.h"

namespace lodestone::simulation {

/// A world's surfaces and field, built once and shared by drive, survey and cloud.
struct Environment {
  /// `scene` and `rearrangement`: see build_scene.
  explicit Environment(const World& world, const std::string& scene = {}, const Rearrangement& rearrangement = {});

  std::string scene_name;
  Scene scene;
  RayCaster caster;
  MagneticField field;
};

/// One drive through a world as measurements, in order of completion (a scan at its end). The same world and seed give
/// the same bits on any number of threads. The robot has the errors that the world's section `reality` and the seed
/// define; the survey uses the same robot, without movers. Faults are those of the sequence; a survey has none.
class SimulationSource : public MeasurementSource {
 public:
  enum class Drive {
    sequence,  ///< the sequence, with the LiDAR
    survey,    ///< the survey drive of the sequence: other noise and shaking, no LiDAR
  };

  /// `max_duration_s` cuts the drive. Throws InputError if the sequence does not exist.
  SimulationSource(const World& world, std::shared_ptr<const Environment> environment, const std::string& sequence,
                   Drive drive, std::uint64_t seed, double max_duration_s);
  ~SimulationSource() override;

  bool next(Measurement& measurement) override;
  Time begin_time() const override;
  Time end_time() const override;

  const Motion& motion() const;

  /// T_map_imu at every IMU stamp: exact for a sequence, with the survey's errors for a survey. If the maps are
  /// displaced, the poses are in the displaced maps (DisplacementField::displaced).
  Trajectory trajectory() const;

  /// The values that --seed drew.
  const Reality& reality() const;
  const Movers& movers() const;

  /// Stamp minus true time of each scan of the whole drive, s.
  std::vector<double> scan_stamp_errors() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone::simulation
