#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "core/error.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/maps/point_cloud_file.h"
#include "frontends/maps/point_cloud_writer.h"
#include "frontends/maps/shifted_magnetic_map.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/origin_option.h"
#include "tools/progress.h"
#include "tools/writers/output_folder.h"

namespace lodestone {
namespace {

constexpr const char* kExamples = R"(
A cloud map (LAS, PLY or PCD) becomes a PCD or PLY, by the ending of --out. A magnetic map's YAML gets its own image. A
trajectory (TUM or EuRoC csv) becomes a TUM file.

Examples, for a site in UTM coordinates:
  lodestone shift survey.las --origin 432000,4583000,0 --out site.pcd
  lodestone shift truth_utm.tum --origin 432000,4583000,0 --out truth.tum
  lodestone shift field.yaml --origin 432000,4583000,0 --back --out field_utm.yaml
  lodestone shift run/smoother/trajectory.tum --origin 432000,4583000,0 --back --out trajectory_utm.tum)";

struct ShiftCall {
  std::string file;
  std::string out;
  Vector3 origin_m = Vector3::Zero();
  bool back = false;
  bool force = false;
};

void shift_cloud(const ShiftCall& call) {
  const Vector3 none = Vector3::Zero();
  WarningLog warnings;
  make_folder_of(call.out);
  PointCloudWriter writer(call.out, call.back ? call.origin_m : none);
  stream_point_cloud(
      call.file, warnings,
      [&writer](std::span<const Eigen::Vector3f> piece) {
        throw_if_interrupted();
        writer.add(piece);
      },
      call.back ? none : call.origin_m);
  writer.commit();
  fmt::print("{}: {} points\n", call.out, writer.count());
  for (const auto& [kind, entry] : warnings.entries()) {
    fmt::print("warning {} ({}): {}\n", kind, entry.count, entry.first_detail);
  }
}

void shift_trajectory(const ShiftCall& call, const Vector3& shift_m) {
  const Trajectory trajectory = read_trajectory(call.file, -shift_m);
  output_with_ending(call.out, ".tum");
  write_tum(call.out, trajectory, fmt::format("shifted by {:f} {:f} {:f} m", shift_m.x(), shift_m.y(), shift_m.z()));
  fmt::print("{}: {} poses\n", call.out, trajectory.size());
}

void shift(const ShiftCall& call) {
  const Vector3 shift_m = call.back ? call.origin_m : Vector3(-call.origin_m);
  const SeemingKind kind = seeming_kind_of_file(call.file);
  refuse_to_replace(call.out, call.force);
  if (kind == SeemingKind::point_cloud) return shift_cloud(call);
  if (kind == SeemingKind::magnetic_map) {
    yaml_output(call.out);
    refuse_to_replace(call.out, call.force, {".tif"});
    shift_magnetic_map(call.file, call.out, shift_m);
    fmt::print("{}: magnetic map\n", call.out);
    return;
  }
  if (kind != SeemingKind::trajectory && kind != SeemingKind::unknown) {
    throw InputError(call.file + ": expected a cloud map, a magnetic map's YAML or a trajectory" +
                     looks_like(call.file));
  }
  shift_trajectory(call, shift_m);
}

}  // namespace

void add_shift_command(CLI::App& app) {
  const auto call = std::make_shared<ShiftCall>();
  CLI::App* command =
      app.add_subcommand("shift", "Shift a georeferenced map or trajectory to an origin at the site, or back");
  command->footer(kExamples);
  CommandFiles files(*command);
  files.input(command->add_option("FILE", call->file, "cloud map, magnetic map or trajectory"))->required();
  add_origin(*command, "subtracted from all positions", call->origin_m)->required();
  command->add_flag("--back", call->back, "add the origin instead: from the site to georeferenced coordinates");
  files
      .output(command->add_option("--out", call->out, "the file to write: .pcd or .ply, .yaml, .tum"),
              CommandFiles::with_endings({".tif"}))
      ->required();
  command->add_flag("--force", call->force, "replace the file if it exists");
  command->callback([call] { shift(*call); });
}

}  // namespace lodestone
