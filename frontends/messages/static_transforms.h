#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/geometry/pose.h"
#include "frontends/messages/message_source.h"

namespace lodestone {

/// Constant transforms between frames, as a tree: each frame has at most one parent. Names without a leading slash.
class StaticTransforms {
 public:
  /// Replaces an earlier transform of the same child.
  void add(const std::string& parent, const std::string& child, const Pose& T_parent_child);

  bool empty() const { return parents_.empty(); }

  /// T_a_b along the tree; the identity if both are one frame. Nothing if a name is empty or no chain connects them.
  std::optional<Pose> between(const std::string& a, const std::string& b) const;

 private:
  using Placed = std::pair<std::string, Pose>;  ///< a frame X and T_X_frame
  std::vector<Placed> ancestors(const std::string& frame) const;

  std::map<std::string, Placed> parents_;  ///< by child
};

/// Adds the transforms of one tf2_msgs/TFMessage (or ROS 1's tf/tfMessage). Transforms without a rotation (a quaternion
/// of length 0) or with non-finite numbers are ignored. `path` names the log in messages. Throws InputError, with topic
/// and time, if the message's bytes are inconsistent.
void add_transforms(const std::string& path, const TopicInfo& topic, const RawMessage& raw,
                    StaticTransforms& transforms);

/// Adds the transforms of all topics named tf_static, in any namespace. Selects these topics in `log`. Throws
/// InputError as add_transforms does.
void read_static_transforms(const std::string& path, MessageSource& log, StaticTransforms& transforms);

}  // namespace lodestone
