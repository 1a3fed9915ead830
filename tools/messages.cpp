#include "tools/messages.h"

#include <fmt/format.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <vector>

#include "core/error.h"

namespace lodestone {

void open_messages(const MessageOptions& options) {
  const auto terminal = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  terminal->set_pattern("%v");
  terminal->set_level(options.quiet     ? spdlog::level::err
                      : options.verbose ? spdlog::level::debug
                                        : spdlog::level::info);
  std::vector<spdlog::sink_ptr> sinks{terminal};
  if (!options.log_file.empty()) {
    try {
      sinks.push_back(std::make_shared<spdlog::sinks::basic_file_sink_mt>(options.log_file, true));
    } catch (const spdlog::spdlog_ex&) {
      throw InputError("--log-file " + options.log_file + ": cannot be written; choose another file");
    }
    sinks.back()->set_pattern("%Y-%m-%dT%H:%M:%S.%e %l %v");
    sinks.back()->set_level(spdlog::level::debug);
  }
  const auto logger = std::make_shared<spdlog::logger>("lodestone", sinks.begin(), sinks.end());
  logger->set_level(options.verbose || sinks.size() > 1 ? spdlog::level::debug : terminal->level());
  logger->flush_on(spdlog::level::debug);
  spdlog::set_default_logger(logger);
}

void print_warnings(const WarningLog& warnings) {
  for (const auto& [kind, entry] : warnings.entries()) {
    fmt::print("warning: {} ({} times): {}\n", kind, entry.count, entry.first_detail);
  }
}

}  // namespace lodestone
