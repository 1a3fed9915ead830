#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>

#include "core/error.h"
#include "core/stopwatch.h"
#include "core/thread_limit.h"
#include "frontends/configuration/platform.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/point_cloud_writer.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/progress.h"
#include "tools/shipped_files.h"
#include "tools/simulate/bag_recorder.h"
#include "tools/simulate/cloud_map.h"
#include "tools/simulate/obstacles.h"
#include "tools/simulate/reality_yaml.h"
#include "tools/simulate/simulation_source.h"
#include "tools/writers/output_folder.h"

namespace lodestone {
namespace {

struct SimulateOptions {
  std::string world;
  std::string out;
  std::string sequence;
  std::string scene;
  std::string reality;
  std::vector<std::string> only{"log", "cloud", "survey"};

  bool writes(const char* part) const { return std::find(only.begin(), only.end(), part) != only.end(); }
  std::vector<std::string> settings;
  std::uint64_t seed = 1;
  double duration_s = std::numeric_limits<double>::infinity();
  int threads = 0;
};

/// The world's sensors as stated in the user's platform file.
Platform make_platform(const simulation::World& world, const simulation::Reality& reality) {
  Platform platform;
  platform.name = world.name;
  platform.suite = simulation::believed_suite(world, reality);
  platform.lidar = simulation::message_layout(simulation::scan_format(world.lidar));
  for (std::size_t j = 0; j < platform.suite.magnetometers.size(); ++j)
    platform.magnetometers.push_back({fmt::format("/magnetometer_{}/field", j), FieldUnit::tesla});
  platform.wheels.topic = "/wheels";
  return platform;
}

void record(simulation::SimulationSource& source, const Platform& platform, simulation::ScanFormat format,
            const std::string& path) {
  const Stopwatch writing;
  simulation::BagRecorder::Topics topics{platform.lidar.topic, platform.imu.topic, {}, platform.wheels.topic};
  for (const auto& magnetometer : platform.magnetometers) topics.magnetometers.push_back(magnetometer.topic);
  simulation::BagRecorder recorder(path, topics, format);
  Progress progress(std::filesystem::path(path).filename().string(), source.begin_time(), source.end_time());
  Measurement measurement;
  while (source.next(measurement)) {
    recorder.write(measurement);
    progress.advance(completion_time(measurement));
  }
  recorder.close();
  progress.finish();
  fmt::print("{}: {:.1f} s of log, {:.0f} MB, written in {:.1f} s\n", path,
             to_seconds(source.end_time() - source.begin_time()),
             static_cast<double>(std::filesystem::file_size(path)) * 1e-6, writing.elapsed_s());
}

void write_cloud(const simulation::World& world, std::shared_ptr<const simulation::Environment> environment,
                 std::uint64_t seed, const std::string& path) {
  const auto cloud = simulation::sample_cloud(world, *environment, seed);
  if (cloud.empty()) {
    throw InputError(world.file + ": the cloud map is empty: no surface is visible from the paths of the sequences");
  }
  write_point_cloud(path, cloud);
  fmt::print("{}: {} points\n", path, cloud.size());
}

/// Builds environments. The last one is kept, because the parts of a simulation often share it.
class Environments {
 public:
  Environments(const simulation::World& world, const simulation::MovedObjects& moved)
      : world_(world), nothing_moved_(moved.mapped.empty() && moved.driven.empty()) {}

  std::shared_ptr<const simulation::Environment> get(const std::string& scene,
                                                     const simulation::Rearrangement& rearrangement) {
    const bool same = last_ != nullptr && last_->scene_name == scene;
    if (same && (nothing_moved_ || last_rearrangement_ == &rearrangement)) return last_;
    last_.reset();
    last_ = std::make_shared<const simulation::Environment>(world_, scene, rearrangement);
    last_rearrangement_ = &rearrangement;
    return last_;
  }

 private:
  const simulation::World& world_;
  bool nothing_moved_;
  std::shared_ptr<const simulation::Environment> last_;
  const simulation::Rearrangement* last_rearrangement_ = nullptr;
};

void print_contents(const SimulateOptions& options, const std::string& sequence,
                    const simulation::Environment& environment) {
  fmt::print("{}: sequence {}, seed {}{}, {} triangles, {} pieces of steel\n", options.world, sequence, options.seed,
             environment.scene_name.empty() ? "" : ", scene " + environment.scene_name,
             environment.scene.mesh.triangles.size(), environment.scene.sources.size());
}

void warn_of_obstacles(const simulation::SimulationSource& source, const simulation::Environment& environment,
                       const std::string& drive) {
  const std::vector<simulation::Obstacle> obstacles =
      simulation::obstacles_on_path(source.motion(), environment.caster);
  if (obstacles.empty()) return;
  const Vector3& place = obstacles.front().position;
  fmt::print(
      "warning: {} passes through a surface {:.1f} s after the start, at x {:.2f} y {:.2f} z {:.2f}{}; move its "
      "waypoints or the solid\n",
      drive, obstacles.front().seconds, place.x(), place.y(), place.z(),
      obstacles.size() == 1 ? "" : fmt::format(", and at {} more place(s)", obstacles.size() - 1));
}

void simulate(const SimulateOptions& options) {
  using Drive = simulation::SimulationSource::Drive;
  const ThreadLimit limit(options.threads);
  std::vector<std::string> settings = options.settings;
  if (!options.reality.empty()) settings.push_back("reality.grade=" + options.reality);
  const simulation::World world = simulation::load_world(options.world, settings);
  const auto& [sequence, drive_plan] = simulation::find_sequence(world, options.sequence);
  const std::string scene = options.scene.empty()                   ? drive_plan.scene
                            : options.scene == simulation::no_scene ? std::string{}
                                                                    : options.scene;
  if (!(options.duration_s >= 1.0 / world.lidar.rate_hz)) {
    throw InputError(fmt::format("--duration: expected at least one scan of the LiDAR, {:g} s, found {:g} s",
                                 1.0 / world.lidar.rate_hz, options.duration_s));
  }
  simulation::find_scene(world, scene);  // rejects an unknown scene before anything is written
  made_folder(options.out);
  const auto path = [&](const char* name) { return (std::filesystem::path(options.out) / name).string(); };

  const simulation::Reality reality = simulation::draw_reality(world, options.seed);
  const simulation::MovedObjects moved = simulation::draw_moved_objects(world, options.seed);
  const Platform platform = make_platform(world, reality);
  save_platform(platform, path("platform.yaml"));
  Environments environments(world, moved);
  if (options.writes("cloud")) {
    // The cloud map may have been surveyed in another scene than the robot drives in.
    const auto environment = environments.get(world.cloud.scene, moved.mapped);
    if (!options.writes("log") && !options.writes("survey")) print_contents(options, sequence, *environment);
    write_cloud(world, environment, options.seed, path("cloud.pcd"));
  }
  if (options.writes("survey")) {
    const auto environment = environments.get(scene, moved.mapped);
    if (!options.writes("log")) print_contents(options, sequence, *environment);
    simulation::SimulationSource survey(world, environment, sequence, Drive::survey, options.seed,
                                        std::numeric_limits<double>::infinity());
    warn_of_obstacles(survey, *environment, "the survey of sequence " + sequence);
    write_tum(path("survey.tum"), survey.trajectory(),
              fmt::format("T_map_imu at the IMU's stamps, survey grade: noise {} m, {} deg; t x y z qx qy qz qw",
                          world.survey.position_sigma_m, world.survey.angle_sigma_deg));
    record(survey, platform, simulation::scan_format(world.lidar), path("survey.bag"));
  }
  if (options.writes("log")) {
    const auto environment = environments.get(scene, moved.driven);
    print_contents(options, sequence, *environment);
    simulation::SimulationSource drive(world, environment, sequence, Drive::sequence, options.seed, options.duration_s);
    warn_of_obstacles(drive, *environment, "sequence " + sequence);
    write_tum(path("truth.tum"), drive.trajectory(),
              reality.displacement.empty()
                  ? "T_map_imu, exact, at the IMU's stamps; t x y z qx qy qz qw"
                  : "T_map_imu in the displaced maps, exact, at the IMU's stamps; t x y z qx qy qz qw");
    write_text_file(path("reality.yaml"), simulation::reality_yaml(world, moved, drive));
    record(drive, platform, simulation::scan_format(world.lidar), path("log.bag"));
  }
}

}  // namespace

void add_simulate_command(CLI::App& app) {
  const auto options = std::make_shared<SimulateOptions>();
  CLI::App* command = app.add_subcommand(
      "simulate", "Simulate a robot's drive through a world: write its log, ground truth, cloud map and survey");
  CommandFiles files(*command);
  files.input(command->add_option("world", options->world, "Name in config/worlds, or a YAML file"))
      ->required()
      ->type_name("WORLD");
  files
      .output(
          command->add_option("--out", options->out,
                              "Folder for log.bag, truth.tum, reality.yaml, platform.yaml, cloud.pcd, survey.bag and "
                              "survey.tum"),
          CommandFiles::within(
              {"platform.yaml", "log.bag", "truth.tum", "reality.yaml", "cloud.pcd", "survey.bag", "survey.tum"}))
      ->required()
      ->type_name("DIR");
  command->add_option("--seed", options->seed, "Seed of noise, biases and vibration; same world and seed, same bytes");
  command->add_option("--sequence", options->sequence, "Name of the drive (default: the world's first)")
      ->type_name("NAME");
  command
      ->add_option("--scene", options->scene,
                   "Additional objects (default: the sequence's own scene; none: the permanent solids alone)")
      ->type_name("NAME");
  command
      ->add_option("--reality", options->reality,
                   "Size of the errors of platform.yaml and of the maps (default: the world's own "
                   "reality.grade, mostly exact)")
      ->check(CLI::IsMember({"exact", "calibrated", "field", "rough"}))
      ->type_name("GRADE");
  command->add_option("--only", options->only, "Write only these: log (with its ground truth), cloud, survey")
      ->delimiter(',')
      ->check(CLI::IsMember({"log", "cloud", "survey"}))
      ->type_name("PART[,PART]");
  command->add_option("--duration", options->duration_s, "Cut the drive after S seconds");
  command
      ->add_option("--set", options->settings,
                   "Change a key of the world, for example sensors.magnetometers.noise_ut=5")
      ->type_name("key.path=value");
  at_least_one(command->add_option("--threads", options->threads,
                                   "Largest number of threads (default: all); the files do not depend on it"));
  command->footer(
      "Examples:\n"
      "  lodestone simulate tunnel --out /tmp/tunnel\n"
      "  lodestone simulate warehouse --out /tmp/warehouse --sequence 2 --seed 7 "
      "--set sensors.magnetometers.noise_ut=5\n"
      "  lodestone simulate carpark --scene 2026-02-06 --only survey --out /tmp/february\n"
      "  lodestone simulate warehouse --out /tmp/real --reality field\n"
      "  lodestone simulate tunnel --out /tmp/faulty "
      "--set 'faults=[{kind: hard_iron, magnetometer: front_0, offset_ut: [12, -5, 8]}]'");
  command->callback([options] {
    options->world = find_shipped("worlds", "world", options->world);
    simulate(*options);
  });
}

}  // namespace lodestone
