#include "frontends/messages/message_paths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/configuration/number_text.h"
#include "frontends/messages/known_types.h"
#include "frontends/messages/message_definition.h"
#include "frontends/messages/message_reading.h"
#include "frontends/messages/with_reader.h"

namespace lodestone {
namespace {

using Field = MessagePaths::Field;
using Step = MessagePaths::Step;
using Target = MessagePaths::Target;
using Types = std::map<std::string, std::vector<Field>>;

/// Nesting limit: only recursive types are deeper.
constexpr int deepest = 32;

/// The steps of a path such as "sensors[2].field"; nothing if it is invalid.
std::vector<Step> steps_of(const std::string& path) {
  std::vector<Step> steps;
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    Step step{path.substr(begin, end - begin), 0};
    if (const std::size_t open = step.name.find('['); open != std::string::npos) {
      if (!step.name.ends_with(']')) return {};
      const std::string_view index = std::string_view(step.name).substr(open + 1, step.name.size() - open - 2);
      if (!parse_number(index, step.index)) return {};
      step.name.erase(open);
    }
    if (step.name.empty()) return {};
    steps.push_back(std::move(step));
    begin = end + 1;
  }
  return steps;
}

/// Reads a message in the order of its bytes and extracts the targets.
template <class Wire>
struct Walk {
  Wire& wire;
  const Types& types;
  std::vector<MessagePaths::Vector>& vectors;
  std::size_t elements_left;  ///< limits time: lists of empty types need no bytes
  std::size_t found = 0;

  double number(const std::string& type) {
    if (type == "float64") return wire.template number<double>();
    if (type == "float32") return static_cast<double>(wire.template number<float>());
    if (type == "int8") return static_cast<double>(wire.template number<std::int8_t>());
    if (type == "int16") return static_cast<double>(wire.template number<std::int16_t>());
    if (type == "int32") return static_cast<double>(wire.template number<std::int32_t>());
    if (type == "int64") return static_cast<double>(wire.template number<std::int64_t>());
    if (type == "uint16") return static_cast<double>(wire.template number<std::uint16_t>());
    if (type == "uint32") return static_cast<double>(wire.template number<std::uint32_t>());
    if (type == "uint64") return static_cast<double>(wire.template number<std::uint64_t>());
    return static_cast<double>(wire.template number<std::uint8_t>());
  }

  void element(const std::string& type, const std::vector<const Target*>& wanted, std::size_t depth) {
    if (elements_left-- == 0) throw ros1::MalformedMessage("the message has more elements than bytes");
    std::string ignored;
    if (size_of_number(type) > 0) {
      const double value = number(type);
      for (const Target* target : wanted) vectors[target->vector].values[target->component] = value;
      found += wanted.size();
    } else if (type == "string") {
      wire.text(ignored);
    } else if (type == "time" || type == "duration") {
      wire.template number<std::uint32_t>();
      wire.template number<std::uint32_t>();
    } else if (type == "std_msgs/Header") {
      wire.header(ignored);
    } else {
      message(type, wanted, depth);
    }
  }

  void message(const std::string& type, const std::vector<const Target*>& wanted, std::size_t depth) {
    if (depth > deepest) throw ros1::MalformedMessage("the type " + type + " contains itself");
    const std::vector<Field>& fields = types.at(type);
    for (const Field& field : fields) {
      if (&field == &fields.front() && field.type == "std_msgs/Header" && field.count == Field::single) {
        std::string frame;
        const Time stamp = wire.header(frame);
        for (const Target* target : wanted) vectors[target->vector].stamp = stamp;
        continue;
      }
      std::vector<const Target*> here, these;
      for (const Target* target : wanted) {
        if (target->steps.size() > depth && target->steps[depth].name == field.name) here.push_back(target);
      }
      std::uint32_t count = field.count == Field::single ? 1U : static_cast<std::uint32_t>(field.count);
      if (field.count == Field::counted) count = reading::list_size(wire, 1);
      for (std::uint32_t i = 0; i < count; ++i) {
        these.clear();
        for (const Target* target : here) {
          if (target->steps[depth].index == i) these.push_back(target);
        }
        element(field.type, these, depth + 1);
      }
    }
  }
};

}  // namespace

MessagePaths::MessagePaths(std::string source, const TopicInfo& topic) : source_(std::move(source)), topic_(topic) {
  parse(topic);
}

void MessagePaths::parse(const TopicInfo& topic) {
  const std::string where = fmt::format("{}: topic {} is a {}", source_, topic.name, topic.type);
  if (topic.encoding == Encoding::other) throw InputError(where + " in an encoding of neither ROS 1 nor ROS 2");
  std::string text = topic.definition.empty() ? ros2_definition(message_type(topic.type)) : topic.definition;
  if (text.empty()) text = further_definition(topic.type);
  if (text.empty()) {
    throw InputError(
        where +
        ", and the log has no definition of it; record the log as MCAP or as a ROS 1 bag, which contain definitions");
  }
  try {
    types_ = parse_definition(topic.type, text);
  } catch (const std::invalid_argument& error) {
    throw InputError(fmt::format("{}, whose definition in the log cannot be used: {}", where, error.what()));
  }
}

/// The field at the end of `steps`; null if there is none. `in_list`: the last step is a list element.
const Field* MessagePaths::field_at(const std::vector<Step>& steps, bool& in_list) const {
  std::string type = topic_.type;
  const Field* found = nullptr;
  for (const Step& step : steps) {
    const auto fields = types_.find(type);
    if (fields == types_.end()) return nullptr;
    const auto field = std::find_if(fields->second.begin(), fields->second.end(),
                                    [&step](const Field& each) { return each.name == step.name; });
    if (field == fields->second.end()) return nullptr;
    const int count = field->count == Field::single ? 1 : field->count;
    if (count >= 0 && step.index >= static_cast<std::uint32_t>(count)) return nullptr;
    found = &*field;
    in_list = field->count != Field::single;
    type = field->type;
  }
  return found;
}

std::string MessagePaths::no_such_path(const std::string& path, const std::string& key,
                                       const std::string& expected) const {
  std::vector<std::string> names;
  for (const Field& each : types_.at(topic_.type))
    names.push_back(each.name + (each.count == Field::single ? "" : "[]"));
  return fmt::format("{}: {}: '{}' is not a {} of a {}, which has {}", source_, key, path, expected, topic_.type,
                     join_names(names));
}

std::size_t MessagePaths::add_number(const std::string& path, const std::string& key) {
  const std::vector<Step> steps = steps_of(path);
  bool in_list = false;
  const Field* field = steps.empty() ? nullptr : field_at(steps, in_list);
  const bool indexed = path.ends_with(']');
  if (field == nullptr || size_of_number(field->type) == 0 || in_list != indexed) {
    throw InputError(no_such_path(path, key, "number") + "; expected a path like position[0] or left.ticks");
  }
  targets_.push_back({steps, vectors_, 0});
  return vectors_++;
}

double MessagePaths::period(std::size_t vector) const {
  const auto target =
      std::find_if(targets_.begin(), targets_.end(), [&](const Target& each) { return each.vector == vector; });
  bool in_list = false;
  const std::string& type = field_at(target->steps, in_list)->type;
  return type.starts_with("float") ? 0.0 : std::exp2(8 * size_of_number(type));
}

std::size_t MessagePaths::add(const std::string& path, const std::string& key) {
  const std::vector<Step> steps = steps_of(path);
  bool in_list = false;
  const Field* field = steps.empty() ? nullptr : field_at(steps, in_list);
  const std::string where = no_such_path(path, key, "vector");
  if (field == nullptr) throw InputError(where + "; expected a path like data[0] or field.vector");
  std::vector<Target> targets;
  for (std::size_t component = 0; component < 3; ++component) {
    Target target{steps, vectors_, component};
    if (size_of_number(field->type) > 0 && in_list) {
      target.steps.back().index += static_cast<std::uint32_t>(component);
    } else {
      target.steps.push_back({std::string(1, "xyz"[component]), 0});
      bool component_in_list = false;
      const Field* number = field_at(target.steps, component_in_list);
      if (number == nullptr || size_of_number(number->type) == 0 || component_in_list) {
        throw InputError(where + "; expected components x, y and z, or the first of three numbers in a list");
      }
    }
    targets.push_back(std::move(target));
  }
  targets_.insert(targets_.end(), targets.begin(), targets.end());
  return vectors_++;
}

void MessagePaths::read(const RawMessage& raw, std::vector<Vector>& vectors) const {
  vectors.assign(vectors_, Vector{{}, raw.record_time});
  std::vector<const Target*> wanted;
  for (const Target& target : targets_) wanted.push_back(&target);
  const auto walk = [&](auto& wire) {
    Walk<std::remove_reference_t<decltype(wire)>> walker{wire, types_, vectors, 1024 + 2 * raw.size};
    walker.message(topic_.type, wanted, 0);
    if (walker.found != wanted.size()) {
      throw ros1::MalformedMessage("a list in the message is shorter than the platform file's paths require");
    }
  };
  with_reader(source_, topic_, raw, walk, "");
}

}  // namespace lodestone
