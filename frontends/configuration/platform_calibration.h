#pragma once

#include <string>

#include "core/sensor_suite.h"
#include "frontends/configuration/configuration_node.h"

namespace lodestone {

/// Reads the map of calibration sigmas under `key` of `parent`. Missing sigmas keep their default (grade `field`).
/// `Sigmas`: LidarCalibrationSigmas, or those of the magnetometers, the IMU or the wheels. Throws InputError, with file
/// and line, for an unknown key or a sigma out of range.
template <class Sigmas>
void read_calibration_sigmas(const ConfigurationNode& parent, const std::string& key, Sigmas& sigmas);

/// YAML lines under `key`, `depth` levels deep, that are parsed to the same bits.
template <class Sigmas>
std::string calibration_sigma_lines(int depth, const std::string& key, Sigmas sigmas);

}  // namespace lodestone
