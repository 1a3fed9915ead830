#include "frontends/configuration/platform_calibration.h"

#include "frontends/configuration/options.h"

namespace lodestone {
namespace {

// Larger than any calibration; a larger value has the wrong unit.
constexpr double largest_translation_m = 1.0;
constexpr double largest_rotation_deg = 45.0;
constexpr double largest_clock_s = 1.0;
constexpr double largest_offset_ut = 1000.0;
constexpr double largest_share = 0.5;

/// Each calls visit(key, sigma, bound) for each sigma, in the order of the file.
template <class Sigmas, class Visit>
void visit_place_and_clock(Sigmas& sigmas, const Visit& visit) {
  visit("translation_sigma_m", sigmas.translation_sigma_m, largest_translation_m);
  visit("rotation_sigma_deg", sigmas.rotation_sigma_deg, largest_rotation_deg);
  visit("clock_sigma_s", sigmas.clock_sigma_s, largest_clock_s);
}

template <class Visit>
void visit_sigmas(LidarCalibrationSigmas& sigmas, const Visit& visit) {
  visit_place_and_clock(sigmas, visit);
  visit("map_displacement_sigma_m", sigmas.map_displacement_sigma_m, largest_translation_m);
}

template <class Visit>
void visit_sigmas(MagnetometerCalibrationSigmas& sigmas, const Visit& visit) {
  visit_place_and_clock(sigmas, visit);
  visit("offset_sigma_ut", sigmas.offset_sigma_ut, largest_offset_ut);
  visit("matrix_sigma", sigmas.matrix_sigma, largest_share);
  visit("survey_pose_sigma_m", sigmas.survey_pose_sigma_m, largest_translation_m);
}

template <class Visit>
void visit_sigmas(ImuCalibrationSigmas& sigmas, const Visit& visit) {
  visit("scale_sigma", sigmas.scale_sigma, largest_share);
  visit("misalignment_sigma_deg", sigmas.misalignment_sigma_deg, largest_rotation_deg);
}

template <class Visit>
void visit_sigmas(WheelCalibrationSigmas& sigmas, const Visit& visit) {
  visit("scale_sigma", sigmas.scale_sigma, largest_share);
  visit("rotation_sigma_deg", sigmas.rotation_sigma_deg, largest_rotation_deg);
  visit("slip_sigma", sigmas.slip_sigma, largest_share);
}

}  // namespace

template <class Sigmas>
void read_calibration_sigmas(const ConfigurationNode& parent, const std::string& key, Sigmas& sigmas) {
  const ConfigurationNode* node = parent.find(key);
  if (node == nullptr) return;
  std::vector<std::string> known;
  visit_sigmas(sigmas, [&](const char* name, double& sigma, double most) {
    known.emplace_back(name);
    const ConfigurationNode* child = node->find(name);
    if (child == nullptr) return;
    sigma = child->as_double();
    if (!(sigma >= 0.0 && sigma <= most)) {
      child->fail("expected a standard deviation of 0 (exact) to " + options_detail::write_value(most));
    }
  });
  node->refuse_keys_other_than(known);
}

template <class Sigmas>
std::string calibration_sigma_lines(int depth, const std::string& key, Sigmas sigmas) {
  const std::string indent(static_cast<std::size_t>(2 * depth), ' ');
  std::string text = indent + key + ":\n";
  visit_sigmas(sigmas, [&](const char* name, double sigma, double) {
    text += indent + "  " + name + ": " + options_detail::write_value(sigma) + "\n";
  });
  return text;
}

template void read_calibration_sigmas(const ConfigurationNode&, const std::string&, LidarCalibrationSigmas&);
template void read_calibration_sigmas(const ConfigurationNode&, const std::string&, MagnetometerCalibrationSigmas&);
template void read_calibration_sigmas(const ConfigurationNode&, const std::string&, ImuCalibrationSigmas&);
template void read_calibration_sigmas(const ConfigurationNode&, const std::string&, WheelCalibrationSigmas&);
template std::string calibration_sigma_lines(int, const std::string&, LidarCalibrationSigmas);
template std::string calibration_sigma_lines(int, const std::string&, MagnetometerCalibrationSigmas);
template std::string calibration_sigma_lines(int, const std::string&, ImuCalibrationSigmas);
template std::string calibration_sigma_lines(int, const std::string&, WheelCalibrationSigmas);

}  // namespace lodestone
