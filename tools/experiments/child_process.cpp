#include "tools/experiments/child_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "core/error.h"

namespace lodestone::reproduce {

namespace {

constexpr int kProgress = 3;  // the descriptor that tools/fleet/experiment_progress.py writes to

}  // namespace

ChildProcess::ChildProcess(const std::string& program, const std::vector<std::string>& arguments,
                           const std::string& folder, const std::string& log, bool tells) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (tells) {
    posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, kProgress);
  } else {
    posix_spawn_file_actions_addopen(&actions, kProgress, "/dev/null", O_WRONLY, 0);
  }
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  std::string name = program;
  std::vector<std::string> words = arguments;
  std::vector<char*> pointers{name.data()};
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const int error = posix_spawnp(&process_, program.c_str(), &actions, &attributes, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error != 0) {
    process_ = -1;
    throw InputError(
        fmt::format("{0}: cannot be started: {1}; install Debian's package {0}, or see whether {2} can be "
                    "written",
                    program, std::strerror(error), log));
  }
}

ChildProcess::~ChildProcess() {
  if (process_ < 0 || code_) return;
  kill(-process_, SIGKILL);
  waitpid(process_, nullptr, 0);
}

std::optional<int> ChildProcess::poll() {
  int status = 0;
  if (!code_ && waitpid(process_, &status, WNOHANG) == process_) {
    code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  return code_;
}

void ChildProcess::interrupt(bool group) {
  if (!code_) kill(group ? -process_ : process_, SIGINT);
}

void ChildProcess::end_group() {
  constexpr int kPauses = 500;
  constexpr auto kPause = std::chrono::milliseconds(20);
  if (kill(-process_, SIGINT) != 0) return;  // nothing is left
  for (int i = 0; i < kPauses && kill(-process_, 0) == 0; ++i) std::this_thread::sleep_for(kPause);
  kill(-process_, SIGKILL);
}

}  // namespace lodestone::reproduce
