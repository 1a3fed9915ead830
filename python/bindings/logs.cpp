#include <pybind11/stl.h>

#include <limits>

#include "bindings/bindings.h"
#include "bindings/interrupts.h"
#include "bindings/measurements.h"
#include "bindings/warning_list.h"
#include "frontends/logs/open_log.h"
#include "frontends/synchronizer/bag_source.h"

namespace lodestone::python {

namespace {

/// (name, type, messages, begin_ns, end_ns) of each topic.
py::list topics_of(const std::string& path) {
  WarningLog warnings;
  std::unique_ptr<MessageSource> source;
  {
    const py::gil_scoped_release unlocked;
    source = open_log(path, warnings);
  }
  py::list rows;
  for (const TopicInfo& topic : source->topics()) {
    rows.append(py::make_tuple(topic.name, topic.type, topic.messages, topic.begin, topic.end));
  }
  return rows;
}

/// Adds the measurements of a log that are complete from `begin_ns` on and before `end_ns`.
py::list read_log(Measurements& measurements, const std::string& path, const SensorChoice& sensors, Time begin_ns,
                  Time end_ns) {
  WarningLog warnings;
  std::vector<Measurement> read;
  {
    const py::gil_scoped_release unlocked;
    BagSource source(path, measurements.platform(), warnings, sensors);
    Interrupts interrupts;
    for (Measurement measurement; source.next(measurement);) {
      interrupts.check();
      const Time time = completion_time(measurement);
      if (time >= begin_ns && time < end_ns) read.push_back(std::move(measurement));
    }
  }
  for (Measurement& measurement : read) measurements.add(std::move(measurement));
  return list_of(warnings);
}

/// The scans of a log, one after the other. Only one is in memory.
class ScanReader {
 public:
  ScanReader(const std::string& path, const Platform& platform)
      : source_(path, platform, warnings_, {.lidar = true, .imu = false, .magnetometers = false, .wheels = false}) {}

  py::tuple next() {
    Measurement measurement;
    bool found = false;
    {
      const py::gil_scoped_release unlocked;
      found = source_.next(measurement);
    }
    if (!found) throw py::stop_iteration();
    return arrays_of(std::get<LidarScan>(measurement));
  }

 private:
  WarningLog warnings_;
  BagSource source_;
};

}  // namespace

void bind_logs(py::module_& module) {
  module.def("topics", &topics_of, py::arg("path"));
  module.def(
      "read_log",
      [](Measurements& measurements, const std::string& path, bool lidar, bool imu, bool magnetometers, bool wheels,
         std::optional<Time> begin_ns, std::optional<Time> end_ns) {
        return read_log(measurements, path, {lidar, imu, magnetometers, wheels},
                        begin_ns.value_or(std::numeric_limits<Time>::min()),
                        end_ns.value_or(std::numeric_limits<Time>::max()));
      },
      py::arg("measurements"), py::arg("path"), py::arg("lidar"), py::arg("imu"), py::arg("magnetometers"),
      py::arg("wheels"), py::arg("begin_ns"), py::arg("end_ns"));
  py::class_<ScanReader>(module, "ScanReader")
      .def(py::init<const std::string&, const Platform&>(), py::arg("path"), py::arg("platform"),
           py::call_guard<py::gil_scoped_release>())
      .def("__iter__", [](py::object& self) { return self; })
      .def("__next__", &ScanReader::next);
}

}  // namespace lodestone::python
