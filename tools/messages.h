#pragma once

#include <string>

namespace lodestone {

/// Targets of messages (spdlog): plain text to stderr; with time and level to a file. Tables are printed to stdout
/// instead.
struct MessageOptions {
  bool verbose = false;  ///< stderr: with details
  bool quiet = false;    ///< stderr: errors only
  std::string log_file;  ///< empty: none
};

/// Redirects all further messages. Throws InputError if the file cannot be written.
void open_messages(const MessageOptions& options);

}  // namespace lodestone
