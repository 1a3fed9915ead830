#pragma once

#include <chrono>
#include <string>

#include "core/time.h"

namespace lodestone {

/// Called once, before a command begins. From now on SIGINT, SIGTERM and SIGHUP (unless it is ignored) only set a flag,
/// so that a long command can write its results so far and exit with code 130. A second signal ends the process at
/// once.
void catch_interrupts();

/// Whether a signal has arrived. Long loops poll this.
bool interrupt_requested();

/// Throws Interrupted after a signal: for loops and between steps, where there is nothing to save. Not between the
/// files of one result.
void throw_if_interrupted();

/// "m:ss" or "h:mm:ss".
std::string clock_text(double seconds);

/// A bar of `width` cells, of which `share` (0 to 1) are full.
std::string progress_bar(double share, int width);

/// One line of progress: a bar of `bar_width` cells (0: none), per cent, multiple of real time, time left.
std::string progress_line(const std::string& label, double share, double rate, double seconds_left, int bar_width);

/// Progress of a pass over a log: on a terminal a bar that is redrawn, elsewhere a message every few seconds. No output
/// with --quiet.
class Progress {
 public:
  /// Log times from `begin` to `end`; if they are equal, only the rate is reported.
  Progress(std::string label, Time begin, Time end);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// The log has been processed up to `now`. Cheap enough for every measurement.
  void update(Time now);

  /// The same, and throws Interrupted after a signal.
  void advance(Time now);

  /// Ends the line. The destructor calls it.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;
  void print(Time now, Clock::time_point wall);

  std::string label_;
  Time begin_;
  Time end_;
  bool terminal_;
  bool open_line_ = false;  ///< the current line contains a bar
  bool finished_ = false;
  Time last_ = 0;
  Clock::time_point start_;
  Clock::time_point next_print_;
};

}  // namespace lodestone
