#include "frontends/configuration/missing_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "frontends/configuration/configuration_node.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;

TEST(MissingFile, NamesTheNearestFileOfTheFolder) {
  const testing::TemporaryFolder folder;
  testing::write_text(folder / "field.yaml", "");
  testing::write_text(folder / "platform.yaml", "");
  EXPECT_THAT(missing_file(folder / "feld.yaml").what(), EndsWith("there is no such file; did you mean 'field.yaml'?"));
  EXPECT_THAT(missing_file(folder / "night.bag", "log").what(), EndsWith("there is no such log"));
  EXPECT_THAT(missing_file(folder / "maps/field.yaml").what(), HasSubstr("there is no folder '"));
}

TEST(MissingFile, TabsInYamlAreNamed) {
  EXPECT_THAT(testing::message_of<InputError>([] { ConfigurationNode::parse("a:\n\tb: 1\n", "a.yaml"); }),
              HasSubstr("use spaces"));
}

}  // namespace
}  // namespace lodestone
