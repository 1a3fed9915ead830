#include "tools/origin_option.h"

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "core/error.h"

namespace lodestone {

CLI::Option* add_origin(CLI::App& command, const char* what, Vector3& origin_m) {
  return command
      .add_option_function<std::vector<double>>(
          "--origin",
          [&origin_m](const std::vector<double>& values) {
            origin_m = Vector3(values[0], values[1], values[2]);
            if (!origin_m.allFinite()) throw InputError("--origin: expected three finite numbers, metres");
          },
          std::string("x,y,z of the site's origin in the georeferenced coordinates, metres; ") + what)
      ->delimiter(',')
      ->expected(3);
}

Trajectory georeferenced(Trajectory trajectory, const Vector3& origin_m) {
  for (StampedPose& pose : trajectory) pose.pose.position += origin_m;
  return trajectory;
}

}  // namespace lodestone
