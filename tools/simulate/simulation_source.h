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

/// A world that is ready to be driven through: surfaces and field, built once and shared by drive, survey and cloud.
struct Environment {
  /// `scene` and `rearrangement` as build_scene takes them.
  explicit Environment(const World& world, const std::string& scene = {}, const Rearrangement& rearrangement = {});

  std::string scene_name;
  Scene scene;
  RayCaster caster;
  MagneticField field;
};

/// One drive through a world as measurements, in the order in which they are complete (a scan at its end). The same
/// world and seed give the same bits on any number of threads. The robot errs as the world's section `reality` and the
/// seed say; a survey is driven by the same robot when nobody moves. Faults are those of the sequence; a survey has
/// none.
class SimulationSource : public MeasurementSource {
 public:
  enum class Drive {
    sequence,  ///< the sequence, with the LiDAR
    survey,    ///< the survey drive of the sequence: other noise and shaking, no LiDAR
  };

  /// `max_duration_s` cuts the drive. Throws InputError where there is no such sequence.
  SimulationSource(const World& world, std::shared_ptr<const Environment> environment, const std::string& sequence,
                   Drive drive, std::uint64_t seed, double max_duration_s);
  ~SimulationSource() override;

  bool next(Measurement& measurement) override;
  Time begin_time() const override;
  Time end_time() const override;

  const Motion& motion() const;

  /// T_map_imu at every stamp of the IMU: exact for a sequence, with the survey's errors for a survey. If the maps are
  /// displaced: where the robot is in those maps (DisplacementField::displaced).
  Trajectory trajectory() const;

  /// What --seed drew.
  const Reality& reality() const;
  const Movers& movers() const;

  /// Stamp minus true time of every scan of the whole drive, s.
  std::vector<double> scan_stamp_errors() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace lodestone::simulation
