#pragma once

#include <stdexcept>
#include <string>

namespace lodestone {

/// Wrong input or a wrong call. The message is one line: file, topic or key, time, expectation, content and remedy. The
/// program prints the line and ends with exit code 2. Quoted input may contain anything: control characters, which
/// could break the line or control a terminal, are replaced by question marks.
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

/// The user asked to stop (SIGINT, SIGTERM). Results computed so far are kept. Exit code 130.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace lodestone
