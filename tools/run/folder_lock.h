#pragma once

#include <filesystem>

namespace lodestone {

/// Locks a folder of results for this process, so that two runs cannot mix their files. The kernel releases the lock
/// when the process ends in any way. File systems without locks are not an error.
class FolderLock {
 public:
  /// Throws InputError, with the number of the other process if known, if another process has the lock. A missing
  /// folder is not locked.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

  bool locked() const { return descriptor_ >= 0; }

 private:
  int descriptor_ = -1;
};

}  // namespace lodestone
