#include "tools/run/folder_lock.h"

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <optional>

#include "core/error.h"
#include "tests/tools/program_runner.h"

namespace lodestone {
namespace {

TEST(FolderLock, ASecondRunIntoTheFolderIsRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path out = folder / "out";
  std::filesystem::create_directory(out);
  std::ofstream(folder / "log.bag") << "no log";
  const std::string call =
      "run " + (folder / "log.bag").string() + " --platform absent.yaml --cloud absent.pcd --out " + out.string();
  std::optional<FolderLock> lock(std::in_place, out);
  ASSERT_TRUE(lock->locked());
  expect_refused(call, "writes its results there; wait until that run ends, or choose another folder");
  EXPECT_THROW(FolderLock{out}, InputError);
  EXPECT_TRUE(std::filesystem::is_empty(out));
  lock.reset();
  expect_refused(call, "absent.yaml");  // the next mistake of this call
}

TEST(FolderLock, EndsWithAKilledProcess) {
  const TemporaryFolder folder;
  int ready[2];
  ASSERT_EQ(pipe(ready), 0);
  const pid_t child = fork();
  if (child == 0) {
    const FolderLock lock(folder.path());
    const char byte = lock.locked() ? 1 : 0;
    if (write(ready[1], &byte, 1) == 1) pause();
    _exit(0);
  }
  char byte = 0;
  ASSERT_EQ(read(ready[0], &byte, 1), 1);
  EXPECT_EQ(byte, 1);
  EXPECT_THROW(FolderLock{folder.path()}, InputError);
  kill(child, SIGKILL);
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  EXPECT_TRUE(FolderLock(folder.path()).locked());
}

TEST(FolderLock, AMissingFolderIsNotLocked) {
  EXPECT_FALSE(FolderLock("/absent/folder").locked());
}

}  // namespace
}  // namespace lodestone
