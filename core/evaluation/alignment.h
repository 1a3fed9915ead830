#pragma once

#include <optional>
#include <vector>

#include "core/evaluation/association.h"
#include "core/options.h"

namespace lodestone {

/// How an estimate is aligned with the ground truth before the comparison.
enum class Alignment {
  none,   ///< no alignment: both are in the map frame
  se3,    ///< rotation and translation, least squares over all positions
  sim3,   ///< rotation, translation and scale
  origin  ///< the first pair's poses coincide
};

constexpr auto enum_names(Alignment) {
  return EnumNames<Alignment, 4>{
      {{Alignment::none, "none"}, {Alignment::se3, "se3"}, {Alignment::sim3, "sim3"}, {Alignment::origin, "origin"}}};
}

/// A similarity p ↦ scale R p + t. Poses are rotated, and their positions are mapped.
struct Similarity {
  Quaternion rotation = Quaternion::Identity();
  Vector3 translation = Vector3::Zero();  ///< metres
  double scale = 1.0;

  Vector3 operator*(const Vector3& point) const { return scale * (rotation * point) + translation; }
  Pose operator*(const Pose& pose) const { return {(rotation * pose.rotation).normalized(), *this * pose.position}; }
};

/// The similarity (of scale 1 without `with_scale`) that minimizes Σ |to_i − S from_i|². Nothing if the rotation is
/// undetermined: fewer than three points, or collinear points. Source: Umeyama, PAMI 1991, eq. (34)–(43). Throws
/// std::invalid_argument if the sizes differ.
std::optional<Similarity> umeyama(const std::vector<Vector3>& from, const std::vector<Vector3>& to, bool with_scale);

/// The similarity that maps the estimates of `pairs` to the ground truth. Nothing if the pairs do not determine it.
std::optional<Similarity> find_alignment(const PosePairs& pairs, Alignment alignment);

/// `pairs` with every estimate mapped by `similarity`.
PosePairs align(const Similarity& similarity, PosePairs pairs);

}  // namespace lodestone
