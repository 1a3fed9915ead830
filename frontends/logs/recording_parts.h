#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frontends/messages/message_source.h"

namespace lodestone {

/// One file of a folder of logs.
struct RecordingPart {
  std::string file;  ///< its path
  std::unique_ptr<MessageSource> source;
};

/// Evidence that a folder's files belong together.
enum class PartsListed {
  by_metadata,  ///< a list of the recorder
  unlisted      ///< no list, only a common folder
};

/// Throws InputError with two files if the parts are not of one recording: a topic has different types or encodings,
/// or, without a list, both parts have messages of it at the same time. A recorder's next file begins when the previous
/// one ends, except for queued messages: an overlap of half the shorter part, at most a second, is allowed.
void check_one_recording(const std::string& folder, const std::vector<RecordingPart>& parts, PartsListed listed);

}  // namespace lodestone
