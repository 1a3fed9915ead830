#pragma once

#include <stdexcept>
#include <string>

namespace lodestone {

/// The input or the call is wrong. The message is one line that names the file, the topic or key, the time, what was
/// expected, what came, and what to change. The program prints it and ends with exit code 2.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(message) {}
};

/// The user asked to stop (SIGINT, SIGTERM). What was computed so far has been kept. Exit code 130.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace lodestone
