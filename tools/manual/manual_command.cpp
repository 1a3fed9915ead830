#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "frontends/configuration/text_file.h"
#include "tools/commands.h"
#include "tools/manual/manual_pages.h"
#include "tools/writers/output_folder.h"

namespace lodestone {

void add_manual_command(CLI::App& app, const std::string& version) {
  CLI::App* command = app.add_subcommand("manual", "Write the manual page and the completion for bash");
  command->group("");  // for packages: hidden in the help
  const auto out = std::make_shared<std::string>();
  command->add_option("--out", *out, "folder for lodestone.1 and lodestone.bash")->required();
  command->callback([&app, version, out] {
    const std::filesystem::path folder = made_folder(*out);
    write_text_file(folder / "lodestone.1", man_page(app, version));
    write_text_file(folder / "lodestone.bash", bash_completion(app));
  });
}

}  // namespace lodestone
