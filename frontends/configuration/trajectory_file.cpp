#include "frontends/configuration/trajectory_file.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "core/error.h"
#include "frontends/configuration/file_kind.h"
#include "frontends/configuration/kitti_trajectory.h"
#include "frontends/configuration/number_text.h"
#include "frontends/configuration/table_lines.h"
#include "frontends/configuration/text_file.h"

namespace lodestone {
namespace {

constexpr Time nanoseconds_per_second = 1'000'000'000;

/// Exponents of stamps within `farthest_time` are far smaller; the limit avoids overflow of sums.
constexpr int largest_exponent = 1000;

bool is_digit(char character) {
  return character >= '0' && character <= '9';
}

/// `parts`: a line's values, of which the pose is the second to the eighth.
Pose parse_pose(const TableLine& line, const std::vector<std::string_view>& parts, bool scalar_first) {
  std::array<double, 7> values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!parse_finite(parts[i + 1], values[i])) line.fail("'" + std::string(parts[i + 1]) + "' is no finite number");
  }
  Pose pose;
  pose.position = Vector3(values[0], values[1], values[2]);
  const double* q = values.data() + 3;
  pose.rotation = scalar_first ? Quaternion(q[0], q[1], q[2], q[3]) : Quaternion(q[3], q[0], q[1], q[2]);
  const double length = pose.rotation.norm();
  if (std::abs(length - 1.0) > 0.01) {
    line.fail("the quaternion's length is " + fmt::format("{:.4g}", length) + "; expected 1");
  }
  pose.rotation.normalize();
  return pose;
}

/// Calls `parse` for each line that is no comment, and collects the results.
template <class Parse>
Trajectory read_lines(const std::string& path, const std::string& text, const Parse& parse) {
  Trajectory trajectory;
  for_each_line(path, text, [&](const TableLine& line) {
    const StampedPose pose = parse(line);
    if (!trajectory.empty() && pose.time < trajectory.back().time) {
      line.fail("the stamp " + format_stamp(pose.time) + " goes back from " + format_stamp(trajectory.back().time) +
                "; sort the file by time");
    }
    trajectory.push_back(pose);
    return true;
  });
  if (trajectory.empty()) throw InputError(path + ": holds no poses; expected lines of t x y z qx qy qz qw");
  return trajectory;
}

/// Differences of larger stamps overflow Time.
constexpr const char* kStampsWithin = " within 127 years (4e9 s) of zero";

Trajectory parse_tum(const std::string& path, const std::string& text) {
  return read_lines(path, text, [](const TableLine& line) {
    const auto parts = split_line(line.text, " \t\r");
    if (parts.size() != 8) {
      line.fail("expected 8 values (t x y z qx qy qz qw), found " + std::to_string(parts.size()));
    }
    StampedPose pose;
    if (!parse_stamp(parts[0], pose.time))
      line.fail("'" + std::string(parts[0]) + "' is no stamp in seconds" + kStampsWithin);
    pose.pose = parse_pose(line, parts, false);
    return pose;
  });
}

Trajectory parse_euroc(const std::string& path, const std::string& text) {
  return read_lines(path, text, [](const TableLine& line) {
    const auto parts = split_line(line.text, ", \t\r");
    if (parts.size() < 8) {
      line.fail("expected at least 8 values (t[ns],x,y,z,qw,qx,qy,qz), found " + std::to_string(parts.size()));
    }
    StampedPose pose;
    if (!parse_number(parts[0], pose.time) || pose.time > farthest_time || pose.time < -farthest_time) {
      line.fail("'" + std::string(parts[0]) + "' is no stamp in whole nanoseconds" + kStampsWithin);
    }
    pose.pose = parse_pose(line, parts, true);
    return pose;
  });
}

}  // namespace

bool parse_stamp(std::string_view text, Time& time) {
  const bool negative = !text.empty() && text.front() == '-';
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) text.remove_prefix(1);
  int exponent = 0;
  if (const std::size_t e = text.find_first_of("eE"); e != std::string_view::npos) {
    if (!parse_number(text.substr(e + 1), exponent)) return false;
    if (exponent > largest_exponent || exponent < -largest_exponent) return false;
    text = text.substr(0, e);
  }
  // The decimal place of each digit follows from the point, so that nanoseconds are summed exactly.
  const std::size_t point = std::min(text.find('.'), text.size());
  Time sum = 0;
  int half = 0;  // the first digit below 1 ns rounds
  bool any = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (i == point) continue;
    if (!is_digit(text[i])) return false;
    any = true;
    const int power = (i < point ? static_cast<int>(point - i) - 1 : -static_cast<int>(i - point)) + exponent + 9;
    const int digit = text[i] - '0';
    if (power < 0) {
      if (power == -1) half = digit;
      continue;
    }
    if (digit == 0) continue;
    Time place = 1;
    for (int k = 0; k < power; ++k) {
      if (__builtin_mul_overflow(place, Time{10}, &place)) return false;
    }
    Time part = 0;
    if (__builtin_mul_overflow(place, Time{digit}, &part) || __builtin_add_overflow(sum, part, &sum)) return false;
  }
  if (half >= 5 && sum < farthest_time) ++sum;
  if (sum > farthest_time) return false;
  time = negative ? -sum : sum;
  return any;
}

std::string format_stamp(Time time) {
  const auto magnitude = time < 0 ? 0 - static_cast<std::uint64_t>(time) : static_cast<std::uint64_t>(time);
  return fmt::format("{}{}.{:09}", time < 0 ? "-" : "", magnitude / nanoseconds_per_second,
                     magnitude % nanoseconds_per_second);
}

std::string span_text(Time from, Time to) {
  return fmt::format("{} s to {} s", format_stamp(from), format_stamp(to));
}

Trajectory read_tum(const std::string& path) {
  return parse_tum(path, read_text_file(path));
}

Trajectory read_trajectory(const std::string& path, const Vector3& origin_m) {
  require_kind(path, SeemingKind::trajectory, "a trajectory (TUM or EuRoC csv)");
  const std::string text = read_text_file(path);
  if (is_kitti_text(text)) {
    throw InputError(path +
                     ": is in KITTI's format (12 numbers in each line), which has no times; `lodestone evaluate` reads "
                     "it with --times FILE; other commands require TUM or EuRoC csv");
  }
  // Comments may contain commas in either format, so the first line of values decides.
  bool has_commas = false;
  for_each_line(path, text, [&has_commas](const TableLine& line) {
    has_commas = line.text.find(',') != std::string_view::npos;
    return false;
  });
  Trajectory trajectory = has_commas ? parse_euroc(path, text) : parse_tum(path, text);
  for (StampedPose& pose : trajectory) pose.pose.position -= origin_m;
  return trajectory;
}

Trajectory read_site_trajectory(const std::string& path, const Vector3& origin_m) {
  Trajectory trajectory = read_trajectory(path, origin_m);
  const Vector3& at = trajectory.front().pose.position;
  if (at.cwiseAbs().maxCoeff() < kSiteReach_m) return trajectory;
  throw InputError(
      fmt::format("{}: the first pose is ({:.0f}, {:.0f}, {:.0f}) m from the origin; expected less than {:.0f} km; {}",
                  path, at.x(), at.y(), at.z(), kSiteReach_m / 1000.0,
                  origin_m.isZero(0.0) ? "give an origin at the site with --origin x,y,z"
                                       : "correct --origin, or omit it if the file's origin is at the site"));
}

std::string pose_text(const Pose& pose, const Vector3& origin_m) {
  const Vector3 p = pose.position + origin_m;
  const Quaternion& q = pose.rotation;
  return fmt::format("{:.3f} {:.3f} {:.3f} {:.5f} {:.5f} {:.5f} {:.5f}", p.x(), p.y(), p.z(), q.x(), q.y(), q.z(),
                     q.w());
}

namespace {

/// Nine significant digits, but micrometres at coordinates of a country.
std::string coordinate_text(double value_m) {
  return std::abs(value_m) < 1000.0 ? fmt::format("{:.9g}", value_m) : fmt::format("{:.6f}", value_m);
}

}  // namespace

std::string format_tum(const StampedPose& pose) {
  const Vector3& p = pose.pose.position;
  const Quaternion& q = pose.pose.rotation;
  return fmt::format("{} {} {} {} {:.9g} {:.9g} {:.9g} {:.9g}", format_stamp(pose.time), coordinate_text(p.x()),
                     coordinate_text(p.y()), coordinate_text(p.z()), q.x(), q.y(), q.z(), q.w());
}

std::string euroc_text(const Trajectory& trajectory) {
  fmt::memory_buffer text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "#timestamp [ns],p_x [m],p_y [m],p_z [m],q_w [],q_x [],q_y [],q_z []\n");
  for (const StampedPose& pose : trajectory) {
    const Vector3& p = pose.pose.position;
    const Quaternion& q = pose.pose.rotation;
    fmt::format_to(out, "{},{},{},{},{:.9g},{:.9g},{:.9g},{:.9g}\n", pose.time, coordinate_text(p.x()),
                   coordinate_text(p.y()), coordinate_text(p.z()), q.w(), q.x(), q.y(), q.z());
  }
  return fmt::to_string(text);
}

void write_tum(const std::string& path, const Trajectory& trajectory, const std::string& comment) {
  fmt::memory_buffer text;
  for (const std::string_view line : split_line(comment, "\n")) {
    fmt::format_to(std::back_inserter(text), "# {}\n", line);
  }
  for (const StampedPose& pose : trajectory) fmt::format_to(std::back_inserter(text), "{}\n", format_tum(pose));
  write_text_file(path, fmt::to_string(text));
}

}  // namespace lodestone
