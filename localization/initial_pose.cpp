#include "localization/initial_pose.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "frontends/configuration/number_text.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/csv_text.h"

namespace lodestone {

Pose parse_initial_pose(const std::string& text, const Vector3& origin_m) {
  std::string blanks = text;
  for (char& character : blanks) character = character == ',' ? ' ' : character;
  const std::vector<std::string_view> words = split_cells(blanks, ' ');
  std::array<double, 7> v{};
  bool numbers = words.size() == v.size();
  for (std::size_t i = 0; numbers && i < v.size(); ++i) numbers = parse_number(words[i], v[i]);
  const Quaternion rotation(v[6], v[3], v[4], v[5]);
  const bool finite = std::isfinite(rotation.norm()) && std::isfinite(v[0] + v[1] + v[2]);
  if (!numbers || !finite) {
    throw InputError(fmt::format("--initial-pose: expected \"x y z qx qy qz qw\" in metres, found \"{}\"", text));
  }
  if (std::abs(rotation.norm() - 1.0) > 1e-2) {
    throw InputError(
        fmt::format("--initial-pose: the quaternion \"qx qy qz qw\" has length {:.4f} instead of 1; without "
                    "rotation, use 0 0 0 1",
                    rotation.norm()));
  }
  return {rotation.normalized(), Vector3(v[0], v[1], v[2]) - origin_m};
}

Pose initial_pose_from(const Trajectory& trajectory, const std::string& path, Time time) {
  constexpr Time kEarliest = 1'000'000'000;
  if (const auto pose = interpolate(trajectory, time, from_seconds(1.0))) return *pose;
  const Time wait = trajectory.front().time - time;
  if (wait > 0 && wait < kEarliest) return trajectory.front().pose;
  throw InputError(fmt::format(
      "{}: there is no pose at the log's begin, {} s; the trajectory spans {}; --initial-pose-from requires "
      "a trajectory with the log's clock",
      path, format_stamp(time), span_text(trajectory.front().time, trajectory.back().time)));
}

Vector3 initial_velocity_from(const Trajectory& trajectory, Time time) {
  constexpr Time kHalf = 250'000'000;
  constexpr Time kShortest = 100'000'000;
  if (trajectory.empty()) return Vector3::Zero();
  const Time from = std::max(time - kHalf, trajectory.front().time);
  const Time to = std::min(time + kHalf, trajectory.back().time);
  const auto before = interpolate(trajectory, from, from_seconds(1.0));
  const auto after = interpolate(trajectory, to, from_seconds(1.0));
  if (to - from < kShortest || !before || !after) return Vector3::Zero();
  return (after->position - before->position) / to_seconds(to - from);
}

}  // namespace lodestone
