#include "tools/calibrate/shown_changes.h"

#include <algorithm>
#include <cmath>

namespace lodestone {

namespace {

constexpr double kSigmas = 2.0;
constexpr double kRoundingShare = 1e-9;  // of the prior sigma: a smaller rest after conditioning is a rounding error
constexpr int kPerMagnetometer = 12;

constexpr std::array<const char*, kPerMagnetometer> kNames{"hard iron x", "hard iron y", "hard iron z", "scale x",
                                                           "scale y",     "scale z",     "shear xy",    "shear xz",
                                                           "shear yz",    "turn x",      "turn y",      "turn z"};

/// Conditions mean and covariance on the parameter being zero.
void set_to_zero(Eigen::Index parameter, Eigen::VectorXd& mean, Eigen::MatrixXd& covariance) {
  const double variance = covariance(parameter, parameter);
  if (variance > 0.0) {
    const Eigen::VectorXd gain = covariance.col(parameter) / variance;
    mean -= gain * mean[parameter];
    covariance -= gain * covariance.row(parameter).eval();
  }
  mean[parameter] = 0.0;
  covariance.row(parameter).setZero();
  covariance.col(parameter).setZero();
}

struct Significance {
  std::vector<bool> kept;  ///< of each parameter
  Eigen::VectorXd change;  ///< as tested
  Eigen::VectorXd sigma;   ///< as tested
};

/// Whether each parameter is significant; insignificant parameters are set to zero in `mean`.
Significance keep_significant(Eigen::VectorXd& mean, Eigen::MatrixXd covariance) {
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  Significance result{std::vector<bool>(static_cast<std::size_t>(mean.size()), true), mean, sigma};
  while (true) {
    Eigen::Index least = -1;
    double least_ratio = kSigmas;
    for (Eigen::Index i = 0; i < mean.size(); ++i) {
      if (!result.kept[static_cast<std::size_t>(i)]) continue;
      const double now = std::max(std::sqrt(std::max(covariance(i, i), 0.0)), kRoundingShare * sigma[i]);
      result.change[i] = mean[i];
      result.sigma[i] = now;
      const double ratio = now > 0.0 ? std::abs(mean[i]) / now : 0.0;
      if (ratio >= least_ratio) continue;
      least = i;
      least_ratio = ratio;
    }
    if (least < 0) return result;
    result.kept[static_cast<std::size_t>(least)] = false;
    set_to_zero(least, mean, covariance);
  }
}

}  // namespace

ShownChanges shown_changes(const MagnetometerCalibrationResult& result) {
  ShownChanges changes;
  std::vector<std::size_t> active;
  for (std::size_t j = 0; j < result.magnetometers.size(); ++j) {
    changes.calibrations.emplace_back();
    changes.taken.emplace_back().fill(false);
    changes.tested.emplace_back();
    if (result.magnetometers[j].readings > 0) active.push_back(j);
  }
  Eigen::VectorXd mean(kPerMagnetometer * static_cast<Eigen::Index>(active.size()));
  for (std::size_t i = 0; i < active.size(); ++i) {
    const MagnetometerCalibration& found = result.magnetometers[active[i]].calibration;
    mean.segment<kPerMagnetometer>(kPerMagnetometer * static_cast<Eigen::Index>(i)) << found.hard_iron_ut,
        distortion_of(found.distortion);
  }
  const Significance found = keep_significant(mean, result.covariance);
  for (std::size_t i = 0; i < active.size(); ++i) {
    const auto row = kPerMagnetometer * static_cast<Eigen::Index>(i);
    changes.calibrations[active[i]] = {mean.segment<3>(row), distortion_matrix(mean.segment<9>(row + 3))};
    std::copy_n(found.kept.begin() + row, kPerMagnetometer, changes.taken[active[i]].begin());
    changes.tested[active[i]] = {found.change.segment<kPerMagnetometer>(row),
                                 found.sigma.segment<kPerMagnetometer>(row)};
  }
  return changes;
}

std::string left_as_given(const ShownChanges& changes, const std::vector<MagnetometerModel>& magnetometers,
                          const MagnetometerCalibrationResult& result) {
  std::string text;
  for (std::size_t j = 0; j < changes.taken.size(); ++j) {
    const auto& taken = changes.taken[j];
    if (result.magnetometers[j].readings == 0 || std::all_of(taken.begin(), taken.end(), [](bool one) { return one; }))
      continue;
    std::string names;
    for (int i = 0; i < kPerMagnetometer; ++i) {
      if (!taken[static_cast<std::size_t>(i)])
        names += (names.empty() ? "" : ", ") + std::string(kNames[static_cast<std::size_t>(i)]);
    }
    const bool nothing = std::none_of(taken.begin(), taken.end(), [](bool one) { return one; });
    text += (text.empty() ? "" : "; ") + magnetometers[j].name + ": " + (nothing ? "everything" : names);
  }
  return text;
}

}  // namespace lodestone
