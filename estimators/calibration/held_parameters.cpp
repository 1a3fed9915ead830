#include "estimators/calibration/held_parameters.h"

#include <algorithm>
#include <array>
#include <cstdio>

namespace lodestone {

namespace {

constexpr double kMostlyHidden = 0.5;

constexpr std::array<const char*, 12> kNames{"offset along x",        "offset along y",        "offset along z",
                                             "scale along x",         "scale along y",         "scale along z",
                                             "shear between x and y", "shear between x and z", "shear between y and z",
                                             "rotation about x",      "rotation about y",      "rotation about z"};

std::string held_at(int parameter, const CalibrationOptions& options) {
  char text[64];
  if (parameter < 3) {
    std::snprintf(text, sizeof(text), "kept as given ± %g µT", options.hard_iron_sigma_ut);
  } else if (parameter < 9) {
    std::snprintf(text, sizeof(text), "kept as given ± %g %%", 100.0 * options.soft_iron_sigma);
  } else {
    std::snprintf(text, sizeof(text), "kept as given ± %g°", options.misalignment_sigma_deg);
  }
  return text;
}

std::string line(const std::string& who, const std::string& what, const std::string& held, bool map_changed = false) {
  return who + ": " + what + ": not determined by this motion" + (map_changed ? " in a changed field; " : "; ") + held;
}

/// The same parameter of every magnetometer, along the robot's axes, in units of the prior.
Eigen::VectorXd common_pattern(int parameter, const std::vector<MagnetometerModel>& magnetometers,
                               const std::vector<int>& active) {
  Eigen::VectorXd pattern = Eigen::VectorXd::Zero(12 * static_cast<Eigen::Index>(active.size()));
  for (std::size_t i = 0; i < active.size(); ++i) {
    const Matrix3 Q =
        magnetometers[static_cast<std::size_t>(active[i])].T_imu_mag.rotation.conjugate().toRotationMatrix();
    const auto row = 12 * static_cast<Eigen::Index>(i);
    if (parameter < 3) {
      pattern.segment<3>(row) = Q.col(parameter);
    } else {
      pattern.segment<9>(row + 3) = turned_distortion(Q).col(parameter - 3);
    }
  }
  return pattern;
}

}  // namespace

std::vector<std::string> describe_held(const ParameterGain& gain, const std::vector<MagnetometerModel>& magnetometers,
                                       const std::vector<int>& active, const CalibrationOptions& options,
                                       bool map_changed) {
  std::vector<std::string> lines;
  for (std::size_t j = 0; j < magnetometers.size(); ++j) {
    if (std::find(active.begin(), active.end(), static_cast<int>(j)) == active.end()) {
      lines.push_back(magnetometers[j].name + ": no readings; all parameters kept as given");
    }
  }
  const Eigen::VectorXd share = gain.hidden_share();
  for (int parameter = 0; parameter < 12; ++parameter) {
    std::string names;
    std::size_t hidden = 0;
    for (std::size_t i = 0; i < active.size(); ++i) {
      if (share[12 * static_cast<Eigen::Index>(i) + parameter] < kMostlyHidden) continue;
      names += (hidden++ == 0 ? "" : ", ") + magnetometers[static_cast<std::size_t>(active[i])].name;
    }
    const std::string name = kNames[static_cast<std::size_t>(parameter)];
    if (hidden > 0) {
      const std::string who = hidden == active.size() && hidden > 1 ? "every magnetometer" : names;
      lines.push_back(line(who, name + " of the sensor", held_at(parameter, options)));
    } else if (active.size() > 1 &&
               gain.hidden_share_of(common_pattern(parameter, magnetometers, active)) >= kMostlyHidden) {
      lines.push_back(
          line("all magnetometers alike", name + " of the robot", held_at(parameter, options), map_changed));
    }
  }
  const Eigen::VectorXd scale = common_pattern(3, magnetometers, active) + common_pattern(4, magnetometers, active) +
                                common_pattern(5, magnetometers, active);
  const bool named = active.empty() || share.segment(3, 3).minCoeff() >= kMostlyHidden;
  if (!named && gain.hidden_share_of(scale) >= kMostlyHidden) {
    const std::string who =
        active.size() > 1 ? "all magnetometers alike" : magnetometers[static_cast<std::size_t>(active[0])].name;
    lines.push_back(line(who, "scale along all axes together", held_at(3, options), map_changed && active.size() > 1));
  }
  return lines;
}

}  // namespace lodestone
