#pragma once

#include <stdexcept>
#include <string>

namespace lodestone {

/// The input or the call is wrong. The message is one line that names the file, the topic or key, the time, what was
/// expected, what came, and what to change. The program prints it and ends with exit code 2. What it quotes from the
/// input may hold anything: characters that would break the line or steer a terminal are shown as question marks.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(one_line(message)) {}

 private:
  static std::string one_line(std::string message) {
    for (char& character : message) {
      if ((character >= 0 && character < ' ') || character == '\x7f') character = '?';
    }
    return message;
  }
};

/// The user asked to stop (SIGINT, SIGTERM). What was computed so far has been kept. Exit code 130.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace lodestone
