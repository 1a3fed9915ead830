#include "tools/experiments/ablation.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <regex>
#include <set>

#include "core/error.h"
#include "tests/tools/experiments/ablation_files.h"
#include "tools/experiments/ablate_call.h"
#include "tools/experiments/plan.h"

namespace lodestone::ablation {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

std::vector<std::string> names(const std::vector<Variant>& variants) {
  std::vector<std::string> all;
  for (const Variant& variant : variants) all.push_back(variant.name);
  return all;
}

std::vector<Variant> grid(const std::string& yaml) {
  return expand_grid(ConfigurationNode::parse(yaml, "grid.yaml"));
}

TEST(AblationGrid, IsEveryCombinationInTheFilesOrder) {
  const std::vector<Variant> variants = grid("{magnetic.beta: [0, 0.5, 1], degeneracy.mask: [hard, soft]}");
  EXPECT_THAT(names(variants), ElementsAre("beta=0 mask=hard", "beta=0 mask=soft", "beta=0.5 mask=hard",
                                           "beta=0.5 mask=soft", "beta=1 mask=hard", "beta=1 mask=soft"));
  ASSERT_EQ(variants[3].switches.size(), 2U);
  EXPECT_EQ(variants[3].find("magnetic.beta")->value, "0.5");
  EXPECT_EQ(variants[3].find("degeneracy.mask")->value, "soft");
  EXPECT_EQ(variants[3].find("degeneracy.rule"), nullptr);
}

TEST(AblationGrid, NamesKeysWholeWhereTheirLastPartsAreAlike) {
  EXPECT_THAT(names(grid("{degeneracy.rule: [none], ieskf.degeneracy.rule: [paper], noise_ut: [5]}")),
              ElementsAre("degeneracy.rule=none ieskf.degeneracy.rule=paper noise_ut=5"));
  EXPECT_THROW(grid("{magnetic.beta: []}"), InputError);
  EXPECT_THROW(grid("{magnetic.beta: 0.3}"), InputError);
  EXPECT_THROW(grid("{magnetic.beta: [[0.3, 0.5]]}"), InputError);
}

TEST(AblationEach, IsOneVariantForEachValue) {
  const std::vector<Variant> variants = expand_each(
      ConfigurationNode::parse("{lidar.map.voxel_m: [0.2, 0.4], lidar.sampling.voxel_m: [0.6]}", "each.yaml"));
  EXPECT_THAT(names(variants),
              ElementsAre("lidar.map.voxel_m=0.2", "lidar.map.voxel_m=0.4", "lidar.sampling.voxel_m=0.6"));
  ASSERT_EQ(variants[1].switches.size(), 1U);
  EXPECT_EQ(variants[1].find("lidar.map.voxel_m")->value, "0.4");
  EXPECT_THROW(expand_each(ConfigurationNode::parse("{magnetic.beta: 0.3}", "each.yaml")), InputError);
}

TEST(AblationFile, ReadsVariantsGridAndWhatAllHaveInCommon) {
  const TemporaryFolder folder;
  std::string text = changed("drives:",
                             "settings: {degeneracy.rule: paper, magnetic.huber: false}\ngrid: {magnetic.beta: [0.1]}\n"
                             "each: {smoother.window_s: [1]}\ndrives:");
  const Ablation ablation = load_ablation(write_yard(folder, text), false);
  EXPECT_THAT(names(ablation.variants),
              ElementsAre("as shipped", "no mask", "one magnetometer", "beta=0.1", "smoother.window_s=1"));
  EXPECT_THAT(ablation.keys(), ElementsAre("degeneracy.rule", "magnetic.huber", "magnetic.magnetometers",
                                           "magnetic.beta", "smoother.window_s"));
  EXPECT_EQ(ablation.variants[0].find("degeneracy.rule")->value, "paper");
  EXPECT_EQ(ablation.variants[1].find("degeneracy.rule")->value, "none") << "its own wins";
  EXPECT_EQ(ablation.baseline, 0U);
  EXPECT_THAT(ablation.seeds, ElementsAre(1, 2));
  EXPECT_THAT(load_ablation((folder / "ablation.yaml").string(), true).seeds, ElementsAre(1));
}

TEST(AblationFile, ValuesAreThoseInForce) {
  const TemporaryFolder folder;
  const Ablation ablation = load_ablation(write_yard(folder), false);
  const auto value = [&](std::size_t variant, const char* key) {
    return effective_value(ablation, ablation.variants[variant], key);
  };
  EXPECT_EQ(value(1, "degeneracy.rule"), "none");
  EXPECT_EQ(value(0, "degeneracy.rule"), "marginal") << "the default";
  EXPECT_EQ(value(0, "magnetic.magnetometers"), "all");
  EXPECT_EQ(value(2, "magnetic.magnetometers"), "1");
  EXPECT_EQ(value(0, "estimator"), "smoother");
  EXPECT_EQ(value(0, "map.resolution_m"), "0.1");
  EXPECT_EQ(value(0, "noise_ut"), "") << "the world's";
}

/// Every mistake is reported in one line with the file's name, the line and the correction.
TEST(AblationFile, MistakesAreOneLineWithTheirPlace) {
  struct Case {
    std::string text;
    const char* expected_text;
  };
  for (const Case& wrong :
       {Case{changed("variants:", "variant:"), "unknown key 'variant'; did you mean 'variants'?"},
        Case{changed("degeneracy.rule: none", "degeneracy.rul: none"), "did you mean 'rule'?"},
        Case{changed("degeneracy.rule: none", "degeneracy.rule: nine"), "did you mean 'none'?"},
        Case{changed("degeneracy.rule: none", "magnetic.beta: 2"), "a number from 0 to 1"},
        Case{changed("degeneracy.rule: none", "map.resolution: 2"), "did you mean 'resolution_m'?"},
        Case{changed("degeneracy.rule: none", "noise_ut: -1"), "not be below 0"},
        Case{changed("degeneracy.rule: none", "noise_ut: loud"), "expected a number"},
        Case{changed("degeneracy.rule: none", "estimator: iesk"), "did you mean 'ieskf'?"},
        Case{changed("degeneracy.rule: none", "noise: 2"), "unknown key 'noise'"},
        Case{changed("{degeneracy.rule: none}", "{}"), "'as shipped' and 'no mask' set the same"},
        Case{changed("baseline: as shipped", "baseline: as shiped"), "did you mean 'as shipped'?"},
        Case{changed("baseline: as shipped\n", ""), "baseline"},
        Case{changed("no mask:", "\"no, mask\":"), "a variant's name must not contain"},
        Case{changed("title:", "estimator: smother\ntitle:"), "did you mean 'smoother'?"},
        Case{changed("[30, 5]", "[30, 30]"), "two runs would be called"},
        Case{changed("duration_s: 3", "duration: 3"), "duration_s"},
        Case{"baseline: a\nvariants: {a: {}}\ndrives: [{world: yard.yaml, sequences: [out]}]\n", "two variants"},
        Case{"baseline: a\nvariants: {a: {}, b: {noise_ut: 2}}\ndrives: []\n", "at least one drive"}}) {
    const TemporaryFolder folder;
    const std::string file = write_yard(folder, wrong.text);
    try {
      load_ablation(file, false);
      ADD_FAILURE() << "accepted, though: " << wrong.expected_text;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(wrong.expected_text));
      EXPECT_TRUE(std::regex_search(error.what(), std::regex("^" + file + "(:[0-9]+)?: "))) << error.what();
      EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n")));
    }
  }
}

TEST(AblationFile, TheShippedOnesAreReadInBothFormsAndTheirQuickOnesAreQuick) {
  int files = 0;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(LODESTONE_SOURCE_DIR) + "/config/ablations")) {
    if (entry.path().extension() != ".yaml") continue;
    ++files;
    const Ablation whole = load_ablation(entry.path().string(), false);
    EXPECT_EQ(whole.name, entry.path().stem().string());
    for (const reproduce::Drive& drive : whole.drives) EXPECT_TRUE(std::filesystem::exists(drive.world)) << drive.world;
    const Ablation quick = load_ablation(find_ablation(entry.path().stem().string()), true);
    EXPECT_EQ(quick.seeds.size(), 1U);
    EXPECT_TRUE(quick.duration_s.has_value());
    EXPECT_LE(reproduce::list_runs(meant_runs(quick)).size(), 2 * quick.variants.size()) << entry.path();
  }
  EXPECT_GT(files, 5);
  EXPECT_THROW(find_ablation("no such ablation"), InputError);
}

class AblationPlan : public testing::Test {
 protected:
  reproduce::Plan plan(const std::string& text, const std::vector<std::string>& only = {}) {
    Ablation ablation = load_ablation(write_yard(folder_, text), false);
    ablation.only = only;
    return make_plan(meant_runs(ablation), "one build");
  }
  static std::size_t count(const reproduce::Plan& plan, reproduce::StepKind kind) {
    return static_cast<std::size_t>(
        std::count_if(plan.steps.begin(), plan.steps.end(), [&](const auto& step) { return step.kind == kind; }));
  }
  static std::set<std::string> groups(const reproduce::Plan& plan) {
    std::set<std::string> all;
    for (const auto& run : plan.runs) all.insert(run.group);
    return all;
  }
  using Kind = reproduce::StepKind;
  TemporaryFolder folder_;
};

TEST_F(AblationPlan, VariantsOfTheEstimatorShareLogsCloudsAndMaps) {
  const reproduce::Plan all = plan(kYardAblation);
  EXPECT_EQ(count(all, Kind::run), 3U * 2U * 2U);  // variants, ranges, seeds
  EXPECT_EQ(count(all, Kind::log), 2U);
  EXPECT_EQ(count(all, Kind::cloud), 2U);
  EXPECT_EQ(count(all, Kind::field), 2U);
}

TEST_F(AblationPlan, NoiseMakesItsOwnLogsAndOptionsOfTheMapTheirOwnMaps) {
  const reproduce::Plan noise = plan(changed("degeneracy.rule: none", "noise_ut: 5"));
  EXPECT_EQ(count(noise, Kind::log), 4U);
  EXPECT_EQ(count(noise, Kind::field), 2U) << "surveyed with the world's own noise";
  const reproduce::Plan map = plan(changed("degeneracy.rule: none", "map.resolution_m: 0.2"));
  EXPECT_EQ(count(map, Kind::log), 2U);
  EXPECT_EQ(count(map, Kind::field), 4U);
  const reproduce::Plan world = plan(changed("degeneracy.rule: none", "world.sensors.lidar.range_noise_m: 0.05"));
  EXPECT_EQ(count(world, Kind::log), 4U);
  EXPECT_EQ(count(world, Kind::cloud), 4U);
  for (const reproduce::Plan& one : {noise, map, world}) {
    std::set<std::string> names;
    std::set<std::string> folders;
    for (const auto& step : one.steps) {
      names.insert(step.name);  // also names of log files
      folders.insert(step.folder);
    }
    EXPECT_EQ(names.size(), one.steps.size());
    EXPECT_EQ(folders.size(), one.steps.size());
  }
}

TEST_F(AblationPlan, RunsOfOneRecipeAreOneWhateverTheirVariantIsCalled) {
  const reproduce::Plan one = plan(kYardAblation);
  std::string other =
      changed("no mask: {degeneracy.rule: none}", "unmasked: {degeneracy.mask: hard, degeneracy.rule: none}");
  other.replace(other.find("as shipped: {}"), 14, "as shipped: {magnetic.beta: 0.3, degeneracy.mask: soft}");
  other.replace(other.find("one magnetometer: {magnetic.magnetometers: 1}"), 45,
                "unmasked again: {degeneracy.rule: none}");
  const reproduce::Plan two = plan(other);
  std::set<std::pair<std::string, std::string>> steps;
  for (const auto& step : one.steps) steps.emplace(step.folder, step.fingerprint);
  std::size_t shared = 0;
  for (const auto& step : two.steps) shared += steps.count({step.folder, step.fingerprint});
  EXPECT_EQ(shared, 6U + 4U) << "logs, clouds, maps, and the runs without mask";
  EXPECT_EQ(groups(two).count("smoother+degeneracy.mask=hard+degeneracy.rule=none"), 1U);
}

TEST_F(AblationPlan, OnlyNamesVariantsAndDrivesAndKeepsTheirBaseline) {
  const auto runs = [&](const std::string& pattern) { return count(plan(kYardAblation, {pattern}), Kind::run); };
  EXPECT_EQ(runs("no mask"), 2U * 4U);
  EXPECT_EQ(runs("no mask/yard-out-5m"), 2U * 2U);
  EXPECT_EQ(runs("no mask/yard-out-5m/seed2"), 2U);
  EXPECT_EQ(runs("as shipped"), 4U);
  EXPECT_EQ(runs("yard-out-30m"), 6U);
  EXPECT_EQ(runs("n*/*/seed1"), 2U * 2U);
  try {
    runs("no maks");
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("did you mean 'no mask'?"));
  }
}

TEST(AblationRecipe, IsSafeAsAFoldersName) {
  Ablation ablation;
  EXPECT_EQ(recipe_name(ablation, {"a", {{"b.c", "1"}, {"a.b", "x"}}}), "smoother+a.b=x+b.c=1");
  EXPECT_EQ(recipe_name(ablation, {"a", {{"estimator", "ieskf"}}}), "ieskf");
  const std::string odd = recipe_name(ablation, {"a", {{"k", "front 0,../x"}}});
  EXPECT_EQ(odd.find_first_of("/ ,"), std::string::npos) << odd;
  EXPECT_NE(odd, recipe_name(ablation, {"a", {{"k", "front_0_.._x"}}}));
  EXPECT_LT(recipe_name(ablation, {"a", {{"k", std::string(500, 'x')}}}).size(), 200U);
  EXPECT_NE(recipe_name(ablation, {"a", {{"k", std::string(500, 'x')}}}),
            recipe_name(ablation, {"a", {{"k", std::string(501, 'x')}}}));
}

}  // namespace
}  // namespace lodestone::ablation
