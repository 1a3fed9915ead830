#pragma once

#include <fmt/format.h>

#include <string>

#include "core/error.h"
#include "frontends/messages/message_source.h"
#include "frontends/messages/wire_cdr.h"
#include "frontends/messages/wire_ros1.h"

namespace lodestone {

/// Runs `call` with a reader of the message's wire format. Adds the message's topic and time to errors, and `advice`. A
/// heavy header: include it in .cpp files only.
template <class Call>
void with_reader(const std::string& source, const TopicInfo& topic, const RawMessage& raw, const Call& call,
                 const char* advice = "; record the log again, or cut it before this message") {
  try {
    if (topic.encoding == Encoding::cdr) {
      CdrWireReader wire(raw.data, raw.size);
      call(wire);
    } else {
      Ros1WireReader wire(raw.data, raw.size);
      call(wire);
    }
  } catch (const ros1::MalformedMessage& error) {
    throw InputError(fmt::format("{}: topic {}, recorded at {} s: {}{}", source, topic.name,
                                 raw.record_time / 1'000'000'000, error.what(), advice));
  }
}

}  // namespace lodestone
