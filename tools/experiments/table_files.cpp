#include "tools/experiments/table_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "frontends/configuration/text_file.h"

namespace lodestone::reproduce {

namespace {

std::string replaced(const std::string& text, const auto& replacements) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const auto found = std::find_if(replacements.begin(), replacements.end(), [&](const auto& replacement) {
      return std::string_view(text).substr(at).starts_with(replacement.first);
    });
    if (found == replacements.end()) {
      result += text[at++];
    } else {
      result += found->second;
      at += found->first.size();
    }
  }
  return result;
}

using Replacement = std::pair<std::string_view, std::string_view>;

std::string markdown_text(const std::string& text) {
  constexpr std::array<Replacement, 2> kReplacements{{{"|", "\\|"}, {"\n", " "}}};
  return replaced(text, kReplacements);
}

std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  constexpr std::array<Replacement, 1> kReplacements{{{"\"", "\"\""}}};
  return fmt::format("\"{}\"", replaced(text, kReplacements));
}

std::string latex_text(const std::string& text) {
  constexpr std::array<Replacement, 18> kReplacements{{{"\\", "\\textbackslash{}"},
                                                       {"&", "\\&"},
                                                       {"%", "\\%"},
                                                       {"$", "\\$"},
                                                       {"#", "\\#"},
                                                       {"_", "\\_"},
                                                       {"{", "\\{"},
                                                       {"}", "\\}"},
                                                       {"~", "\\textasciitilde{}"},
                                                       {"^", "\\textasciicircum{}"},
                                                       {"µ", "$\\mu$"},
                                                       {"≤", "$\\le$"},
                                                       {"≥", "$\\ge$"},
                                                       {"×", "$\\times$"},
                                                       {"°", "$^\\circ$"},
                                                       {"–", "--"},
                                                       {"…", "\\dots{}"},
                                                       {"\n", " "}}};
  return replaced(text, kReplacements);
}

std::string line_of(const std::vector<std::string>& cells, const char* begin, const char* between, const char* end,
                    std::string (*text)(const std::string&)) {
  std::string line = begin;
  for (std::size_t i = 0; i < cells.size(); ++i) line += (i > 0 ? between : "") + text(cells[i]);
  return line + end;
}

}  // namespace

std::string to_markdown(const ResultTable& table) {
  std::string text = "### " + markdown_text(table.title) + "\n\n";
  text += line_of(table.header, "| ", " | ", " |\n", markdown_text) + "|";
  for (std::size_t i = 0; i < table.header.size(); ++i) text += "---|";
  text += "\n";
  for (const auto& row : table.rows) text += line_of(row, "| ", " | ", " |\n", markdown_text);
  if (!table.note.empty()) text += "\n" + table.note + "\n";
  return text;
}

std::string to_csv(const ResultTable& table) {
  std::string text = line_of(table.header, "", ",", "\n", csv_text);
  for (const auto& row : table.rows) text += line_of(row, "", ",", "\n", csv_text);
  return text;
}

std::string to_latex(const ResultTable& table) {
  std::string text = "\\begin{table}\n  \\centering\n  \\caption{" + latex_text(table.title) + "}\n  \\begin{tabular}{";
  for (std::size_t i = 0; i < table.header.size(); ++i) text += i == 0 ? 'l' : 'r';
  text += "}\n    \\hline\n";
  text += line_of(table.header, "    ", " & ", " \\\\\n", latex_text) + "    \\hline\n";
  for (const auto& row : table.rows) text += line_of(row, "    ", " & ", " \\\\\n", latex_text);
  text += "    \\hline\n  \\end{tabular}\n";
  if (!table.note.empty()) text += "  \\par\\smallskip " + latex_text(table.note) + "\n";
  return text + "\\end{table}\n";
}

void write_table(const std::filesystem::path& folder, const ResultTable& table) {
  write_text_file(folder / (table.name + ".md"), to_markdown(table));
  write_text_file(folder / (table.name + ".csv"), to_csv(table));
  write_text_file(folder / (table.name + ".tex"), to_latex(table));
}

}  // namespace lodestone::reproduce
