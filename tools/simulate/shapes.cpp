#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "tools/simulate/scene.h"

namespace lodestone::simulation {
namespace {

/// A surface over a rectangle of parameters, as columns × rows quads of two triangles.
void append_patch(TriangleMesh& mesh, int columns, int rows, const std::function<Vector3(double, double)>& surface) {
  const auto base = static_cast<std::uint32_t>(mesh.vertices.size());
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      mesh.vertices.push_back(surface(static_cast<double>(i) / columns, static_cast<double>(j) / rows).cast<float>());
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const std::uint32_t corner = base + static_cast<std::uint32_t>(j * (columns + 1) + i);
      const std::uint32_t above = corner + static_cast<std::uint32_t>(columns + 1);
      mesh.triangles.push_back({corner, corner + 1, above + 1});
      mesh.triangles.push_back({corner, above + 1, above});
    }
  }
}

void append_box(const Solid& solid, const Pose& pose, TriangleMesh& mesh) {
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3 u = Vector3::Unit((axis + 1) % 3) * solid.size[(axis + 1) % 3];
    const Vector3 v = Vector3::Unit((axis + 2) % 3) * solid.size[(axis + 2) % 3];
    for (const double side : {-0.5, 0.5}) {
      const Vector3 center = Vector3::Unit(axis) * (solid.size[axis] * side);
      append_patch(mesh, 1, 1, [&](double a, double b) { return pose * (center + u * (a - 0.5) + v * (b - 0.5)); });
    }
  }
}

void append_cylinder(const Solid& solid, const Pose& pose, TriangleMesh& mesh) {
  const double full_turn = 2.0 * std::numbers::pi;
  const int around = std::max(12, static_cast<int>(std::ceil(full_turn * solid.radius_m / solid.facet_m)));
  const auto at = [&](double angle, double radius, double height) {
    return pose * Vector3(radius * std::cos(angle), radius * std::sin(angle), height);
  };
  append_patch(mesh, around, 1,
               [&](double a, double b) { return at(a * full_turn, solid.radius_m, b * solid.height_m); });
  append_patch(mesh, around, 1,
               [&](double a, double b) { return at(a * full_turn, b * solid.radius_m, solid.height_m); });
}

/// Round vault and flat floor along an arc; both ends are open.
void append_tube(const Solid& solid, const Pose& pose, TriangleMesh& mesh) {
  const double length = solid.tube_end_m - solid.tube_begin_m;
  const int along = std::max(1, static_cast<int>(std::ceil(length / solid.facet_m)));
  const double radius = solid.radius_m;
  const double half_width = std::sqrt(radius * radius - solid.tube_center_height_m * solid.tube_center_height_m);
  const auto distance = [&](double a) { return solid.tube_begin_m + a * length; };
  const int across = std::max(1, static_cast<int>(std::ceil(2.0 * half_width / solid.facet_m)));
  append_patch(mesh, along, across, [&](double a, double b) {
    return pose * tube_point(solid, {distance(a), (2.0 * b - 1.0) * half_width, 0.0});
  });
  const double first = std::atan2(-solid.tube_center_height_m, half_width);
  const double span = std::numbers::pi - 2.0 * first;
  const int around = std::max(3, static_cast<int>(std::ceil(span * radius / solid.facet_m)));
  append_patch(mesh, along, around, [&](double a, double b) {
    const double angle = first + b * span;
    return pose * tube_point(solid, {distance(a), radius * std::cos(angle),
                                     solid.tube_center_height_m + radius * std::sin(angle)});
  });
}

void append_triangles(const Solid& solid, const Pose& pose, TriangleMesh& mesh) {
  switch (solid.shape) {
    case SolidShape::group:
      return;
    case SolidShape::rectangle:
      return append_patch(mesh, 1, 1, [&](double a, double b) {
        return pose * Vector3((a - 0.5) * solid.size.x(), (b - 0.5) * solid.size.y(), 0.0);
      });
    case SolidShape::box:
      return append_box(solid, pose, mesh);
    case SolidShape::cylinder:
      return append_cylinder(solid, pose, mesh);
    case SolidShape::tube:
      return append_tube(solid, pose, mesh);
  }
}

}  // namespace

void append_shape(const Solid& solid, const Pose& pose, TriangleMesh& mesh) {
  mesh.surface_of_triangle.resize(mesh.triangles.size());
  append_triangles(solid, pose, mesh);
  const Surface surface{solid.transparency, solid.max_incidence_deg};
  const auto known = std::find(mesh.surfaces.begin(), mesh.surfaces.end(), surface);
  const auto index = static_cast<std::uint16_t>(known - mesh.surfaces.begin());
  if (known == mesh.surfaces.end()) mesh.surfaces.push_back(surface);
  mesh.surface_of_triangle.resize(mesh.triangles.size(), index);
}

}  // namespace lodestone::simulation
