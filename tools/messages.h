#pragma once

#include <string>

namespace lodestone {

/// Where messages (spdlog) go: to stderr as they are, to a file with time and level. Tables go to stdout, not through
/// here.
struct MessageOptions {
  bool verbose = false;  ///< stderr: with details
  bool quiet = false;    ///< stderr: errors only
  std::string log_file;  ///< empty: none
};

/// From now on messages go there. Throws InputError if the file cannot be written.
void open_messages(const MessageOptions& options);

}  // namespace lodestone
