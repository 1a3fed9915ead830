// The command line as a whole: misspelt words are reported, with the nearest known word.
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "frontends/maps/magnetic_map_file.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

TEST(Program, AnUnknownOptionIsNamedBeforeWhatIsMissing) {
  expect_refused("run a.bag --estimatr smoother",
                 "unknown option '--estimatr'; did you mean '--estimator'? (see lodestone run --help)");
  expect_refused("run a.bag --out=x --clod=y",
                 "unknown option '--clod'; did you mean '--cloud'? (see lodestone run --help)");
  expect_refused("map magnetic --trajectry a.tum", "did you mean '--trajectory'? (see lodestone map magnetic --help)");
  expect_refused("run a.bag --wholly-made-up", "unknown option '--wholly-made-up' (see lodestone run --help)");
}

TEST(Program, AMissingOptionSendsToTheHelpOfItsOwnCommand) {
  expect_refused("run a.bag", "(see lodestone run --help)");
  expect_refused("map magnetic a.bag", "(see lodestone map magnetic --help)");
  expect_refused("map", "(see lodestone map --help)");
}

TEST(Program, AWrongValueStatesWhatIsExpected) {
  expect_refused("check a.bag --seconds abc", "--seconds: expected a number, found 'abc' (see lodestone check --help)");
  expect_refused("convert a.bag --out b.bag --from abc", "--from: expected a number, found 'abc'");
  expect_refused("simulate a.yaml --out a --seed 1.5", "--seed: expected a whole number, found '1.5'");
  expect_refused("simulate a.yaml --out a --seed ''", "--seed: expected a whole number, found ''");
  expect_refused("simulate a.yaml --out a --seed=-1", "--seed: expected a whole number from 0, found -1");
  expect_refused("check a.bag --seconds ''", "--seconds: expected a number, found ''");
  expect_refused("reproduce paper --seeds ''", "--seeds: expected a whole number, found ''");
  expect_refused("check a.bag --origin 1,2", "--origin: expected 3 numbers, found 2: 1, 2 (see");
  expect_refused("check a.bag --origin 1,2,x", "--origin: expected 3 numbers, found '1,2,x' (see");
  expect_refused("check a.bag --seconds", "--seconds: expected a number, found none (see");
  expect_refused("check a.bag --out b --out c", "--out: given twice (b, c); expected once (see");
  expect_refused("check a.bag --seconds 1 --seconds 2 --seconds=3",
                 "--seconds: given 3 times (1, 2, 3); expected once");
  expect_refused("check a.bag --origin 1,2,3 --origin 4,5,6",
                 "--origin: given twice (1, 2, 3, 4, 5, 6); expected once");
  expect_refused("check a.bag --origin 1,2,3,4,5,6", "--origin: expected 3 numbers, found 6: 1, 2, 3, 4, 5, 6 (see");
  expect_refused("run a.bag --refine bach",
                 "--refine: expected one of none, batch, found 'bach'; did you mean 'batch'? (see");
}

TEST(Program, AnArgumentTooManyIsNamed) {
  expect_refused("check a.bag b.bag", "unexpected argument 'b.bag'; expected only LOG (see lodestone check --help)");
  expect_refused("evaluate a.tum b.tum c.tum", "unexpected argument 'c.tum'; expected only ESTIMATE TRUTH (see");
}

TEST(Program, AnUnknownCommandIsNamedAtEveryDepth) {
  EXPECT_THAT(run_lodestone("rnu a.bag").errors, ::testing::Not(::testing::HasSubstr("manual"))) << "hidden";
  expect_refused("rnu a.bag", "there is no command 'rnu'; did you mean 'run'? (known: simulate, ");
  expect_refused("map truht a.yaml", "there is no command 'truht' of lodestone map; did you mean 'truth'? (known: ");
  expect_refused("calibrate camera", "there is no command 'camera' of lodestone calibrate (known: magnetometers)");
  expect_refused("", "a command is missing: simulate, ");
  expect_refused("map", "a command is missing: ");
}

TEST(Program, AShippedFileIsFoundByItsName) {
  expect_refused("simulate tunel --out /tmp/none", "there is no world 'tunel' in config/worlds (known: carpark, ");
  expect_refused("simulate tunnel --duration 0.001 --out /tmp/none", "--duration: expected at least one scan");
}

TEST(Program, ResultsDoNotTakeThePlaceOfWhatTheyComeFrom) {
  const TemporaryFolder folder;
  const std::string truth = folder / "truth.tum";
  std::ofstream(truth) << "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n";
  const std::string content = content_of(truth);
  const std::string other = folder.path().string() + "/./truth.tum";
  for (const std::string& call : {"evaluate " + truth + " " + truth + " --errors " + truth,
                                  "evaluate " + truth + " " + truth + " --errors=" + other,
                                  "check " + truth + " --out " + truth, "map import " + truth + " --out=" + truth}) {
    expect_refused(call, "which the results would overwrite; choose another name for them");
    EXPECT_EQ(content_of(truth), content) << call;
  }
  EXPECT_EQ(run_lodestone("evaluate " + truth + " " + truth + " --errors " + (folder / "errors.csv").string()).code, 0);
  EXPECT_EQ(run_lodestone("evaluate " + truth + " " + truth + " --errors " + (folder / "errors.csv").string()).code, 0);
}

TEST(Program, WhatIsWrittenBesideAResultDoesNotTakeThePlaceOfAnInputEither) {
  const TemporaryFolder folder;
  const std::string in = folder.path().string() + "/", out = " --out " + in;
  const std::vector<std::string> inputs{"field.tif",      "field.png",  "calibration.json",
                                        "platform.yaml",  "survey.bag", "difference.yaml",
                                        "difference.tif", "image.tif",  "places.csv"};
  for (const std::string& name : inputs) std::ofstream(in + name) << "of " << name;
  std::ofstream(in + "map.yaml") << "resolution_m: 1\norigin_m: [0, 0]\nimage: image.tif\n";
  std::filesystem::create_symlink("field.png", in + "link.csv");
  struct Case {
    std::string call, out, expected_text;
  };
  const std::string too = ", which is written too, is ";
  for (const Case& wrong :
       {Case{"map import " + in + "field.png", "field.yaml", in + "field.png" + too + in + "field.png"},
        Case{"map import " + in + "link.csv", "field.yaml", in + "field.png" + too + in + "link.csv"},
        Case{"map import " + in + "./field.tif", "field.yaml", in + "field.tif" + too + in + "./field.tif"},
        Case{"map magnetic a.bag --platform p.yaml --trajectory=" + in + "field.tif", "field.yaml",
             in + "field.tif" + too + "--trajectory " + in + "field.tif"},
        Case{"map truth w.yaml --like " + in + "map.yaml", "image.yaml",
             in + "image.tif" + too + in + "image.tif, the image of --like " + in + "map.yaml"},
        Case{"map diff " + in + "difference.yaml b.yaml", "", in + "difference.yaml" + too + in + "difference.yaml"},
        Case{"map diff " + in + "map.yaml " + in + "places.csv", "", in + "places.csv" + too + in + "places.csv"},
        Case{"calibrate magnetometers a.bag --platform " + in + "calibration.json", "new.yaml",
             in + "calibration.json" + too + "--platform " + in + "calibration.json"},
        Case{"simulate " + in + "platform.yaml --only log", "", in + "platform.yaml" + too + in + "platform.yaml"},
        Case{"check a.bag --magnetic " + in + "map.yaml", "image.tif",
             "is " + in + "image.tif, the image of --magnetic " + in + "map.yaml"}}) {
    expect_refused(wrong.call + out + wrong.out,
                   "--out " + in + wrong.out + ": " + wrong.expected_text + ", which the results would overwrite");
  }
  for (const std::string& name : inputs) EXPECT_EQ(content_of(in + name), "of " + name);
}

TEST(Program, ResultsDoNotTakeThePlaceOfAPartOfALog) {
  const TemporaryFolder folder;
  const std::string log = (folder / "log").string(), part = log + "/part_0.bag", samples = log + "/imu.csv";
  std::filesystem::create_directories(log);
  std::ofstream(part) << "#ROSBAG V2.0\n";
  std::ofstream(samples) << "time_s\n";
  for (const std::string& out : {part, samples}) {
    const std::string content = content_of(out);
    for (const std::string& given : {log, log + "/../log/"}) {
      expect_refused("convert " + given + " --out " + out,
                     "is a part of " + given + ", which the results would overwrite");
      EXPECT_EQ(content_of(out), content);
    }
    std::ofstream(log + "/metadata.yaml") << "rosbag2_bagfile_information: {}\n";
    expect_refused("convert " + log + "/metadata.yaml --out " + out,
                   "is a part of " + log + "/metadata.yaml, which the results would overwrite");
  }
}

TEST(Program, MessagesAreQuietDetailedOrKeptInAFile) {
  const TemporaryFolder folder;
  const std::string truth = folder / "truth.tum", log = folder / "messages.log";
  std::ofstream(truth) << "0 0 0 0 0 0 0 1\n1 1 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n";
  const std::string call = "evaluate " + truth + " " + truth;
  const ProgramResult plain = run_lodestone(call), verbose = run_lodestone(call + " --verbose --log-file " + log);
  EXPECT_EQ(plain.errors, "");
  EXPECT_THAT(verbose.errors, ::testing::HasSubstr("exit code 0"));
  EXPECT_EQ(plain.output, verbose.output);
  EXPECT_THAT(content_of(log), ::testing::ContainsRegex("T[0-9:.]+ debug lodestone .*: evaluate "));
  expect_refused("evaluate absent.tum " + truth + " --quiet --log-file " + log, "absent.tum: ");
  EXPECT_THAT(content_of(log), ::testing::HasSubstr(" error lodestone: absent.tum: "));
  expect_refused(call + " --quiet --verbose", "--quiet");
  const std::string content = content_of(truth);
  expect_refused(call + " --log-file " + truth,
                 "--log-file " + truth + ": is " + truth + ", which the results would overwrite");
  EXPECT_EQ(content_of(truth), content);
  expect_refused(call + " --log-file " + folder.path().string(), "cannot be written");
}

TEST(Program, ASignalEndsACommandBetweenItsSteps) {
  const TemporaryFolder folder;
  const std::string like = (folder / "like.yaml").string(), out = (folder / "truth.yaml").string();
  const std::string pose = (folder / "pose.tum").string(), errors = (folder / "errors").string();
  const FieldGrid grid{0.1, {20.0, -0.5}, 3, 3, {0.12}};
  write_magnetic_map(MagneticMap(grid, std::vector<Eigen::Vector4f>(9, {1.0F, 2.0F, 3.0F, 0.5F}), 2.0), {}, like);
  std::ofstream(pose) << "0 0 0 0 0 0 0 1\n";
  // The signal comes while the command reads a pipe: a comment fills the pipe, so that the signal finds a reader.
  const auto interrupted_in = [](const std::string& file) {
    return " <(head -c 300000 /dev/zero | tr '\\0' '#'; echo; kill -INT $$; cat " + file + ") ";
  };
  for (const std::string& arguments : {"evaluate" + interrupted_in(pose) + pose,
                                       "map truth" + interrupted_in(LODESTONE_SOURCE_DIR "/config/worlds/tunnel.yaml") +
                                           "--like " + like + " --out " + out}) {
    std::ofstream(folder / "call.sh") << "exec " LODESTONE_PROGRAM " " << arguments << " >/dev/null 2>" << errors;
    const int status = std::system(("bash " + (folder / "call.sh").string()).c_str());
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 130) << arguments << status;
    EXPECT_EQ(content_of(errors), "lodestone: interrupted\n");
  }
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(Program, WhatIsNoFileIsOneLine) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "pipe").c_str(), 0600), 0);
  expect_refused("evaluate " + (folder / "pipe").string() + " " + (folder / "pipe").string(),
                 "found a pipe, a device or a socket");
  expect_refused("evaluate /dev/zero /dev/zero", "found a pipe, a device or a socket");
  std::filesystem::create_symlink("loop", folder / "loop");
  expect_refused("check " + (folder / "loop").string(), "Too many levels of symbolic links");
}

}  // namespace
}  // namespace lodestone
