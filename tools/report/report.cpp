#include "tools/report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>

#include "core/error.h"
#include "frontends/configuration/text_file.h"
#include "tools/markup.h"
#include "tools/progress.h"
#include "tools/report/page_data.h"
#include "tools/report/page_template.h"
#include "tools/report/reproduce_data.h"
#include "tools/report/run_data.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

namespace {

using Json = nlohmann::ordered_json;

std::string page(std::string_view title, const Json& data) {
  constexpr std::string_view kTitle = "@TITLE@";
  constexpr std::string_view kData = "@DATA@";
  const std::size_t title_at = kPageTemplate.find(kTitle);
  const std::size_t data_at = kPageTemplate.find(kData);
  std::string text(kPageTemplate.substr(0, title_at));
  text += escape_html(title);
  text += kPageTemplate.substr(title_at + kTitle.size(), data_at - title_at - kTitle.size());
  text += escape_script(data);
  text += kPageTemplate.substr(data_at + kData.size());
  return text;
}

/// The folder's name with its parent: "run" alone is not specific.
std::string name_of(const std::filesystem::path& folder) {
  std::filesystem::path path = std::filesystem::weakly_canonical(folder);
  if (path.filename().empty()) path = path.parent_path();
  const std::string parent = path.parent_path().filename().string();
  return parent.empty() ? path.filename().string() : parent + "/" + path.filename().string();
}

/// Only an HTML page may be overwritten: --out run/summary.json would destroy the report's input.
void require_replaceable_page(const std::filesystem::path& out) {
  if (!std::filesystem::is_regular_file(out)) return;
  constexpr std::string_view kBegin = "<!doctype html>";
  std::string begin(kBegin.size(), ' ');
  std::ifstream(out, std::ios::binary).read(begin.data(), static_cast<std::streamsize>(begin.size()));
  std::transform(begin.begin(), begin.end(), begin.begin(), [](unsigned char letter) { return std::tolower(letter); });
  if (std::filesystem::file_size(out) == 0 || begin == kBegin) return;
  throw InputError(out.string() +
                   ": this file is not an HTML page, and the report would overwrite it; choose another --out");
}

}  // namespace

std::size_t write_report(const std::filesystem::path& folder, const std::filesystem::path& out) {
  require_replaceable_page(out);
  if (!std::filesystem::is_directory(folder)) {
    throw InputError(
        fmt::format("{}: there is no such folder; use the --out folder of `lodestone run` or `lodestone reproduce`",
                    folder.string()));
  }
  Json data;
  data["version"] = LODESTONE_VERSION;
  data["folder"] = name_of(folder);
  if (is_reproduce_folder(folder)) {
    data["reproduce"] = read_reproduce(folder);
  } else if (is_run_folder(folder)) {
    data["run"] = read_run(folder, {});
  } else {
    throw InputError(
        fmt::format("{}: the folder has neither summary.json nor reproduce.json; use the folder of "
                    "--out of `lodestone run` or `lodestone reproduce`",
                    folder.string()));
  }
  const std::string text = page("Lodestone report: " + name_of(folder), data);
  throw_if_interrupted();
  make_folder_of(out);
  write_text_file(out, text);
  return text.size();
}

}  // namespace lodestone
