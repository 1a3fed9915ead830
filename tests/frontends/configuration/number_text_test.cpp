#include "frontends/configuration/number_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>

namespace lodestone {
namespace {

template <class Number>
bool is_number(const std::string& text, Number expected) {
  Number number{};
  return parse_number(text, number) && number == expected;
}

TEST(NumberText, IsReadWhole) {
  EXPECT_TRUE(is_number("12", 12));
  EXPECT_TRUE(is_number("+7", 7));
  EXPECT_TRUE(is_number("-3.5e2", -350.0));
  EXPECT_TRUE(is_number(".5", 0.5));
  EXPECT_TRUE(is_number("inf", INFINITY));
  EXPECT_TRUE(is_number("18446744073709551615", std::uint64_t{18446744073709551615U}));
  double number = 0.0;
  EXPECT_TRUE(parse_number("nan", number));
  EXPECT_TRUE(std::isnan(number));
}

TEST(NumberText, IsRefusedAndTheValueKept) {
  for (const char* text : {"", "+", "-", "+-1", "++1", "1 ", " 1", "1,5", "0x10", "12a", "one", "1e999"}) {
    double number = 3.0;
    EXPECT_FALSE(parse_number(text, number)) << text;
    EXPECT_EQ(number, 3.0) << text;
  }
  std::uint8_t small = 3;
  for (const char* text : {"256", "-1", "1.5"}) EXPECT_FALSE(parse_number(text, small)) << text;
  EXPECT_EQ(small, 3);
}

}  // namespace
}  // namespace lodestone
