#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>

namespace lodestone {

/// Throws InputError if a folder of results cannot be created or written, before a long computation. Creates nothing.
void check_folder(const std::filesystem::path& folder);

/// Creates the folder if it does not exist. Throws InputError if this fails.
std::filesystem::path made_folder(const std::filesystem::path& folder);

/// Creates the folder of a file that a command will write. Throws InputError if this fails.
void make_folder_of(const std::filesystem::path& file);

/// As made_folder, and deletes the content: results of an earlier call must not mix with new ones.
std::filesystem::path emptied_folder(const std::filesystem::path& folder);

/// Throws InputError if `option` names a folder, where a file will be written.
void refuse_folder(const std::string& out, const std::string& option = "--out");

/// The same, and throws InputError if a file that `option` names exists, or a file beside it with one of these endings,
/// and the user did not allow to replace it.
void refuse_to_replace(const std::string& out, bool force, std::initializer_list<const char*> endings = {},
                       const std::string& option = "--out");

/// `path` relative to `folder`; "." if both are equal, empty if `path` is not below `folder`. Neither needs to exist.
std::filesystem::path path_below(const std::string& path, const std::string& folder);

/// The path of a file that --out names; creates its folder. Throws InputError if the name has another ending.
std::filesystem::path output_with_ending(const std::string& out, const std::string& ending);
inline std::filesystem::path yaml_output(const std::string& out) {
  return output_with_ending(out, ".yaml");
}

}  // namespace lodestone
