#pragma once

#include <string>

#include "core/warnings.h"

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

/// Prints each kind of warning to stdout, with its number and the first one.
void print_warnings(const WarningLog& warnings);

}  // namespace lodestone
