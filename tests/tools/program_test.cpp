// The command line as a whole: what is misspelt is named, with the right word where one is near.
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

TEST(Program, AnUnknownOptionIsNamedBeforeWhatIsMissing) {
  expect_refused("run a.bag --estimatr smoother", "unknown option '--estimatr'; did you mean '--estimator'? (see lodestone run --help)");
  expect_refused("run a.bag --out=x --clod=y", "unknown option '--clod'; did you mean '--cloud'? (see lodestone run --help)");
  expect_refused("map magnetic --trajectry a.tum", "did you mean '--trajectory'? (see lodestone map magnetic --help)");
  expect_refused("run a.bag --wholly-made-up", "unknown option '--wholly-made-up' (see lodestone run --help)");
}

TEST(Program, AMissingOptionSendsToTheHelpOfItsOwnCommand) {
  expect_refused("run a.bag", "(see lodestone run --help)");
  expect_refused("map magnetic a.bag", "(see lodestone map magnetic --help)");
  expect_refused("map", "(see lodestone map --help)");
}

TEST(Program, AnUnknownCommandIsNamedAtEveryDepth) {
  expect_refused("rnu a.bag", "there is no command 'rnu'; did you mean 'run'? (known: simulate, ");
  expect_refused("map truht a.yaml", "there is no command 'truht' of lodestone map; did you mean 'truth'? (known: ");
  expect_refused("calibrate camera", "there is no command 'camera' of lodestone calibrate (known: magnetometers)");
}

}  // namespace
}  // namespace lodestone
