#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace lodestone::reproduce {

/// A child process whose standard output and error are appended to a file. The destructor kills a running child.
class ChildProcess {
 public:
  /// Starts `program` with `arguments` in `folder`. Throws InputError if the program cannot be started.
  ChildProcess(const std::string& program, const std::vector<std::string>& arguments, const std::string& folder,
               const std::string& log);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Its exit code, or 128 + N if signal N ended it; nothing while it runs. Does not wait.
  std::optional<int> poll();

  /// Sends SIGINT: the program's commands then write their results so far and exit.
  void interrupt();

 private:
  pid_t process_ = -1;
  std::optional<int> code_;
};

}  // namespace lodestone::reproduce
