#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/error.h"
#include "core/nearest_name.h"
#include "frontends/logs/log_conversion.h"
#include "frontends/logs/open_log.h"
#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/progress.h"
#include "tools/writers/output_folder.h"

namespace lodestone {
namespace {

constexpr const char* examples = R"(
The log: a ROS 1 bag, a ROS 2 bag (.mcap, .db3, its folder), or a folder of CSV and PCD files. The content determines
the format. Messages with a known counterpart in ROS 1 and ROS 2 are converted (PointCloud2, Imu, MagneticField, Livox'
CustomMsg). Other messages can only be written to a format of the same ROS.

Examples, with the files of `lodestone simulate tunnel --out /tmp/tunnel`:
  lodestone convert /tmp/tunnel/log.bag --out /tmp/tunnel/log.mcap
  lodestone convert /tmp/tunnel/log.mcap --out /tmp/tunnel/log.db3 --compression zstd
  lodestone convert /tmp/tunnel/log.bag --from 10 --to 20 --out /tmp/tunnel/part.bag)";

struct ConvertCall {
  std::string log, out, format, compression;
  bool force = false;
  std::optional<double> from_s, to_s;  ///< after the log's first message
};

const std::map<std::string, LogFormat> formats{
    {"bag", LogFormat::rosbag}, {"mcap", LogFormat::mcap}, {"db3", LogFormat::db3}};
const std::map<std::string, Codec> codecs{
    {"none", Codec::none}, {"lz4", Codec::lz4}, {"zstd", Codec::zstd}, {"bz2", Codec::bz2}};

LogFormat format_of(const ConvertCall& call) {
  std::string name = call.format;
  if (name.empty()) name = std::filesystem::path(call.out).extension().string();
  if (!name.empty() && name.front() == '.') name.erase(0, 1);
  const auto found = formats.find(name);
  if (found == formats.end()) {
    throw InputError(fmt::format("{}: the ending '{}' names no format; expected {}; or set --format", call.out, name,
                                 join_names(formats, &std::map<std::string, LogFormat>::value_type::first)));
  }
  return found->second;
}

Codec codec_of(const ConvertCall& call, LogFormat format) {
  if (call.compression.empty()) {
    return format == LogFormat::mcap ? Codec::zstd : format == LogFormat::rosbag ? Codec::lz4 : Codec::none;
  }
  const Codec codec = codecs.at(call.compression);
  if (!can_pack(format, codec)) {
    std::vector<std::string> fitting;
    for (const auto& [name, known] : codecs) {
      if (can_pack(format, known)) fitting.push_back(name);
    }
    throw InputError(
        fmt::format("--compression: this format supports {}; found {}", join_names(fitting), call.compression));
  }
  return codec;
}

void check_part(const ConvertCall& call) {
  const auto is_time = [](double seconds) { return std::isfinite(seconds) && seconds >= 0.0; };
  if (call.from_s && !is_time(*call.from_s))
    throw InputError(fmt::format("--from: expected seconds, 0 or more, found {}", *call.from_s));
  if (call.to_s && !(is_time(*call.to_s) && *call.to_s > call.from_s.value_or(0.0))) {
    throw InputError(fmt::format("--to: expected seconds, more than --from, found {}", *call.to_s));
  }
}

/// The part of a log whose first message was recorded at `begin`.
LogPart part_of(const ConvertCall& call, Time begin, Time end) {
  LogPart part;
  if (call.from_s) part.from = begin + from_seconds(*call.from_s);
  if (call.to_s) part.to = begin + from_seconds(*call.to_s);
  if (call.from_s && part.from > end) {
    throw InputError(fmt::format("--from {} is after the log's end; {} lasts {:.3f} s", *call.from_s, call.log,
                                 to_seconds(end - begin)));
  }
  return part;
}

void convert(const ConvertCall& call) {
  check_part(call);
  const LogFormat format = format_of(call);
  const Codec codec = codec_of(call, format);
  refuse_to_replace(call.out, call.force);
  WarningLog warnings;
  const auto source = open_log(call.log, warnings);
  Time begin = 0, end = 0;
  bool any = false;
  for (const TopicInfo& topic : source->topics()) {
    if (topic.messages == 0) continue;
    begin = any ? std::min(begin, topic.begin) : topic.begin;
    end = any ? std::max(end, topic.end) : topic.end;
    any = true;
  }
  const LogPart part = part_of(call, begin, end);
  make_folder_of(call.out);
  const auto writer = make_log_writer(call.out, format, codec);
  Progress progress(std::filesystem::path(call.out).filename().string(), begin, end);
  const Conversion conversion = convert_log(
      call.log, *source, *writer, [&progress](Time time) { progress.advance(time); }, part);
  writer->close();
  progress.finish();
  fmt::print("{}: {} messages of {:.1f} s, {:.1f} MB\n", call.out, conversion.messages,
             to_seconds(std::min(end, part.to) - std::max(begin, part.from)),
             static_cast<double>(std::filesystem::file_size(call.out)) * 1e-6);
  if (conversion.latched > 0) {
    fmt::print("{} of these are latched messages from before --from; their record time is --from\n",
               conversion.latched);
  }
  for (const TopicInfo* topic : conversion.left_out) {
    fmt::print("not converted: {} ({} messages): {} has no known counterpart\n", topic->name, topic->messages,
               topic->type.empty() ? "its type" : topic->type);
  }
  for (const WarningLog* log : {&std::as_const(warnings), &conversion.warnings}) {
    for (const auto& [kind, entry] : log->entries())
      fmt::print("warning {} ({}): {}\n", kind, entry.count, entry.first_detail);
  }
}

}  // namespace

void add_convert_command(CLI::App& app) {
  const auto call = std::make_shared<ConvertCall>();
  CLI::App* command =
      app.add_subcommand("convert", "Write a log of any kind as a ROS 1 bag, an MCAP file or an SQLite bag");
  command->footer(examples);
  CommandFiles files(*command);
  files.input(command->add_option("LOG", call->log, "the log to read"))->required();
  files
      .output(command->add_option("--out", call->out,
                                  "the file to write; the ending determines the format: .bag, .mcap or .db3"))
      ->required();
  command->add_flag("--force", call->force, "replace the file if it exists");
  command->add_option("--format", call->format, "bag, mcap or db3 for any ending")
      ->check(CLI::IsMember({"bag", "mcap", "db3"}));
  command
      ->add_option(
          "--compression", call->compression,
          "none, lz4, zstd or bz2, if the format supports it (default: lz4 for bag, zstd for mcap, none for db3)")
      ->check(CLI::IsMember({"none", "lz4", "zstd", "bz2"}));
  command->add_option("--from", call->from_s,
                      "omit earlier messages except latched ones; seconds after the log's first message");
  command->add_option("--to", call->to_s, "omit messages from this time on; seconds after the log's first message");
  command->callback([call] { convert(*call); });
}

}  // namespace lodestone
