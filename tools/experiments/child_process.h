#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace lodestone::reproduce {

/// A child process, leader of a process group, whose standard output and error go to a file. The destructor kills a
/// running group.
class ChildProcess {
 public:
  /// Starts `program`, which is searched in PATH, with `arguments` in `folder`. Descriptor 3 of the child is this
  /// program's standard error if `tells`, else /dev/null. Throws InputError if the program cannot be started.
  ChildProcess(const std::string& program, const std::vector<std::string>& arguments, const std::string& folder,
               const std::string& log, bool tells);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Its exit code, or 128 + N if signal N ended it; nothing while it runs. Does not wait.
  std::optional<int> poll();

  /// Sends SIGINT to the process, or to its whole group.
  void interrupt(bool group);

  /// Ends what the process has left of its group: SIGINT, then SIGKILL after ten seconds. Waits.
  void end_group();

 private:
  pid_t process_ = -1;
  std::optional<int> code_;
};

}  // namespace lodestone::reproduce
