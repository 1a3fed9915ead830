#pragma once

#include <stdexcept>
#include <string>

namespace lodestone {

/// Wrong input or a wrong call. The message is one line: file, topic or key, time, expectation, content and remedy. The
/// program prints the line and ends with exit code 2. Quoted input may contain anything: control characters (U+0000 to
/// U+001F, U+007F to U+009F), which could break the line or control a terminal, are replaced by question marks.
class InputError : public std::runtime_error {
 public:
  explicit InputError(const std::string& message) : std::runtime_error(one_line(message)) {}

 private:
  static std::string one_line(std::string message) {
    std::size_t size = 0;
    for (std::size_t i = 0; i < message.size(); ++i) {
      char character = message[i];
      if ((character >= 0 && character < ' ') || character == '\x7f') character = '?';
      // U+0080 to U+009F are C2 80 to C2 9F in UTF-8.
      if (character == '\xc2' && i + 1 < message.size() && static_cast<unsigned char>(message[i + 1]) - 0x80U < 0x20U) {
        character = '?';
        ++i;
      }
      message[size++] = character;
    }
    message.resize(size);
    return message;
  }
};

/// The user asked to stop (SIGINT, SIGTERM). Results computed so far are kept. Exit code 130.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace lodestone
