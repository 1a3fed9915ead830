#pragma once

#include "core/geometry/so3.h"
#include "core/options.h"

namespace lodestone {

/// What decides that a direction of the pose is not seen by LiDAR.
enum class DegeneracyRule {
  none,     ///< nothing is masked: the factors' own weighting
  paper,    ///< eigenvalues of LiDAR's Σ JᵀJ with unit weight on metres, against τ = 15 (paper, eq. for d_i)
  marginal  ///< predicted sigma of the window's marginal information of LiDAR and IMU (design.md, section 7)
};

constexpr auto enum_names(DegeneracyRule) {
  return EnumNames<DegeneracyRule, 3>{
      {{DegeneracyRule::none, "none"}, {DegeneracyRule::paper, "paper"}, {DegeneracyRule::marginal, "marginal"}}};
}

enum class MaskKind {
  hard,  ///< a direction is kept or not
  soft   ///< kept by a share that falls smoothly about the limit
};

constexpr auto enum_names(MaskKind) {
  return EnumNames<MaskKind, 2>{{{MaskKind::hard, "hard"}, {MaskKind::soft, "soft"}}};
}

struct DegeneracyOptions {
  DegeneracyRule rule = DegeneracyRule::marginal;
  MaskKind mask = MaskKind::hard;
  double paper_threshold = 15.0;
  double max_sigma_m = 0.01;
  double normal_noise_margin = 2.0;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("rule", rule, "none, paper or marginal: what decides that LiDAR does not see a direction");
    visitor.field("mask", mask, "hard or soft: whether a direction is dropped or faded out");
    visitor.field("paper_threshold", paper_threshold, "τ of the paper's rule: least eigenvalue of ΣJᵀJ, unit weights");
    visitor.field("max_sigma_m", max_sigma_m,
                  "marginal rule: a direction is degenerate above this predicted sigma; rotations count at the scan's "
                  "rms range");
    visitor.field("normal_noise_margin", normal_noise_margin,
                  "how many times the information that noisy normals pretend to give is taken off before the analysis");
  }
};

/// Eigen-analysis of a pose's information and the mask that follows from it. Directions live in the scaled tangent
/// y = S x, S = diag(ℓ, ℓ, ℓ, 1, 1, 1): rotations in metres at the lever arm ℓ.
struct Degeneracy {
  Matrix6 directions = Matrix6::Identity();  ///< columns: unit eigenvectors in y, largest information first
  Vector6 sigma_m = Vector6::Zero();         ///< predicted sigma of each, metres; infinite where nothing is known
  Vector6 kept = Vector6::Ones();            ///< D: share of LiDAR kept in each, 0 to 1
  double lever_arm_m = 1.0;                  ///< ℓ
  int degenerate_directions = 0;             ///< directions beyond the limit

  /// P = S⁻¹ V D Vᵀ S in the tangent order φ, p: LiDAR looks at x₀ ⊞ P (x ⊟ x₀).
  Matrix6 lidar_projector() const;

  /// I − P: what is left to the magnetic factors.
  Matrix6 magnetic_projector() const { return Matrix6::Identity() - lidar_projector(); }
};

/// Nothing masked.
Degeneracy no_degeneracy();

/// Decides by predicted sigma. `information`: of the pose, tangent order φ, p (1/rad², 1/m²), already without what
/// noise pretends to give; it may be indefinite for that reason: directions of no or negative information have
/// infinite sigma. `lever_arm_m`: positive.
Degeneracy analyse_by_sigma(const Matrix6& information, double lever_arm_m, const DegeneracyOptions& options);

/// Decides by the paper's rule. `unit_hessian`: Σ JᵀJ with weight one on metres. sigma_m is 1/√eigenvalue.
Degeneracy analyse_by_eigenvalue(const Matrix6& unit_hessian, const DegeneracyOptions& options);

}  // namespace lodestone
