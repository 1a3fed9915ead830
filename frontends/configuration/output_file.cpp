#include "frontends/configuration/output_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "frontends/configuration/aside.h"

namespace lodestone {

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)), aside_(aside_name(path_.string())) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path_, ignored)) {
    throw InputError(path_.string() + ": is a folder; expected the name of a file");
  }
  file_ = std::fopen(aside_.c_str(), "wb");
  if (file_ == nullptr) {
    throw InputError(
        fmt::format("{}: cannot be written: {}; choose another path", path_.string(), std::strerror(errno)));
  }
}

OutputFile::~OutputFile() {
  if (file_ != nullptr) std::fclose(file_);
  std::error_code ignored;
  if (!aside_.empty()) std::filesystem::remove(aside_, ignored);
}

void OutputFile::fail(const std::string& reason) {
  throw InputError(fmt::format("{}: cannot be written completely: {}; free disk space or choose another path",
                               path_.string(), reason));
}

void OutputFile::write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) fail(std::strerror(errno));
}

void OutputFile::write(std::span<const std::uint8_t> bytes) {
  write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

void OutputFile::rewrite(long offset, std::string_view bytes) {
  if (std::fseek(file_, offset, SEEK_SET) != 0) fail(std::strerror(errno));
  write(bytes);
}

void OutputFile::commit() {
  const bool broken = std::ferror(file_) != 0;
  if (std::fclose(std::exchange(file_, nullptr)) != 0 || broken) fail(std::strerror(errno));
  std::error_code error;
  std::filesystem::rename(aside_, path_, error);
  if (error) fail(error.message());
  aside_.clear();
}

}  // namespace lodestone
