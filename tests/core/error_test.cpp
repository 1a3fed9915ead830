#include "core/error.h"

#include <gtest/gtest.h>

#include <string>

namespace lodestone {
namespace {

std::string shown(const std::string& message) {
  return InputError(message).what();
}

TEST(InputError, ReplacesControlCharacters) {
  EXPECT_EQ(shown("a\nb\rc\x1b[2Jd\x7f"), "a?b?c?[2Jd?");
  EXPECT_EQ(shown("\xc2\x9b"
                  "2J"),
            "?2J");  // U+009B begins a control sequence, as ESC [ does
  EXPECT_EQ(shown("a\xc2\x80\xc2\x9f"), "a??");
}

TEST(InputError, KeepsOtherCharacters) {
  for (const std::string text : {"0.1 °, 25 µT, 10 Å, 東京 👍", "\xc2\xa0", "\xc3\x9b", "cut off: \xc2"}) {
    EXPECT_EQ(shown(text), text);
  }
}

}  // namespace
}  // namespace lodestone
