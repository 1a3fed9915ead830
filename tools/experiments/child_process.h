#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace lodestone::reproduce {

/// A child process whose standard output and error go to the end of a file. Destroyed while it runs it is killed.
class ChildProcess {
 public:
  /// Starts `program` with `arguments` in `folder`. Throws InputError where that fails.
  ChildProcess(const std::string& program, const std::vector<std::string>& arguments, const std::string& folder,
               const std::string& log);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Its exit code once it has ended, 128 + N where signal N ended it; nothing while it runs. Does not wait.
  std::optional<int> poll();

  /// Sends SIGINT, on which the program's commands write what they have and end.
  void interrupt();

 private:
  pid_t process_ = -1;
  std::optional<int> code_;
};

}  // namespace lodestone::reproduce
