#include "tools/simulate/obstacles.h"

namespace lodestone::simulation {

namespace {

constexpr double kStep_s = 0.1;
constexpr double kSame_s = 5.0;   // a robot leaves what it has entered
constexpr float kAhead_m = 0.03;  // RayCaster::sees ignores the last 2 cm

}  // namespace

std::vector<Obstacle> obstacles_on_path(const Motion& motion, const RayCaster& caster) {
  std::vector<Obstacle> found;
  Vector3 from = motion.pose_at(0.0).position;
  double last_s = -kSame_s;
  for (double seconds = kStep_s; seconds <= motion.duration(); seconds += kStep_s) {
    const Vector3 to = motion.pose_at(seconds).position;
    const Eigen::Vector3f way = (to - from).cast<float>();
    const Eigen::Vector3f begin = from.cast<float>();
    from = to;
    if (!(way.norm() > 0.0F) || caster.sees(begin, begin + way * (1.0F + kAhead_m / way.norm()))) continue;
    if (seconds - last_s >= kSame_s) found.push_back({seconds, to});
    last_s = seconds;
  }
  return found;
}

}  // namespace lodestone::simulation
