#include "frontends/configuration/kitti_trajectory.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <iterator>

#include "frontends/configuration/table_lines.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"

namespace lodestone {
namespace {

constexpr const char* kitti_separators = " \t\r";
constexpr std::size_t kitti_numbers = 12;

/// Real files have at least six digits.
constexpr double largest_rotation_error = 0.01;

bool parse_kitti_numbers(std::string_view text, std::array<double, kitti_numbers>& values) {
  const auto parts = split_line(text, kitti_separators);
  if (parts.size() != kitti_numbers) return false;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!parse_finite(parts[i], values[i])) return false;
  }
  return true;
}

Pose parse_kitti_pose(const TableLine& line) {
  std::array<double, kitti_numbers> values{};
  if (!parse_kitti_numbers(line.text, values)) {
    line.fail(fmt::format("expected {} finite numbers, the rows of a 3x4 matrix; found {} values", kitti_numbers,
                          split_line(line.text, kitti_separators).size()));
  }
  Matrix3 rotation;
  Pose pose;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      rotation(row, column) = values[static_cast<std::size_t>(4 * row + column)];
    pose.position(row) = values[static_cast<std::size_t>(4 * row + 3)];
  }
  const double error = (rotation.transpose() * rotation - Matrix3::Identity()).cwiseAbs().maxCoeff();
  if (error > largest_rotation_error || rotation.determinant() < 0.0) {
    line.fail("the first three columns are no rotation matrix");
  }
  pose.rotation = Quaternion(rotation).normalized();
  return pose;
}

std::vector<Time> read_kitti_times(const std::string& path) {
  std::vector<Time> times;
  for_each_line(path, read_text_file(path), [&times](const TableLine& line) {
    const auto parts = split_line(line.text, kitti_separators);
    Time time = 0;
    if (parts.size() != 1 || !parse_stamp(parts.front(), time)) line.fail("expected one stamp in seconds");
    if (!times.empty() && time < times.back()) {
      line.fail("the stamp " + format_stamp(time) + " goes back from " + format_stamp(times.back()) +
                "; sort the file by time");
    }
    times.push_back(time);
    return true;
  });
  return times;
}

}  // namespace

bool is_kitti_text(const std::string& text) {
  bool kitti = false;
  for_each_line("", text, [&kitti](const TableLine& line) {
    std::array<double, kitti_numbers> values{};
    kitti = parse_kitti_numbers(line.text, values);
    return false;  // the first line with values decides
  });
  return kitti;
}

bool is_kitti_file(const std::string& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored) && is_kitti_text(read_text_file(path));
}

Trajectory read_kitti(const std::string& path, const std::string& times) {
  const std::vector<Time> stamps = read_kitti_times(times);
  Trajectory trajectory;
  for_each_line(path, read_text_file(path), [&](const TableLine& line) {
    const Time time = trajectory.size() < stamps.size() ? stamps[trajectory.size()] : 0;
    trajectory.push_back({time, parse_kitti_pose(line)});
    return true;
  });
  if (trajectory.empty()) throw InputError(path + ": has no poses; expected lines of 12 numbers");
  if (trajectory.size() != stamps.size()) {
    throw InputError(fmt::format("{}: has {} stamps, but {} has {} poses; give the times of the same sequence", times,
                                 stamps.size(), path, trajectory.size()));
  }
  return trajectory;
}

std::string kitti_text(const Trajectory& trajectory) {
  fmt::memory_buffer text;
  for (const StampedPose& pose : trajectory) {
    const Matrix3 rotation = pose.pose.rotation.toRotationMatrix();
    for (int row = 0; row < 3; ++row) {
      fmt::format_to(std::back_inserter(text), "{}{:.9g} {:.9g} {:.9g} {:.9f}", row == 0 ? "" : " ", rotation(row, 0),
                     rotation(row, 1), rotation(row, 2), pose.pose.position(row));
    }
    text.push_back('\n');
  }
  return fmt::to_string(text);
}

std::string kitti_times_text(const Trajectory& trajectory) {
  std::string text;
  for (const StampedPose& pose : trajectory) text += format_stamp(pose.time) + "\n";
  return text;
}

}  // namespace lodestone
