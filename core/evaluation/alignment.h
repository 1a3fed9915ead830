#pragma once

#include <optional>
#include <vector>

#include "core/evaluation/association.h"
#include "core/options.h"

namespace lodestone {

/// How an estimate is moved onto the truth before it is compared.
enum class Alignment {
  none,   ///< not at all: the map frame is the truth
  se3,    ///< rotation and translation, least squares over all positions
  sim3,   ///< the same with a scale
  origin  ///< the first pair's poses coincide
};

constexpr auto enum_names(Alignment) {
  return EnumNames<Alignment, 4>{
      {{Alignment::none, "none"}, {Alignment::se3, "se3"}, {Alignment::sim3, "sim3"}, {Alignment::origin, "origin"}}};
}

/// A similarity p ↦ scale R p + t. Poses take the rotation and have their position mapped.
struct Similarity {
  Quaternion rotation = Quaternion::Identity();
  Vector3 translation = Vector3::Zero();  ///< metres
  double scale = 1.0;

  Vector3 operator*(const Vector3& point) const { return scale * (rotation * point) + translation; }
  Pose operator*(const Pose& pose) const { return {(rotation * pose.rotation).normalized(), *this * pose.position}; }
};

/// The similarity (of scale 1 without `with_scale`) that minimizes Σ |to_i − S from_i|². Nothing where the points do
/// not fix the rotation: fewer than three, or all on one line. Source: Umeyama, PAMI 1991, eq. (34)–(43). Throws
/// std::invalid_argument when the sizes differ.
std::optional<Similarity> umeyama(const std::vector<Vector3>& from, const std::vector<Vector3>& to, bool with_scale);

/// The similarity that takes the estimates of `pairs` to the truth; nothing where the pairs do not determine it.
std::optional<Similarity> find_alignment(const PosePairs& pairs, Alignment alignment);

/// `pairs` with every estimate moved by `similarity`.
PosePairs align(const Similarity& similarity, PosePairs pairs);

}  // namespace lodestone
