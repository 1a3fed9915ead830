#pragma once

#include "core/geometry/trajectory.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace lodestone {

/// Declares --origin x,y,z: the site's origin in georeferenced coordinates, metres. `what` it does, for the help.
/// `origin_m` must outlive the command; it stays zero without the option. Throws InputError if a number is not finite.
CLI::Option* add_origin(CLI::App& command, const char* what, Vector3& origin_m);

/// The poses from the origin of the georeferenced coordinates instead of the site's.
Trajectory georeferenced(Trajectory trajectory, const Vector3& origin_m);

}  // namespace lodestone
