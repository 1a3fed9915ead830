#include "tools/sinks/output_file.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>
#include <utility>

#include "core/error.h"

namespace lodestone {

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  aside_ = path_;
  aside_ += fmt::format(".partial-{}", getpid());
  file_ = std::fopen(aside_.c_str(), "wb");
  if (file_ == nullptr) {
    throw InputError(fmt::format("{}: cannot be written: {}; choose another --out", path_.string(), std::strerror(errno)));
  }
}

OutputFile::~OutputFile() {
  if (file_ == nullptr) return;
  std::fclose(file_);
  std::error_code ignored;
  std::filesystem::remove(aside_, ignored);
}

void OutputFile::write(std::string_view text) { std::fwrite(text.data(), 1, text.size(), file_); }

void OutputFile::commit() {
  const bool broken = std::ferror(file_) != 0;
  const bool closed = std::fclose(std::exchange(file_, nullptr)) == 0;
  std::error_code error;
  if (!broken && closed) std::filesystem::rename(aside_, path_, error);
  if (broken || !closed || error) {
    std::error_code ignored;
    std::filesystem::remove(aside_, ignored);
    throw InputError(fmt::format("{}: not written whole: {}; make room or choose another --out", path_.string(),
                                 error ? error.message() : std::strerror(errno)));
  }
}

}  // namespace lodestone
