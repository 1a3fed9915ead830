#include "estimators/options.h"

#include <gtest/gtest.h>

#include "frontends/configuration/options.h"

namespace lodestone {
namespace {

RunOptions with(const std::string& assignment) {
  RunOptions options;
  load_options(load_configuration({}, {assignment}), options);
  return options;
}

TEST(RunOptions, DefaultsPassTheirOwnChecks) {
  EXPECT_NO_THROW(with("smoother.window_s=2.5"));
}

TEST(RunOptions, ValuesThatMakeNoSenseAreRefusedByKeyAndBound) {
  for (const std::string assignment :
       {"lidar.map.voxel_m=0", "lidar.map.margin_m=0.2", "lidar.map.fit.min_points=1", "lidar.sampling.voxel_m=-1",
        "lidar.association.gate_sigmas=0", "degeneracy.max_sigma_m=-0.1", "degeneracy.min_probability=1.5",
        "magnetic.beta=1.5", "magnetic.huber_probability=1", "magnetic.samples_per_reading=0", "smoother.window_s=-1",
        "ieskf.lidar_iterations=0", "initial.position_sigma_m=0", "magnetic_calibrating.window_s=-1",
        "magnetic_calibrating.alternations=0"}) {
    try {
      with(assignment);
      ADD_FAILURE() << assignment;
    } catch (const InputError& error) {
      const std::string key = assignment.substr(assignment.rfind('.', assignment.find('=')) + 1,
                                                assignment.find('=') - assignment.rfind('.', assignment.find('=')) - 1);
      EXPECT_NE(std::string(error.what()).find(key + ": expected"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace lodestone
