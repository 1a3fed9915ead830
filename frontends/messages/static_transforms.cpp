#include "frontends/messages/static_transforms.h"

#include <algorithm>
#include <cmath>

#include "frontends/messages/message_reading.h"
#include "frontends/messages/with_reader.h"

namespace lodestone {
namespace {

std::string without_leading_slash(const std::string& frame) {
  return frame.starts_with('/') ? frame.substr(1) : frame;
}

bool has_static_transforms(const TopicInfo& topic) {
  const bool is_type = topic.type == "tf2_msgs/TFMessage" || topic.type == "tf/tfMessage";
  return is_type && topic.messages > 0 && topic.encoding != Encoding::other &&
         (topic.name == "tf_static" || topic.name.ends_with("/tf_static"));
}

/// geometry_msgs/TransformStamped[]
template <class Wire>
void read_transforms(Wire& wire, StaticTransforms& transforms) {
  constexpr std::size_t smallest = 7 * sizeof(double);
  const std::uint32_t count = reading::list_size(wire, smallest);
  for (std::uint32_t i = 0; i < count; ++i) {
    std::string parent, child;
    wire.header(parent);
    wire.text(child);
    Pose pose;
    for (double& value : pose.position) value = wire.template number<double>();
    for (double& value : pose.rotation.coeffs()) value = wire.template number<double>();  // x y z w, as in ROS
    const double length = pose.rotation.norm();
    if (!pose.position.allFinite() || !std::isfinite(length) || length < 0.5) continue;
    pose.rotation.normalize();
    transforms.add(parent, child, pose);
  }
}

}  // namespace

void StaticTransforms::add(const std::string& parent, const std::string& child, const Pose& T_parent_child) {
  parents_[without_leading_slash(child)] = {without_leading_slash(parent), T_parent_child};
}

/// The frame itself and its ancestors. Ends at a frame that was visited, because a broken tree may contain a cycle.
std::vector<StaticTransforms::Placed> StaticTransforms::ancestors(const std::string& frame) const {
  std::vector<Placed> chain{{frame, Pose{}}};
  for (auto parent = parents_.find(frame); parent != parents_.end() && chain.size() <= parents_.size();
       parent = parents_.find(chain.back().first)) {
    chain.emplace_back(parent->second.first, parent->second.second * chain.back().second);
  }
  return chain;
}

std::optional<Pose> StaticTransforms::between(const std::string& a, const std::string& b) const {
  if (a.empty() || b.empty()) return std::nullopt;
  const std::vector<Placed> of_a = ancestors(without_leading_slash(a)), of_b = ancestors(without_leading_slash(b));
  for (const auto& [frame, T_frame_a] : of_a) {
    const auto common =
        std::find_if(of_b.begin(), of_b.end(), [&name = frame](const Placed& each) { return each.first == name; });
    if (common != of_b.end()) return T_frame_a.inverse() * common->second;
  }
  return std::nullopt;
}

void add_transforms(const std::string& path, const TopicInfo& topic, const RawMessage& raw,
                    StaticTransforms& transforms) {
  with_reader(path, topic, raw, [&](auto& wire) { read_transforms(wire, transforms); });
}

void read_static_transforms(const std::string& path, MessageSource& log, StaticTransforms& transforms) {
  std::vector<TopicInfo> topics;
  std::vector<std::string> names;
  for (const TopicInfo& topic : log.topics()) {
    if (!has_static_transforms(topic)) continue;
    topics.push_back(topic);
    names.push_back(topic.name);
  }
  if (names.empty()) return;
  log.select(names);
  for (RawMessage raw; log.next(raw);) add_transforms(path, topics[raw.topic], raw, transforms);
}

}  // namespace lodestone
