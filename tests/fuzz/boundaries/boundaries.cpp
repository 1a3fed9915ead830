#include "tests/fuzz/boundaries/boundaries.h"

#include <fstream>
#include <stdexcept>

#include "core/error.h"
#include "frontends/configuration/configuration_node.h"
#include "frontends/configuration/kitti_trajectory.h"
#include "frontends/configuration/text_file.h"
#include "frontends/configuration/trajectory_file.h"
#include "frontends/logs/compression.h"
#include "frontends/logs/log_conversion.h"
#include "frontends/logs/open_log.h"
#include "frontends/maps/field_import.h"
#include "frontends/maps/magnetic_map_file.h"
#include "frontends/maps/point_cloud_file.h"
#include "frontends/messages/known_types.h"
#include "frontends/messages/message_decoder.h"
#include "frontends/messages/message_paths.h"
#include "frontends/messages/point_cloud_decoder.h"
#include "tests/frontends/logs/synthetic_log.h"
#include "tests/frontends/maps/las_file.h"
#include "tests/fuzz/boundaries/transform_boundary.h"
#include "tools/simulate/world.h"

namespace lodestone::testing {

namespace {

namespace fs = std::filesystem;

SyntheticLog small_log(Codec compression = Codec::none) {
  SyntheticLog log;
  log.scans = 2;
  log.points_per_scan = 64;
  log.compression = compression;
  return log;
}

template <Codec compression>
void write_bag(const fs::path& folder) {
  small_log(compression).write((folder / "log").string());
}

void write_cut_bag(const fs::path& folder) {
  write_bag<Codec::none>(folder);
  fs::resize_file(folder / "log", 2 * fs::file_size(folder / "log") / 3);
}

template <LogFormat format, Codec codec>
void write_converted(const fs::path& folder) {
  const fs::path bag = folder / "bag";
  small_log().write(bag.string());
  WarningLog warnings;
  const auto source = open_log(bag.string(), warnings);
  const auto writer = make_log_writer((folder / "log").string(), format, codec);
  convert_log(bag.string(), *source, *writer, [](Time) {});
  writer->close();
  fs::remove(bag);
}

/// A log packed as a whole.
void write_packed_log(const fs::path& folder) {
  write_converted<LogFormat::mcap, Codec::none>(folder);
  const std::string plain = read_text_file((folder / "log").string());
  const std::vector<std::uint8_t> packed =
      pack(Codec::zstd, {reinterpret_cast<const std::uint8_t*>(plain.data()), plain.size()});
  std::ofstream(folder / "log", std::ios::binary)
      .write(reinterpret_cast<const char*>(packed.data()), static_cast<std::streamsize>(packed.size()));
}

/// Decodes a message to the estimators' input.
void decode(MessageDecoder& decoder, PointCloudDecoder& clouds, const TopicInfo& topic, const RawMessage& raw) {
  if (topic.encoding == Encoding::other || message_type(topic.type) == MessageType::other) return;
  ros1::Message message;
  decoder.decode(topic, raw, message);
  LidarScan scan;
  if (const auto* cloud = std::get_if<ros1::PointCloudMessage>(&message)) clouds.decode(*cloud, scan);
  if (const auto* livox = std::get_if<ros1::LivoxMessage>(&message)) clouds.decode(*livox, scan);
  transcode("log", topic, raw, topic.encoding == Encoding::cdr ? Encoding::ros1 : Encoding::cdr);
}

void read_log(const fs::path& path) {
  WarningLog warnings;
  const auto source = open_log(path.string(), warnings);
  std::vector<std::string> names;
  for (const TopicInfo& topic : source->topics()) names.push_back(topic.name);
  source->select(names);
  MessageDecoder decoder(path.string());
  PointCloudDecoder clouds(path.string(), small_log().platform(), warnings);
  for (RawMessage raw; source->next(raw);) decode(decoder, clouds, source->topics()[raw.topic], raw);
}

void read_log_file(const fs::path& folder) {
  read_log(folder / "log");
}
void read_log_folder(const fs::path& folder) {
  read_log(folder);
}

void write_text(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

void write_csv_log(const fs::path& folder) {
  std::string imu =
      "time_ns,gyroscope_x_rad_s,gyroscope_y_rad_s,gyroscope_z_rad_s,accelerometer_x_m_s2,"
      "accelerometer_y_m_s2,accelerometer_z_m_s2\n";
  for (int i = 0; i < 20; ++i)
    imu += std::to_string(1'700'000'000'000'000'000 + i * 5'000'000) + ",0,0.25,-1e-3,0,0,9.8\n";
  write_text(folder / "imu.csv", imu);
}

void write_csv_magnetometer(const fs::path& folder) {
  std::string field = "time_s,field_x_ut,field_y_ut,field_z_ut\n";
  for (int i = 0; i < 20; ++i) field += "1700000000." + std::to_string(100 + i) + ",18.5,-2e0,-41\n";
  write_text(folder / "magnetometers/left.csv", field);
}

/// The first byte of the file `message` is the type; the rest are the message's bytes.
const TopicInfo kKnownTopics[] = {
    {"/points", "sensor_msgs/PointCloud2", Encoding::ros1, 1, 0, 0, "", ""},
    {"/livox", "livox_ros_driver/CustomMsg", Encoding::ros1, 1, 0, 0, "", ""},
    {"/imu", "sensor_msgs/Imu", Encoding::ros1, 1, 0, 0, "", ""},
    {"/field", "sensor_msgs/MagneticField", Encoding::ros1, 1, 0, 0, "", ""},
};

template <Encoding encoding>
void write_message(const fs::path& folder) {
  const fs::path bag = folder / "bag";
  small_log().write(bag.string());
  WarningLog warnings;
  const auto source = open_log(bag.string(), warnings);
  source->select({"/ouster/points"});
  RawMessage raw;
  source->next(raw);
  std::string text(1, '\0');
  if (encoding == Encoding::ros1) {
    text.append(reinterpret_cast<const char*>(raw.data), raw.size);
  } else {
    const std::vector<std::uint8_t> cdr = transcode(bag.string(), kKnownTopics[0], raw, encoding);
    text.append(reinterpret_cast<const char*>(cdr.data()), cdr.size());
  }
  write_text(folder / "message", text);
  fs::remove(bag);
}

template <Encoding encoding>
void read_message(const fs::path& folder) {
  const std::string text = read_text_file((folder / "message").string());
  if (text.empty()) return;
  TopicInfo topic = kKnownTopics[static_cast<unsigned char>(text[0]) % std::size(kKnownTopics)];
  topic.encoding = encoding;
  const std::vector<std::uint8_t> bytes(text.begin() + 1, text.end());
  WarningLog warnings;
  MessageDecoder decoder("message");
  PointCloudDecoder clouds("message", small_log().platform(), warnings);
  decode(decoder, clouds, topic, {0, 0, bytes.data(), bytes.size()});
}

constexpr const char* kCloudHeader =
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 16\nHEIGHT 1\nVIEWPOINT 0 0 0 "
    "1 0 0 0\nPOINTS 16\n";

void write_ascii_cloud(const fs::path& folder) {
  std::string text = std::string(kCloudHeader) + "DATA ascii\n";
  for (int i = 0; i < 16; ++i) text += std::to_string(i) + " 0.5 -1e-2\n";
  write_text(folder / "cloud.pcd", text);
}

void write_binary_cloud(const fs::path& folder) {
  write_text(folder / "cloud.pcd", std::string(kCloudHeader) + "DATA binary\n" + std::string(16 * 12, '?'));
}

/// LZF with literals only: length minus one, then the bytes. Packed clouds store each field contiguously.
void write_packed_cloud(const fs::path& folder) {
  const std::string plain(16 * 12, '?');
  std::string packed;
  for (std::size_t at = 0; at < plain.size(); at += 32) packed += std::string(1, 31) + plain.substr(at, 32);
  const std::uint32_t sizes[2] = {static_cast<std::uint32_t>(packed.size()), static_cast<std::uint32_t>(plain.size())};
  write_text(folder / "cloud.pcd", std::string(kCloudHeader) + "DATA binary_compressed\n" +
                                       std::string(reinterpret_cast<const char*>(sizes), 8) + packed);
}

/// A cloud of a log that is a folder of files.
void write_cloud_of_log(const fs::path& folder) {
  std::string text =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z intensity ring t\nSIZE 4 4 4 4 2 4\nTYPE F F F F U U\nCOUNT 1 1 1 1 1 "
      "1\nWIDTH 16\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 16\nDATA ascii\n";
  for (int i = 0; i < 16; ++i)
    text +=
        std::to_string(i + 1) + " 0.5 -1e-2 100 " + std::to_string(i % 2) + " " + std::to_string(i * 6'000'000) + "\n";
  write_text(folder / "points/1700000000.25.pcd", text);
}

/// The one cloud in the folder, of any format.
void read_cloud(const fs::path& folder) {
  for (const char* name : {"cloud.pcd", "cloud.ply", "cloud.las"}) {
    WarningLog warnings;
    if (fs::exists(folder / name)) read_point_cloud((folder / name).string(), warnings);
  }
}

/// Faces precede the vertices, and each vertex has a list: a reader must skip both.
std::string ply_header(const char* format) {
  return std::string("ply\nformat ") + format +
         " 1.0\ncomment of a map\nelement face 4\nproperty list uchar int vertex_index\nelement vertex 16\n"
         "property uchar red\nproperty float x\nproperty double y\nproperty float z\nproperty list uchar short "
         "seen\nend_header\n";
}

void write_ascii_ply(const fs::path& folder) {
  std::string text = ply_header("ascii");
  for (int i = 0; i < 4; ++i) text += "3 0 1 2\n";
  for (int i = 0; i < 16; ++i) text += "7 " + std::to_string(i) + " 0.5 -1e-2 2 5 6\n";
  write_text(folder / "cloud.ply", text);
}

void write_binary_ply(const fs::path& folder) {
  std::string text = ply_header("binary_little_endian");
  for (int i = 0; i < 4; ++i) text += '\3' + std::string(3 * 4, '\1');
  for (int i = 0; i < 16; ++i) text += '\7' + std::string(4 + 8 + 4, '?') + '\2' + std::string(2 * 2, '\1');
  write_text(folder / "cloud.ply", text);
}

void write_las(const fs::path& folder) {
  LasFile las;
  las.announced = 16;
  for (int i = 0; i < 16; ++i) las.add(i, 2 * i, 500);
  write_text(folder / "cloud.las", las.bytes());
}

void write_field(const fs::path& folder) {
  FieldGrid grid;
  grid.resolution_m = 0.5;
  grid.rows = 5;
  grid.columns = 6;
  grid.heights_m = {0.2, 0.6};
  std::vector<Eigen::Vector4f> nodes;
  for (int i = 0; i < 2 * 5 * 6; ++i) nodes.emplace_back(20.0F + 0.1F * static_cast<float>(i), 0.0F, -40.0F, 0.5F);
  write_magnetic_map(MagneticMap(grid, nodes, 5.0), {}, (folder / "field.yaml").string());
}

void read_field(const fs::path& folder) {
  const MagneticMap map = read_magnetic_map((folder / "field.yaml").string());
  map.for_each_node([](const Eigen::Vector4f&) {});
}

void write_table(const fs::path& folder) {
  std::string text = "x_m;y_m;z_m;B_x_nT;B_y_nT;B_z_nT;sigma\n";
  for (int i = 0; i < 2 * 4 * 5; ++i) {
    text += std::to_string(0.1 * (i % 4)) + ";" + std::to_string(0.1 * (i / 4 % 5)) + ";" + std::to_string(i / 20) +
            ";20000;" + std::to_string(i) + ";-40000;100\n";
  }
  write_text(folder / "table.csv", text);
}
void read_table(const fs::path& folder) {
  import_field_table((folder / "table.csv").string(), {}).map.for_each_node([](const Eigen::Vector4f&) {});
}

/// A message of a type defined in the log: the definition in one file, the bytes in the other.
void write_defined_message(const fs::path& folder) {
  write_text(folder / "definition",
             "std_msgs/Header header\nReading[] readings\nstring<=9 name \"none\"\nfloat32[3] rate\nuint8 A=1\n"
             "==========\nMSG: board_msgs/Reading\nuint16 raw\nfloat64[] field\n");
  std::string bytes(12, '\1');           // seq, stamp
  bytes += std::string("\1\0\0\0m", 5);  // frame
  bytes += std::string("\2\0\0\0", 4);   // readings
  for (int i = 0; i < 2; ++i) bytes += std::string("\7\0\3\0\0\0", 6) + std::string(24, '?');
  bytes += std::string("\2\0\0\0ab", 6) + std::string(12, '?');  // name, rate
  write_text(folder / "bytes", bytes);
}
void read_defined_message(const fs::path& folder) {
  TopicInfo topic;
  topic.name = "/board";
  topic.type = "board_msgs/Board";
  topic.definition = read_text_file((folder / "definition").string());
  const std::string text = read_text_file((folder / "bytes").string());
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  MessagePaths paths("log", topic);
  paths.add("readings[1].field", "magnetometers[0].values");
  paths.add("rate[0]", "imu.angular_velocity");
  std::vector<MessagePaths::Vector> vectors;
  paths.read({0, 0, bytes.data(), bytes.size()}, vectors);
}

void write_platform(const fs::path& folder) {
  save_platform(small_log().platform(), (folder / "platform.yaml").string());
}
void read_platform(const fs::path& folder) {
  load_platform((folder / "platform.yaml").string());
}

void write_world(const fs::path& folder) {
  const std::string world = read_text_file((fs::path(LODESTONE_SOURCE_DIR) / "config/worlds/corridor.yaml").string());
  // No shipped world has a section `reality`.
  write_text(folder / "world.yaml",
             world +
                 "\nreality:\n  grade: field\n  lidar_clock_offset_sigma_s: 0.003\n  mixed_points: true\n"
                 "  cloud_displacement_rms_m: 0.02\n  cloud_displacement_length_m: 20\n"
                 "  doubled_walls_share: 0.05\n  people: 2\n  noise_density_factor_max: 2\n");
}
void read_world(const fs::path& folder) {
  simulation::load_world((folder / "world.yaml").string());
}

void write_configuration(const fs::path& folder) {
  write_text(folder / "options.yaml",
             "smoother:\n  window_s: 3.0\n  solver: {condensed: false}\nlidar: {map: {voxel_m: [0.5, 1]}}\n");
}
void read_configuration(const fs::path& folder) {
  ConfigurationNode::load((folder / "options.yaml").string());
}

template <bool euroc>
void write_trajectory(const fs::path& folder) {
  std::string text = euroc ? "#timestamp [ns],x,y,z,qw,qx,qy,qz\n" : "# t x y z qx qy qz qw\n";
  for (int i = 0; i < 10; ++i) {
    text += euroc ? std::to_string(1'700'000'000'000'000'000 + i * 100'000'000) + ",1,2,3,1,0,0,0\n"
                  : std::to_string(1'700'000'000 + i) + ".5 1.5 -2e0 3 0 0 0 1\n";
  }
  write_text(folder / "truth", text);
}
void read_trajectory_file(const fs::path& folder) {
  read_trajectory((folder / "truth").string());
}

void write_kitti(const fs::path& folder) {
  write_text(folder / "truth", "1 0 0 1.5 0 1 0 -2e0 0 0 1 3\n0 -1 0 1 1 0 0 2 0 0 1 3\n");
  write_text(folder / "times", "0.0\n1.036224e-01\n");
}
void read_kitti_file(const fs::path& folder) {
  read_kitti((folder / "truth").string(), (folder / "times").string());
}

void write_split_bag(const fs::path& folder) {
  write_converted<LogFormat::db3, Codec::none>(folder);
  write_text(
      folder / "metadata.yaml",
      "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: sqlite3\n  relative_file_paths:\n    - log\n"
      "  compression_format: \"\"\n  compression_mode: \"\"\n");
}

}  // namespace

const std::vector<Boundary>& boundaries() {
  static const std::vector<Boundary> all{
      {"rosbag", "log", write_bag<Codec::none>, read_log_file},
      {"rosbag_lz4", "log", write_bag<Codec::lz4>, read_log_file},
      {"rosbag_bz2", "log", write_bag<Codec::bz2>, read_log_file},
      {"rosbag_cut", "log", write_cut_bag, read_log_file},
      {"mcap", "log", write_converted<LogFormat::mcap, Codec::none>, read_log_file},
      {"mcap_zstd", "log", write_converted<LogFormat::mcap, Codec::zstd>, read_log_file},
      {"mcap_lz4", "log", write_converted<LogFormat::mcap, Codec::lz4>, read_log_file},
      {"sqlite", "log", write_converted<LogFormat::db3, Codec::none>, read_log_file},
      {"sqlite_zstd", "log", write_converted<LogFormat::db3, Codec::zstd>, read_log_file},
      {"packed_log", "log", write_packed_log, read_log_file},
      {"bag_metadata", "metadata.yaml", write_split_bag, read_log_folder},
      {"csv", "imu.csv", write_csv_log, read_log_folder},
      {"csv_magnetometer", "magnetometers/left.csv", write_csv_magnetometer, read_log_folder},
      {"csv_cloud", "points/1700000000.25.pcd", write_cloud_of_log, read_log_folder},
      {"message_ros1", "message", write_message<Encoding::ros1>, read_message<Encoding::ros1>},
      {"message_cdr", "message", write_message<Encoding::cdr>, read_message<Encoding::cdr>},
      {"cloud_ascii", "cloud.pcd", write_ascii_cloud, read_cloud},
      {"cloud_binary", "cloud.pcd", write_binary_cloud, read_cloud},
      {"cloud_packed", "cloud.pcd", write_packed_cloud, read_cloud},
      {"cloud_ply_ascii", "cloud.ply", write_ascii_ply, read_cloud},
      {"cloud_ply_binary", "cloud.ply", write_binary_ply, read_cloud},
      {"cloud_las", "cloud.las", write_las, read_cloud},
      {"field_yaml", "field.yaml", write_field, read_field},
      {"field_raster", "field.tif", write_field, read_field},
      {"field_table", "table.csv", write_table, read_table},
      {"message_definition", "definition", write_defined_message, read_defined_message},
      {"defined_message", "bytes", write_defined_message, read_defined_message},
      {"transforms_ros1", "message", write_transforms<Encoding::ros1>, read_transforms_of_message<Encoding::ros1>},
      {"transforms_cdr", "message", write_transforms<Encoding::cdr>, read_transforms_of_message<Encoding::cdr>},
      {"platform", "platform.yaml", write_platform, read_platform},
      {"world", "world.yaml", write_world, read_world},
      {"configuration", "options.yaml", write_configuration, read_configuration},
      {"tum", "truth", write_trajectory<false>, read_trajectory_file},
      {"euroc", "truth", write_trajectory<true>, read_trajectory_file},
      {"kitti", "truth", write_kitti, read_kitti_file},
  };
  return all;
}

const Boundary& boundary(const std::string& name) {
  std::string known;
  for (const Boundary& one : boundaries()) {
    if (one.name == name) return one;
    known += " " + one.name;
  }
  throw std::invalid_argument("no boundary '" + name + "'; there are" + known);
}

}  // namespace lodestone::testing
