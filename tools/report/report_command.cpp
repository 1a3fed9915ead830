#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "tools/command_files.h"
#include "tools/commands.h"
#include "tools/report/report.h"

namespace lodestone {

namespace {

constexpr const char* kReportExamples = R"(
Examples, with the files of `lodestone run ... --out /tmp/tunnel/run` (see lodestone run --help):
  lodestone report /tmp/tunnel/run
  lodestone report /tmp/tunnel/run --out /tmp/tunnel.html)";

struct ReportCall {
  std::string folder;
  std::string out;
};

}  // namespace

void add_report_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("report", "Write a report of a run as one HTML file that requires no network");
  command->footer(kReportExamples);
  const auto call = std::make_shared<ReportCall>();
  CommandFiles files(*command);
  files.input(command->add_option("DIR", call->folder, "--out folder of `lodestone run` or `lodestone reproduce`"))
      ->required();
  files.output(command->add_option("--out", call->out, "the file to write (default: DIR/report.html)"));
  command->callback([call] {
    const std::filesystem::path out =
        call->out.empty() ? std::filesystem::path(call->folder) / "report.html" : std::filesystem::path(call->out);
    const std::size_t size = write_report(call->folder, out);
    fmt::print("report: {} ({:.1f} MB)\n", out.string(), static_cast<double>(size) * 1e-6);
  });
}

}  // namespace lodestone
