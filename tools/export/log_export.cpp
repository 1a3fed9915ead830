#include "tools/export/log_export.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "frontends/maps/point_cloud_file.h"
#include "frontends/messages/result_messages.h"
#include "tools/export/packed_cloud.h"

namespace lodestone {

namespace {

namespace fs = std::filesystem;

constexpr const char* kMapFrame = "map";

/// The topics of one estimator.
struct EstimatorTopics {
  std::string frame;
  TopicInfo path, odometry, stale_places;
};

/// A pose or a row of diagnostics.csv, not yet serialized.
struct ExportEvent {
  Time time = 0;
  std::size_t estimator = 0;
  bool is_pose = false;
  std::size_t index = 0;
};

std::vector<ExportEvent> events_of(const RunResults& run) {
  std::vector<ExportEvent> events;
  for (std::size_t estimator = 0; estimator < run.estimators.size(); ++estimator) {
    const EstimatorFiles& files = run.estimators[estimator].files;
    for (std::size_t i = 0; i < files.trajectory.size(); ++i) {
      events.push_back({files.trajectory[i].time, estimator, true, i});
    }
    for (std::size_t i = 0; i < files.diagnostics_times.size(); ++i) {
      events.push_back({files.diagnostics_times[i], estimator, false, i});
    }
  }
  std::stable_sort(events.begin(), events.end(),
                   [](const ExportEvent& a, const ExportEvent& b) { return a.time < b.time; });
  return events;
}

/// Rows of diagnostics.csv as statuses: health is the level, the reason is in the message, all columns are values.
class DiagnosticRows {
 public:
  DiagnosticRows(std::string name, const CsvTable& table) : name_(std::move(name)) {
    for (const std::string& column : table.columns()) {
      if (column != "t_s") columns_.emplace_back(column, table.texts(column));
    }
  }

  DiagnosticStatus status(std::size_t row) const {
    DiagnosticStatus status;
    status.name = "lodestone: " + name_;
    status.hardware_id = name_;
    std::string health, reason;
    for (const auto& [column, texts] : columns_) {
      status.values.emplace_back(column, texts[row]);
      if (column == "health") health = texts[row];
      if (column == "health_reason" && texts[row] != "none") reason = texts[row];
    }
    status.level = health == "good"   ? DiagnosticStatus::ok
                   : health == "lost" ? DiagnosticStatus::error
                                      : DiagnosticStatus::warn;
    status.message = health + (reason.empty() ? "" : ": " + reason);
    return status;
  }

 private:
  std::string name_;
  std::vector<std::pair<std::string, std::vector<std::string>>> columns_;
};

/// Centres of the cells of stale places; empty if the run had no field map.
PackedCloud stale_cells(const fs::path& folder) {
  PackedCloud cloud({"x", "y", "z", "difference_ut", "place"});
  if (!fs::exists(folder / "field_cells.csv")) return cloud;
  const CsvTable table(folder / "field_cells.csv");
  const std::vector<Vector3> centers_m = table.vectors("", "_m"), differences_ut = table.vectors("difference_", "_ut");
  const std::vector<double> place = table.numbers("place");
  for (std::size_t i = 0; i < table.rows(); ++i) {
    if (!(place[i] > 0.0)) continue;
    const Eigen::Vector3f center = centers_m[i].cast<float>();
    cloud.add({center.x(), center.y(), center.z(), static_cast<float>(differences_ut[i].norm()),
               static_cast<float>(place[i])});
  }
  return cloud;
}

/// The overview's cloud, which the run thinned to voxels.
PackedCloud overview_cloud(const fs::path& folder) {
  PackedCloud cloud({"x", "y", "z"});
  const fs::path path = folder / "overview" / "cloud.pcd";
  if (!fs::exists(path)) return cloud;
  WarningLog ignored;  // NaN points were already dropped for the overview
  for (const Eigen::Vector3f& point : read_point_cloud(path.string(), ignored)) {
    cloud.add({point.x(), point.y(), point.z()});
  }
  return cloud;
}

/// Writes serialized messages and counts them.
class MessageExport {
 public:
  MessageExport(LogWriter& writer, const std::function<void(Time)>& progress) : writer_(writer), progress_(progress) {}

  void write(const TopicInfo& topic, Time time, const std::vector<std::uint8_t>& bytes) {
    progress_(time);
    writer_.write(topic, {time, 0, bytes.data(), bytes.size()});
    ++messages_;
  }
  void write(const TopicInfo& topic, Time time, const PackedCloud& cloud) {
    if (!cloud.empty()) write(topic, time, cloud.message(time, kMapFrame));
  }
  void write(const TopicInfo& topic, Time time, const Trajectory& path) {
    if (!path.empty()) write(topic, time, path_message(time, kMapFrame, path));
  }
  std::int64_t messages() const { return messages_; }

 private:
  LogWriter& writer_;
  const std::function<void(Time)>& progress_;
  std::int64_t messages_ = 0;
};

}  // namespace

ExportedEstimator exported_names(const RunResults& run, std::size_t index) {
  std::string name = run.estimators[index].files.name;
  for (char& character : name) {
    if (std::isalnum(static_cast<unsigned char>(character)) == 0) character = '_';
  }
  return {index == 0 ? "imu" : name + "/imu", "/lodestone/" + name};
}

std::int64_t export_log(const RunResults& run, DeskewedScans* scans, LogWriter& writer,
                        const std::function<void(Time)>& progress) {
  const TopicInfo transforms = result_topic("/tf", "tf2_msgs/TFMessage");
  const TopicInfo diagnostics = result_topic("/diagnostics", "diagnostic_msgs/DiagnosticArray");
  const TopicInfo scan_topic = result_topic("/lodestone/scan", "sensor_msgs/PointCloud2");
  MessageExport out(writer, progress);
  out.write(result_topic("/lodestone/map", "sensor_msgs/PointCloud2"), run.begin, overview_cloud(run.folder));
  out.write(result_topic("/lodestone/truth", "nav_msgs/Path"), run.begin, run.truth);
  std::vector<EstimatorTopics> topics;
  std::vector<DiagnosticRows> rows;
  for (std::size_t i = 0; i < run.estimators.size(); ++i) {
    const EstimatorFiles& files = run.estimators[i].files;
    const ExportedEstimator names = exported_names(run, i);
    topics.push_back({names.frame, result_topic(names.prefix + "/path", "nav_msgs/Path"),
                      result_topic(names.prefix + "/odometry", "nav_msgs/Odometry"),
                      result_topic(names.prefix + "/stale_places", "sensor_msgs/PointCloud2")});
    rows.emplace_back(files.name, files.diagnostics);
    out.write(topics.back().path, run.begin, files.trajectory);
    out.write(topics.back().stale_places, run.begin, stale_cells(files.folder));
  }

  std::optional<DeskewedScan> scan = scans != nullptr ? scans->next() : std::nullopt;
  const auto write_scan = [&] {
    out.write(scan_topic, scan->end, scan->cloud);
    scan = scans->next();
  };
  for (const ExportEvent& event : events_of(run)) {
    while (scan && scan->end < event.time) write_scan();
    const EstimatorResults& results = run.estimators[event.estimator];
    if (!event.is_pose) {
      out.write(diagnostics, event.time, diagnostics_message(event.time, rows[event.estimator].status(event.index)));
      continue;
    }
    const EstimatorTopics& own = topics[event.estimator];
    const Pose& pose = results.files.trajectory[event.index].pose;
    const auto covariance = results.covariances.find(event.time);
    const RosCovariance values =
        covariance == results.covariances.end() ? RosCovariance{} : ros_covariance(pose, covariance->second);
    out.write(transforms, event.time, transform_message(event.time, kMapFrame, own.frame, pose));
    out.write(own.odometry, event.time, odometry_message(event.time, kMapFrame, own.frame, pose, values));
  }
  while (scan) write_scan();
  return out.messages();
}

}  // namespace lodestone
