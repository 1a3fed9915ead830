#include "tools/simulate/world_queries.h"

#include "tools/simulate/world.h"

namespace lodestone::simulation {

double magnetometer_noise_ut(const std::string& world_file, const std::vector<std::string>& assignments) {
  return load_world(world_file, assignments).magnetometers.noise_ut;
}

void require_in_world(const std::string& world_file, const std::vector<std::string>& assignments,
                      const std::string& sequence, const std::vector<std::string>& scenes) {
  const World world = load_world(world_file, assignments);
  find_sequence(world, sequence);
  for (const std::string& scene : scenes) {
    if (scene != no_scene) find_scene(world, scene);
  }
}

}  // namespace lodestone::simulation
