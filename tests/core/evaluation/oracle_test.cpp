// The results of evo 1.36.5 for trajectories recorded by others (matching window 0.01 s).
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "core/angles.h"
#include "core/evaluation/alignment.h"
#include "core/evaluation/errors.h"
#include "core/evaluation/statistics.h"

namespace lodestone {
namespace {

constexpr double kTolerance = 1e-6;

std::filesystem::path data_folder() {
  const char* folder = std::getenv("LODESTONE_DATA");
  const std::filesystem::path source = LODESTONE_SOURCE_DIR;
  return folder != nullptr ? std::filesystem::path(folder) : source.parent_path() / "shared/data";
}

/// TUM (t x y z qx qy qz qw) or, with commas, EuRoC (ns, x, y, z, qw, qx, qy, qz, …).
Trajectory load_trajectory(const std::string& name) {
  std::ifstream file(data_folder() / "trajectories" / name);
  Trajectory trajectory;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line.front() == '#') continue;
    const bool euroc = line.find(',') != std::string::npos;
    for (char& character : line) character = character == ',' ? ' ' : character;
    std::istringstream fields(line);
    StampedPose entry;
    long double seconds = 0.0;  // a double rounds such a stamp to 0.24 µs
    Vector3& p = entry.pose.position;
    Quaternion& q = entry.pose.rotation;
    if (euroc) {
      fields >> entry.time >> p.x() >> p.y() >> p.z() >> q.w() >> q.x() >> q.y() >> q.z();
    } else {
      fields >> seconds >> p.x() >> p.y() >> p.z() >> q.x() >> q.y() >> q.z() >> q.w();
      entry.time = static_cast<Time>(seconds * 1e9L + 0.5L);
    }
    q.normalize();
    trajectory.push_back(entry);
  }
  return trajectory;
}

class Oracle : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(data_folder() / "trajectories/fr2_desk_ORB.txt")) {
      GTEST_SKIP() << "no recorded trajectories in " << data_folder() << "; set LODESTONE_DATA";
    }
  }

  static PosePairs pairs(const std::string& estimate, const std::string& truth) {
    return associate_nearest(load_trajectory(estimate), load_trajectory(truth));
  }

  static PosePairs aligned(const PosePairs& pairs, Alignment alignment) {
    return align(find_alignment(pairs, alignment).value(), pairs);
  }

  static double ate(const PosePairs& pairs) { return summarize(translation_errors(pairs)).rmse; }
};

TEST_F(Oracle, AbsoluteErrorOfFr2Desk) {
  const PosePairs desk = pairs("fr2_desk_ORB.txt", "fr2_desk_groundtruth.txt");
  EXPECT_EQ(desk.size(), 2174U);
  EXPECT_NEAR(ate(desk), 3.173994, kTolerance);
  const PosePairs moved = aligned(desk, Alignment::se3);
  EXPECT_NEAR(ate(moved), 0.008119, kTolerance);
  EXPECT_NEAR(summarize(angle_errors(moved)).rmse * degrees_per_radian, 0.989036, kTolerance);
}

TEST_F(Oracle, ScaleOfAMonocularEstimate) {
  const PosePairs desk = pairs("fr2_desk_ORB_kf_mono.txt", "fr2_desk_groundtruth.txt");
  EXPECT_EQ(desk.size(), 118U);
  EXPECT_NEAR(ate(aligned(desk, Alignment::sim3)), 0.007729, kTolerance);
}

TEST_F(Oracle, RelativeErrorOfFr2Desk) {
  const PosePairs desk = pairs("fr2_desk_ORB.txt", "fr2_desk_groundtruth.txt");
  const auto over_one_frame = relative_errors(desk, segments_by_count(desk.size(), 1, false));
  EXPECT_NEAR(summarize(translations_of(over_one_frame)).rmse, 0.003490, kTolerance);
  EXPECT_NEAR(summarize(angles_of(over_one_frame)).rmse * degrees_per_radian, 0.280519, kTolerance);
  const auto over_one_metre = relative_errors(desk, segments_by_distance(desk, 1.0));
  EXPECT_NEAR(summarize(translations_of(over_one_metre)).rmse, 0.011673, kTolerance);
}

TEST_F(Oracle, AlignmentsOfV102) {
  const PosePairs v102 = pairs("V102.txt", "V102_groundtruth.csv");
  EXPECT_NEAR(ate(aligned(v102, Alignment::se3)), 0.091727, kTolerance);
  EXPECT_NEAR(ate(aligned(v102, Alignment::sim3)), 0.083841, kTolerance);
  EXPECT_NEAR(ate(aligned(v102, Alignment::origin)), 0.153679, kTolerance);
}

}  // namespace
}  // namespace lodestone
