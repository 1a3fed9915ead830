#pragma once

#include <memory>
#include <string>
#include <vector>

#include "frontends/logs/message_source.h"

namespace lodestone {

/// One file of a folder of logs.
struct RecordingPart {
  std::string file;  ///< its path
  std::unique_ptr<MessageSource> source;
};

/// What says that a folder's files belong together.
enum class PartsListed {
  by_metadata,  ///< the recorder's own list
  by_nobody     ///< they only lie in one folder
};

/// Throws InputError, naming two files, where the parts are not of one recording: a topic differs in type or encoding
/// between them, or, where nobody lists them, both hold messages of it from one time. A recorder's next file begins
/// where the one before ends, up to what it still held in its queue: half the shorter stretch, and at most a second,
/// may be in both.
void check_one_recording(const std::string& folder, const std::vector<RecordingPart>& parts, PartsListed listed);

}  // namespace lodestone
