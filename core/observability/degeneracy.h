#pragma once

#include <span>

#include "core/geometry/slide.h"
#include "core/option_checks.h"
#include "core/options.h"

namespace lodestone {

struct Correspondence;

/// The criterion by which a direction of the pose is degenerate for LiDAR.
enum class DegeneracyRule {
  none,          ///< no mask: the factors' own weighting
  paper,         ///< eigenvalues of LiDAR's Σ JᵀJ with unit weight on metres, against τ = 15 (paper, eq. for d_i)
  marginal,      ///< predicted sigma, from the window's marginal information of LiDAR and IMU (docs/design/009)
  probabilistic  ///< probability that this information exceeds the spurious information of noisy normals
};

constexpr auto enum_names(DegeneracyRule) {
  return EnumNames<DegeneracyRule, 4>{{{DegeneracyRule::none, "none"},
                                       {DegeneracyRule::paper, "paper"},
                                       {DegeneracyRule::marginal, "marginal"},
                                       {DegeneracyRule::probabilistic, "probabilistic"}}};
}

enum class MaskKind {
  hard,  ///< a direction is kept or not
  soft   ///< kept by a share that falls smoothly around the limit
};

constexpr auto enum_names(MaskKind) {
  return EnumNames<MaskKind, 2>{{{MaskKind::hard, "hard"}, {MaskKind::soft, "soft"}}};
}

struct DegeneracyOptions {
  DegeneracyRule rule = DegeneracyRule::marginal;
  MaskKind mask = MaskKind::hard;
  double paper_threshold = 15.0;
  double max_sigma_m = 0.01;
  double min_probability = 0.95;

  template <class Visitor>
  void visit(Visitor& visitor) {
    visitor.field("rule", rule,
                  "criterion by which a direction is degenerate for LiDAR: none, paper, marginal or probabilistic");
    visitor.field("mask", mask,
                  "how LiDAR acts in a degenerate direction: hard (not at all) or soft (with a weight from 0 to 1)");
    visitor.field("paper_threshold", paper_threshold,
                  "paper: smallest eigenvalue of ΣJᵀJ (unit weights) of a direction that is not degenerate (τ)");
    visitor.field(
        "max_sigma_m", max_sigma_m,
        "marginal and probabilistic: a direction is degenerate if its predicted sigma exceeds this, and in the "
        "smoother that of a single point too, and 0.03 where no magnetic field holds it; rotations are converted to "
        "metres by the scan's rms range");
    visitor.field(
        "min_probability", min_probability,
        "probabilistic: a direction is degenerate if its sigma is below max_sigma_m with a smaller probability than "
        "this");
  }

  void check() const {
    option_checks::positive("paper_threshold", paper_threshold);
    option_checks::positive("max_sigma_m", max_sigma_m);
    option_checks::within("min_probability", min_probability, 0.0, 1.0);
  }
};

/// Assumptions of the probabilistic rule about the noise of normals (docs/design/009-degeneracy-rule.md).
struct NormalNoise {
  double level_uncertainty = 0.5;    ///< relative sigma of the noise level, since the planes' variances are estimates
  double min_signal_to_noise = 3.0;  ///< smallest ratio of a direction's information to its spurious information
};

/// Eigenanalysis of a pose's information, and the mask that follows from it. Directions live in the scaled tangent y =
/// S x, S = diag(ℓ, ℓ, ℓ, 1, 1, 1): rotations in metres at the lever arm ℓ.
struct Degeneracy {
  Matrix6 directions = Matrix6::Identity();  ///< columns: unit eigenvectors in y, largest information first
  Vector6 sigma_m = Vector6::Zero();         ///< predicted sigma of each, metres; infinite without information
  Vector6 kept = Vector6::Ones();            ///< D: share of LiDAR information kept in each, 0 to 1
  double lever_arm_m = 1.0;                  ///< ℓ
  int degenerate_directions = 0;             ///< directions beyond the limit

  /// P = S⁻¹ V D Vᵀ S in the tangent order φ, p: LiDAR factors depend on x₀ ⊞ P (x ⊟ x₀).
  Matrix6 lidar_projector() const;

  /// The slide along the degenerate direction, at the pose of the analysis. Empty unless exactly one direction is
  /// degenerate.
  Slide slide(const Pose& pose) const;

  /// I − P: the share that the mask leaves to the magnetic factors.
  Matrix6 magnetic_projector() const { return Matrix6::Identity() - lidar_projector(); }
};

/// Nothing masked.
Degeneracy no_degeneracy();

/// Decides by predicted sigma. `information`: of the pose, tangent order φ, p (1/rad², 1/m²), without the spurious
/// information. The matrix may therefore be indefinite: a direction with no or negative information has infinite sigma.
/// `lever_arm_m`: positive.
Degeneracy analyse_by_sigma(const Matrix6& information, double lever_arm_m, const DegeneracyOptions& options);

/// Decides by the paper's rule. `unit_hessian`: Σ JᵀJ with weight one on metres. sigma_m is 1/√eigenvalue.
Degeneracy analyse_by_eigenvalue(const Matrix6& unit_hessian, const DegeneracyOptions& options);

/// Decides by probability. Errors of the planes' normals add noise N to the information along a direction; N is
/// Gaussian with mean μ and sigma s. The measured λ suffices if, without N, it reaches 1 / max_sigma_m² and
/// min_signal_to_noise times N: p = P(N < λ − 1 / max_sigma_m² and N < λ / (1 + min_signal_to_noise)). A soft mask
/// keeps the share p; a hard mask keeps a direction if p reaches min_probability. Directions are sorted by falling p.
/// After Hatleskog & Alexis, "Probabilistic Degeneracy Detection for Point-to-Plane Error Minimization", RA-L 2024, who
/// use the ratio alone; the level in metres is added here. `information`: as above, with the mean of the noise
/// subtracted once; `spurious`: the subtracted matrix, which gives μ. s is μ times the relative sigma of the noise in
/// this scan's information (information_noise of `correspondences` at `T_map_imu`) and of its level
/// (assumed.level_uncertainty). Scans of a window meet the same planes, so they share their noise.
Degeneracy analyse_by_probability(const Matrix6& information, const Matrix6& spurious,
                                  std::span<const Correspondence> correspondences, const Pose& T_map_imu,
                                  double lever_arm_m, const DegeneracyOptions& options,
                                  const NormalNoise& assumed = {});

/// Rotates each degenerate direction to the nearest direction that the IMU does not observe either: translations, and
/// rotation about the vertical (`up`: unit, imu frame). Otherwise gravity would give information about a masked
/// direction, because noise mixes the axis of a tunnel with the weakly observed roll. A soft mask is returned
/// unchanged, and so is a mask with a direction more than 0.5 rad away. docs/design/010
Degeneracy without_tilt(const Degeneracy& degeneracy, const Vector3& up);

/// `now` with its degenerate directions carried over from `before` and rotated towards its own by the share `gain`.
/// Only a rigid motion of the whole trajectory is unobservable for the IMU and, along a degenerate direction, for
/// LiDAR. Degenerate directions of neighbouring poses must therefore be one rigid motion, or their difference counts as
/// information (docs/design/010). `now` is returned unchanged if the numbers of degenerate directions differ, if the
/// directions differ by more than 0.2 rad, or if a mask is soft. `pose_before`, `pose_now`: the poses of the analyses.
Degeneracy follow(const Degeneracy& now, const Pose& pose_now, const Degeneracy& before, const Pose& pose_before,
                  double gain);

}  // namespace lodestone
