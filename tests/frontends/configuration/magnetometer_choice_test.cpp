#include "frontends/configuration/magnetometer_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "core/error.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::message_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSubsetOf;

class MagnetometerChoice : public ::testing::Test {
 protected:
  std::vector<std::string> chosen(const std::string& choice) const {
    Platform platform = platform_;
    choose_magnetometers(choice, platform);
    std::vector<std::string> names;
    for (std::size_t i = 0; i < platform.suite.magnetometers.size(); ++i) {
      names.push_back(platform.suite.magnetometers[i].name);
      // Model and message layout are permuted together.
      for (std::size_t k = 0; k < platform_.suite.magnetometers.size(); ++k) {
        if (platform_.suite.magnetometers[k].name != names.back()) continue;
        EXPECT_EQ(platform.magnetometers[i].topic, platform_.magnetometers[k].topic);
      }
    }
    EXPECT_EQ(platform.magnetometers.size(), names.size());
    return names;
  }
  std::string error(const std::string& choice) const {
    return message_of<InputError>([&] { chosen(choice); });
  }
  Platform platform_ = load_platform(std::string(LODESTONE_SOURCE_DIR) + "/config/platforms/scout_os32.yaml");
};

TEST_F(MagnetometerChoice, NamesAndAll) {
  std::vector<std::string> all;
  for (const MagnetometerModel& one : platform_.suite.magnetometers) all.push_back(one.name);
  EXPECT_EQ(chosen("all"), all);
  EXPECT_EQ(chosen("8"), all);
  EXPECT_THAT(chosen(all[6] + ", " + all[1]), ElementsAre(all[1], all[6]));
}

/// Two rows of four, 0.6 m apart and 0.5 m long: the corners come first, and each selection contains the smaller ones.
TEST_F(MagnetometerChoice, ANumberSpreadsThemOutAndHoldsTheSmallerNumbers) {
  const auto& all = platform_.suite.magnetometers;
  EXPECT_THAT(chosen("4"), ElementsAre(all[0].name, all[3].name, all[4].name, all[7].name));
  EXPECT_THAT(chosen("2"), ElementsAre(all[0].name, all[7].name));
  std::vector<std::string> fewer;
  for (int count = 1; count <= 8; ++count) {
    const std::vector<std::string> more = chosen(std::to_string(count));
    EXPECT_EQ(more.size(), static_cast<std::size_t>(count));
    EXPECT_THAT(fewer, IsSubsetOf(more));
    fewer = more;
  }
}

TEST_F(MagnetometerChoice, RefusesWhatThePlatformDoesNotHave) {
  EXPECT_THAT(error("0"), HasSubstr("magnetic.magnetometers: expected 1 to 8"));
  EXPECT_THAT(error("9"), HasSubstr("found 9"));
  EXPECT_THAT(error(""), HasSubstr("expected all, a number, or names"));
  const std::string name = platform_.suite.magnetometers[2].name;
  EXPECT_THAT(error(name + "x"), HasSubstr("did you mean '" + name + "'?"));
  EXPECT_THAT(error(name + "," + name), HasSubstr("twice"));
  EXPECT_THAT(error("-3"), HasSubstr("no magnetometer '-3'"));
}

}  // namespace
}  // namespace lodestone
