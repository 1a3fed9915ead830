#pragma once

#include <filesystem>
#include <system_error>

namespace lodestone {

/// Removes an output folder that did not exist before, unless it contains results by the end of this object's life: a
/// refused call leaves nothing half-written.
class NewFolder {
 public:
  explicit NewFolder(std::filesystem::path path) : path_(std::move(path)) {
    std::error_code ignored;
    is_new_ = !std::filesystem::exists(path_, ignored);
  }
  ~NewFolder() {
    std::error_code ignored;
    if (is_new_ && !has_results()) std::filesystem::remove_all(path_, ignored);
  }
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

 private:
  /// Whether an estimator has written its summary.
  bool has_results() const {
    std::error_code ignored;
    for (const auto& entry : std::filesystem::directory_iterator(path_, ignored)) {
      if (std::filesystem::exists(entry.path() / "summary.json", ignored)) return true;
    }
    return false;
  }

  std::filesystem::path path_;
  bool is_new_ = false;
};

}  // namespace lodestone
