#include "tools/run/folder_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <sstream>
#include <string>

#include "core/error.h"

namespace lodestone {

namespace {

/// "process 1234", from the kernel's list of locks: "1: FLOCK ADVISORY WRITE 1234 08:01:5678 0 EOF".
std::string lock_owner(int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) == 0) {
    const std::string file = fmt::format("{:02x}:{:02x}:{}", major(status.st_dev), minor(status.st_dev), status.st_ino);
    std::ifstream locks("/proc/locks");
    for (std::string line; std::getline(locks, line);) {
      std::istringstream words(line);
      std::string number, kind, type, access, process, inode;
      words >> number >> kind >> type >> access >> process >> inode;
      if (kind == "FLOCK" && inode == file && process != "0") return "process " + process;
    }
  }
  return "another process";
}

}  // namespace

FolderLock::FolderLock(const std::filesystem::path& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) {
    descriptor_ = descriptor;
    return;
  }
  const bool taken = errno == EWOULDBLOCK;
  const std::string owner = taken ? lock_owner(descriptor) : "";
  ::close(descriptor);
  if (!taken) return;
  throw InputError(fmt::format("{}: {} writes its results there; wait until that run ends, or choose another folder",
                               folder.string(), owner));
}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace lodestone
