#include "frontends/messages/message_paths.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "frontends/messages/wire_cdr.h"
#include "frontends/messages/wire_ros1.h"
#include "frontends/synchronizer/bag_source.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/logs/test_files.h"

namespace lodestone {
namespace {

using ::lodestone::testing::message_of;
using ::lodestone::testing::SyntheticLog;
using ::lodestone::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// An array of magnetometers and an IMU in one message, with further typical fields.
constexpr const char* board_definition =
    "# A board of sensors\n"
    "uint8 KIND = 3\n"
    "Header header\n"
    "string<=20 name \"board\"\n"
    "bool[3] healthy\n"
    "Reading[<=8] readings   # each with its own time\n"
    "float32 temperature\n"
    "geometry_msgs/msg/Vector3 rate\n"
    "float32[6] acceleration_and_more\n"
    "================================================================================\n"
    "MSG: board_msgs/msg/Reading\n"
    "std_msgs/Header header\n"
    "uint16 raw\n"
    "geometry_msgs/Vector3 field\n"
    "================================================================================\n"
    "MSG: geometry_msgs/Vector3\n"
    "float64 x\nfloat64 y\nfloat64 z\n";

constexpr Time board_time = 1'700'000'001'000'000'000;

template <class Wire>
std::vector<std::uint8_t> board_message(int readings, Time time = board_time) {
  Wire wire;
  wire.header(time, "board");
  wire.text("odd");
  for (int i = 0; i < 3; ++i) wire.number(std::uint8_t{1});
  wire.number(static_cast<std::uint32_t>(readings));
  for (int i = 0; i < readings; ++i) {
    wire.header(time + 1000 * (i + 1), "m");
    wire.number(static_cast<std::uint16_t>(7));
    for (int axis = 0; axis < 3; ++axis) wire.number(20e-6 * (i + 1) + 1e-6 * axis);
  }
  wire.number(25.5F);
  for (int axis = 0; axis < 3; ++axis) wire.number(0.1 * axis);
  for (int i = 0; i < 6; ++i) wire.number(i == 4 ? 9.80665F : 0.5F);
  return wire.take();
}

TopicInfo board_topic(Encoding encoding) {
  TopicInfo topic;
  topic.name = "/board";
  topic.type = "board_msgs/Board";
  topic.encoding = encoding;
  topic.definition = board_definition;
  return topic;
}

std::vector<MessagePaths::Vector> read(const TopicInfo& topic, const std::vector<std::uint8_t>& bytes,
                                       const std::vector<std::string>& paths) {
  MessagePaths reader("log", topic);
  for (const std::string& path : paths) reader.add(path, "the key");
  std::vector<MessagePaths::Vector> vectors;
  reader.read({42, 0, bytes.data(), bytes.size()}, vectors);
  return vectors;
}

TEST(MessagePaths, ReadSingleNumbersAndSayWhenTheyBeginAnew) {
  MessagePaths reader("log", board_topic(Encoding::cdr));
  const std::size_t raw = reader.add_number("readings[1].raw", "the key");
  const std::size_t acceleration = reader.add_number("acceleration_and_more[4]", "the key");
  const std::vector<std::uint8_t> bytes = board_message<CdrWireWriter>(2);
  std::vector<MessagePaths::Vector> vectors;
  reader.read({42, 0, bytes.data(), bytes.size()}, vectors);
  EXPECT_EQ(vectors[raw].values[0], 7.0);
  EXPECT_EQ(vectors[raw].stamp, board_time + 2000);
  EXPECT_EQ(reader.period(raw), 65536.0);
  EXPECT_FLOAT_EQ(static_cast<float>(vectors[acceleration].values[0]), 9.80665F);
  EXPECT_EQ(reader.period(acceleration), 0.0);
  for (const char* path : {"rate", "acceleration_and_more", "name", "nothing"}) {
    EXPECT_THAT(message_of<InputError>([&] { reader.add_number(path, "the key"); }), HasSubstr("is not a number"))
        << path;
  }
}

TEST(MessagePaths, FindVectorsInAnyMessageOfEitherRos) {
  const std::vector<std::string> paths{"readings[2].field", "rate", "readings[0].field", "acceleration_and_more[2]"};
  for (const Encoding encoding : {Encoding::ros1, Encoding::cdr}) {
    const auto bytes = encoding == Encoding::cdr ? board_message<CdrWireWriter>(3) : board_message<Ros1WireWriter>(3);
    const auto vectors = read(board_topic(encoding), bytes, paths);
    ASSERT_EQ(vectors.size(), 4U);
    EXPECT_THAT(vectors[0].values, ElementsAre(20e-6 * 3, 20e-6 * 3 + 1e-6, 20e-6 * 3 + 2e-6));
    EXPECT_EQ(vectors[0].stamp, board_time + 3000) << "the innermost header counts";
    EXPECT_THAT(vectors[1].values, ElementsAre(0.0, 0.1, 0.2));
    EXPECT_EQ(vectors[1].stamp, board_time);
    EXPECT_EQ(vectors[2].stamp, board_time + 1000);
    EXPECT_THAT(vectors[3].values, ElementsAre(0.5, 0.5, static_cast<double>(9.80665F)));
  }
}

TEST(MessagePaths, ListsOfNumbersNeedNoDefinition) {
  TopicInfo topic;
  topic.name = "/array";
  topic.type = "std_msgs/Float32MultiArray";
  topic.encoding = Encoding::cdr;
  CdrWireWriter wire;
  wire.number(std::uint32_t{1});  // one dimension
  wire.text("sensor");
  wire.number(std::uint32_t{9});
  wire.number(std::uint32_t{9});
  wire.number(std::uint32_t{0});
  wire.number(std::uint32_t{9});
  for (int i = 0; i < 9; ++i) wire.number(static_cast<float>(i));
  const auto vectors = read(topic, wire.take(), {"data[3]", "data[6]"});
  EXPECT_THAT(vectors[0].values, ElementsAre(3.0, 4.0, 5.0));
  EXPECT_THAT(vectors[1].values, ElementsAre(6.0, 7.0, 8.0));
  EXPECT_EQ(vectors[1].stamp, 42) << "without a header the record time stands";
}

TEST(MessagePaths, SayWhatIsWrong) {
  const auto error = [](const TopicInfo& topic, const std::string& path, int readings) {
    return message_of<InputError>([&] { read(topic, board_message<Ros1WireWriter>(readings), {path}); });
  };
  const TopicInfo topic = board_topic(Encoding::ros1);
  EXPECT_THAT(error(topic, "reading[0].field", 3),
              AllOf(HasSubstr("the key: 'reading[0].field' is not a vector of a board_msgs/Board"),
                    HasSubstr("header, name, healthy[], readings[], temperature, rate")));
  EXPECT_THAT(error(topic, "temperature", 3), HasSubstr("expected components x, y and z"));
  EXPECT_THAT(error(topic, "rate[1]", 3), HasSubstr("is not a vector"));
  EXPECT_THAT(error(topic, "readings[", 3), HasSubstr("expected a path like data[0]"));
  EXPECT_THAT(error(topic, "readings[5].field", 3),
              HasSubstr("topic /board, recorded at 0 s: a list in the message is shorter"));
  TopicInfo bare = topic;
  bare.definition.clear();
  EXPECT_THAT(error(bare, "rate", 3), HasSubstr("the log has no definition of it"));
  bare.definition = "Other other\n";
  EXPECT_THAT(error(bare, "rate", 3), HasSubstr("does not define 'board_msgs/Other'"));
  bare.definition = "Board inner\n";
  EXPECT_THAT(message_of<InputError>([&] { read(bare, board_message<Ros1WireWriter>(1), {"inner"}); }),
              HasSubstr("not a vector"));
  std::vector<std::uint8_t> cut = board_message<Ros1WireWriter>(3);
  cut.resize(cut.size() / 2);
  EXPECT_THAT(message_of<InputError>([&] { read(topic, cut, {"rate"}); }), HasSubstr("/board"));
}

/// A log whose magnetometers and IMU are in messages of the board, together with the synthetic log's clouds.
TEST(MessagePaths, AnImuAndItsMagnetometersComeFromOneMessage) {
  const TemporaryFolder folder;
  const std::string path = folder / "log.bag";
  TopicInfo topic = board_topic(Encoding::ros1);
  topic.md5 = "0123456789abcdef0123456789abcdef";
  ros1::BagWriter writer(path, Codec::none);
  for (int i = 0; i < 300; ++i) {
    const Time time = board_time + i * 5'000'000;
    const auto bytes = board_message<Ros1WireWriter>(2, time);
    writer.write(topic, {time + 2'000'000, 0, bytes.data(), bytes.size()});
  }
  writer.close();
  Platform platform;
  platform.file = "platform.yaml";
  platform.imu.topic = "/board";
  platform.imu.angular_velocity_path = "rate";
  platform.imu.linear_acceleration_path = "acceleration_and_more[2]";
  platform.magnetometers = {{"/board", FieldUnit::tesla, "readings[0].field"},
                            {"/board", FieldUnit::tesla, "readings[1].field"}};
  platform.suite.magnetometers.resize(2);
  WarningLog warnings;
  BagSource source(path, platform, warnings, {.lidar = false});
  int imu = 0, fields[2] = {0, 0};
  for (Measurement measurement; source.next(measurement);) {
    if (const auto* sample = std::get_if<ImuSample>(&measurement)) {
      EXPECT_EQ(sample->time, board_time + imu++ * 5'000'000);
      EXPECT_EQ(sample->angular_velocity, Vector3(0.0, 0.1, 0.2));
      EXPECT_NEAR(sample->linear_acceleration.z(), 9.80665, 1e-6);
    } else if (const auto* field = std::get_if<MagneticSample>(&measurement)) {
      const int which = field->magnetometer;
      EXPECT_EQ(field->time, board_time + fields[which]++ * 5'000'000 + 1000 * (which + 1));
      EXPECT_NEAR((field->field_ut - Vector3(20, 21, 22) - 20.0 * which * Vector3::Ones()).norm(), 0.0, 1e-9);
    }
  }
  EXPECT_EQ(imu, 300);
  EXPECT_EQ(fields[0], 300);
  EXPECT_EQ(fields[1], 300);
  EXPECT_TRUE(warnings.entries().empty());

  platform.magnetometers[1].path.clear();
  EXPECT_THAT(message_of<InputError>([&] { BagSource(path, platform, warnings, {.lidar = false}); }),
              AllOf(HasSubstr("topic /board is a board_msgs/Board; expected a sensor_msgs/MagneticField"),
                    HasSubstr("magnetometers[1].values")));
}

TEST(MagnetometerUnits, AreToldApartByTheFieldsSize) {
  const TemporaryFolder folder;
  SyntheticLog log;
  log.scans = 10;
  const std::pair<FieldUnit, const char*> units[] = {{FieldUnit::tesla, "tesla"},
                                                     {FieldUnit::microtesla, "microtesla"},
                                                     {FieldUnit::nanotesla, "nanotesla"},
                                                     {FieldUnit::gauss, "gauss"},
                                                     {FieldUnit::milligauss, "milligauss"}};
  for (const auto& [written, written_name] : units) {
    log.on_field = [written = written](int, int, ros1::MagneticFieldMessage& field) {
      for (double& value : field.field_tesla) value *= 1e6 / microtesla_per(written);
      return true;
    };
    log.write(folder / "log.bag");
    for (const auto& [stated_unit, stated_name] : units) {
      SCOPED_TRACE(std::string(written_name) + " read as " + stated_name);
      Platform platform = log.platform();
      for (auto& magnetometer : platform.magnetometers) magnetometer.unit = stated_unit;
      WarningLog warnings;
      const double ratio = microtesla_per(stated_unit) / microtesla_per(written);
      const auto open = [&] { BagSource(folder / "log.bag", platform, warnings); };
      if (ratio < 0.1 / 45.0 || ratio > 1000.0 / 45.0) {
        EXPECT_THAT(message_of<InputError>(open), HasSubstr(std::string("it looks like ") + written_name +
                                                            ": set magnetometers[0].unit: " + written_name));
        continue;
      }
      open();
      // A factor of ten is no proof, because of steel and hard iron; it causes a warning.
      EXPECT_EQ(warnings.count("magnetometer.magnitude"), ratio == 1.0 ? 0 : 2);
    }
  }
}

}  // namespace
}  // namespace lodestone
