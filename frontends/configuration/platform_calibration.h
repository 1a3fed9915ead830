#pragma once

#include <string>

#include "core/sensor_suite.h"
#include "frontends/configuration/configuration_node.h"

namespace lodestone {

/// Each reads the map of calibration sigmas under `key` of `parent`. Missing sigmas keep their default (grade `field`).
/// Throws InputError, with file and line, for an unknown key or a sigma out of range.
void read_calibration_sigmas(const ConfigurationNode& parent, const std::string& key, LidarCalibrationSigmas& sigmas);
void read_calibration_sigmas(const ConfigurationNode& parent, const std::string& key,
                             MagnetometerCalibrationSigmas& sigmas);
void read_calibration_sigmas(const ConfigurationNode& parent, const std::string& key, ImuCalibrationSigmas& sigmas);
void read_calibration_sigmas(const ConfigurationNode& parent, const std::string& key, WheelCalibrationSigmas& sigmas);

/// Each writes YAML lines under `key`, `depth` levels deep, that are parsed to the same bits.
std::string calibration_sigma_lines(int depth, const std::string& key, const LidarCalibrationSigmas& sigmas);
std::string calibration_sigma_lines(int depth, const std::string& key, const MagnetometerCalibrationSigmas& sigmas);
std::string calibration_sigma_lines(int depth, const std::string& key, const ImuCalibrationSigmas& sigmas);
std::string calibration_sigma_lines(int depth, const std::string& key, const WheelCalibrationSigmas& sigmas);

}  // namespace lodestone
