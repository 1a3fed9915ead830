#include "tools/simulate/simulation_source.h"

#include <algorithm>
#include <deque>
#include <limits>
#include <numbers>

#include "core/parallel.h"
#include "core/random_stream.h"
#include "tools/simulate/inertial_simulator.h"
#include "tools/simulate/lidar_simulator.h"
#include "tools/simulate/route.h"
#include "tools/simulate/wheel_simulator.h"

namespace lodestone::simulation {
namespace {

constexpr int scans_ahead = 32;  // cast together: enough work for all threads, little memory
constexpr int magnetic_samples_ahead = 512;
constexpr double survey_error_s = 20.0;  // correlation time of the slow error of a surveyed trajectory
constexpr Time never = std::numeric_limits<Time>::max();

std::vector<PlannedPose> cut(std::vector<PlannedPose> plan, double max_duration_s) {
  constexpr double spline_margin = 6.0;  // control points beyond the last moment
  const double limit = std::ceil(max_duration_s / plan_step_s) + spline_margin;
  if (static_cast<double>(plan.size()) > limit) plan.resize(static_cast<std::size_t>(limit));
  return plan;
}

/// A survey of another scene is a drive of another day, with its own noise and vibration. A log's noise is the same
/// with every scene: only the surroundings differ.
std::string noise_of(SimulationSource::Drive drive, const std::string& scene) {
  if (drive == SimulationSource::Drive::sequence) return "sequence";
  return scene.empty() ? "survey" : "survey of " + scene;
}

/// Movers of the drive, drawn along the whole drive: a cut drive is the beginning of the whole one.
Movers draw_movers(const World& world, const Environment& environment, const Sequence& sequence, std::uint64_t run_seed,
                   std::uint64_t seed) {
  const RealityOptions& options = world.reality;
  if (!(options.people > 0.0) && !(options.vehicles > 0.0)) return {};
  const Motion whole(plan_drive(sequence), world.imu.height_m, world.floor, run_seed);
  return {options.people, options.vehicles, environment.caster, whole, seed};
}

/// Fills `batch` with make(first), make(first + 1), … in order, on all threads.
template <class Value, class Make>
void make_ahead(std::deque<Value>& batch, int first, int last, Make&& make) {
  std::vector<Value> values(static_cast<std::size_t>(last - first));
  parallel_for(first, last, [&](int index) { values[static_cast<std::size_t>(index - first)] = make(index); });
  batch.assign(std::make_move_iterator(values.begin()), std::make_move_iterator(values.end()));
}

}  // namespace

Environment::Environment(const World& world, const std::string& scene_in, const Rearrangement& rearrangement)
    : scene_name(scene_in),
      scene(build_scene(world, scene_in, rearrangement)),
      caster(scene.mesh),
      field(world.earth_field_ut, scene.sources) {}

struct SimulationSource::Implementation {
  Implementation(const World& world, std::shared_ptr<const Environment> environment_in, const Sequence& sequence,
                 Drive drive, std::uint64_t seed, double max_duration_s)
      : environment(std::move(environment_in)),
        is_survey(drive == Drive::survey),
        run_seed(RandomStream(seed, noise_of(drive, environment->scene_name)).bits()),
        survey(world.survey),
        imu_rate_hz(world.imu.rate_hz),
        start_time(world.start_time),
        reality(draw_reality(world, seed)),
        survey_error(reality.options.survey_pose_sigma_m, survey_error_s, run_seed, "reality survey pose"),
        plan(cut(is_survey ? plan_survey(sequence, world.survey) : plan_drive(sequence), max_duration_s)),
        motion(plan, world.imu.height_m, world.floor, run_seed),
        movers(is_survey ? Movers{} : draw_movers(world, *environment, sequence, run_seed, seed)),
        imu(motion, world.imu, world.gravity_m_s2, start_time, run_seed, reality.imu),
        magnetometers(motion, environment->field, world.magnetometers, start_time, run_seed, array_errors()),
        lidar(environment->caster, motion, world.lidar, start_time, run_seed, reality.lidar, &movers),
        scan_count(is_survey ? 0 : lidar.scan_count()) {
    if (world.wheels && !is_survey) wheels.emplace(motion, *world.wheels, start_time, run_seed, reality.wheels);
    if (!is_survey && !sequence.faults.empty()) {
      std::vector<Pose> mounts;
      for (std::size_t j = 0; j < world.magnetometers.mounts.size(); ++j) {
        mounts.push_back(with_error(world.magnetometers.mounts[j].T_imu_mag(), reality.magnetometers[j].mounting));
      }
      faults = std::make_unique<FaultInjector>(sequence.faults, start_time, run_seed,
                                               [this, mounts](int magnetometer, double seconds) {
                                                 return motion.pose_at(seconds - reality.magnetometer_clock_offset_s) *
                                                        mounts[static_cast<std::size_t>(magnetometer)];
                                               });
    }
  }

  ArrayErrors array_errors() const {
    ArrayErrors errors;
    if (reality.options.has_magnetometer_errors()) {
      errors.magnetometers = is_survey ? reality.survey_magnetometers : reality.magnetometers;
    }
    errors.clock_offset_s = reality.magnetometer_clock_offset_s;
    errors.command = [this](double seconds) { return command_at(plan, seconds); };
    if (!movers.list().empty()) {
      errors.field = [this](double seconds, const Vector3& place) { return movers.field_ut(seconds, place); };
    }
    return errors;
  }

  Time magnetic_time() const {
    if (magnetic_part < readings.size()) return readings[magnetic_part].time;
    return next_magnetic < magnetometers.sample_count() ? magnetometers.time(next_magnetic) : never;
  }
  Time scan_time() const { return next_scan < scan_count ? lidar.scan_end(next_scan) : never; }

  MagneticSample take_magnetic() {
    if (magnetic_part == readings.size()) {
      if (magnetic_batch.empty()) {
        const int last = std::min(next_magnetic + magnetic_samples_ahead, magnetometers.sample_count());
        make_ahead(magnetic_batch, next_magnetic, last, [&](int index) { return magnetometers.read(index); });
      }
      readings = std::move(magnetic_batch.front());
      magnetic_batch.pop_front();
      magnetic_part = 0;
      ++next_magnetic;
    }
    return readings[magnetic_part++];
  }

  LidarScan take_scan() {
    if (scan_batch.empty()) {
      const int last = std::min(next_scan + scans_ahead, scan_count);
      make_ahead(scan_batch, next_scan, last, [&](int index) { return lidar.scan(index); });
    }
    LidarScan scan = std::move(scan_batch.front());
    scan_batch.pop_front();
    ++next_scan;
    return scan;
  }

  bool next_healthy(Measurement& measurement) {
    const Time imu_time = imu.next_time().value_or(never), field_time = magnetic_time(), end_time = scan_time();
    const Time wheel_time = wheels ? wheels->next_time().value_or(never) : never;
    const Time first = std::min({imu_time, field_time, wheel_time, end_time});
    if (first == never) return false;
    if (first == imu_time) {
      measurement = imu.next();
    } else if (first == field_time) {
      measurement = take_magnetic();
    } else if (first == wheel_time) {
      measurement = wheels->next();
    } else {
      measurement = take_scan();
    }
    return true;
  }

  std::shared_ptr<const Environment> environment;
  bool is_survey;
  std::uint64_t run_seed;
  SurveyOptions survey;
  double imu_rate_hz;
  Time start_time;
  Reality reality;
  DisplacementField survey_error;  ///< of the survey's trajectory, evaluated at (seconds, 0, 0)
  std::vector<PlannedPose> plan;
  Motion motion;
  Movers movers;
  ImuSimulator imu;
  MagnetometerSimulator magnetometers;
  LidarSimulator lidar;
  std::optional<WheelSimulator> wheels;  ///< empty: no wheel odometry, or a survey
  int scan_count;
  int next_scan = 0;
  int next_magnetic = 0;
  std::deque<LidarScan> scan_batch;
  std::deque<std::vector<MagneticSample>> magnetic_batch;
  std::vector<MagneticSample> readings;  ///< of one instant, returned one by one from magnetic_part on
  std::size_t magnetic_part = 0;
  std::unique_ptr<FaultInjector> faults;  ///< null: no faults
};

SimulationSource::SimulationSource(const World& world, std::shared_ptr<const Environment> environment,
                                   const std::string& sequence, Drive drive, std::uint64_t seed, double max_duration_s)
    : implementation_(std::make_unique<Implementation>(
          world, std::move(environment), find_sequence(world, sequence).second, drive, seed, max_duration_s)) {}

SimulationSource::~SimulationSource() = default;

bool SimulationSource::next(Measurement& measurement) {
  Implementation& i = *implementation_;
  if (i.faults == nullptr) return i.next_healthy(measurement);
  for (;;) {
    if (i.faults->pop(measurement)) return true;
    Measurement healthy;
    if (i.next_healthy(healthy)) {
      i.faults->push(std::move(healthy));
    } else {
      i.faults->end();
      return i.faults->pop(measurement);
    }
  }
}

Time SimulationSource::begin_time() const {
  return implementation_->start_time;
}
Time SimulationSource::end_time() const {
  return implementation_->start_time + from_seconds(implementation_->motion.duration());
}
const Motion& SimulationSource::motion() const {
  return implementation_->motion;
}

const Reality& SimulationSource::reality() const {
  return implementation_->reality;
}
const Movers& SimulationSource::movers() const {
  return implementation_->movers;
}

std::vector<double> SimulationSource::scan_stamp_errors() const {
  std::vector<double> errors;
  for (int scan = 0; scan < implementation_->scan_count; ++scan) {
    errors.push_back(implementation_->lidar.stamp_error_s(scan));
  }
  return errors;
}

Trajectory SimulationSource::trajectory() const {
  const Implementation& i = *implementation_;
  Trajectory trajectory;
  RandomStream random(i.run_seed, "survey trajectory");
  const double angle_sigma = i.survey.angle_sigma_deg * std::numbers::pi / 180.0;
  for (std::int64_t k = 0; static_cast<double>(k) / i.imu_rate_hz <= i.motion.duration(); ++k) {
    const double seconds = static_cast<double>(k) / i.imu_rate_hz;
    Pose pose = i.reality.displacement.displaced(i.motion.pose_at(seconds));
    if (i.is_survey) {
      if (!i.survey_error.empty()) pose.position += i.survey_error.at({seconds, 0.0, 0.0});
      Vector6 noise;
      noise.head<3>() = angle_sigma * random.normal3();
      noise.tail<3>() = i.survey.position_sigma_m * random.normal3();
      pose = pose.boxplus(noise);
    }
    trajectory.push_back({i.start_time + from_seconds(seconds), pose});
  }
  return trajectory;
}

}  // namespace lodestone::simulation
