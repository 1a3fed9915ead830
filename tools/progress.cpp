#include "tools/progress.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <utility>

#include "core/error.h"

namespace lodestone {

namespace {

std::atomic<bool> interrupted{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only touch lock-free atomics");

extern "C" void note_interrupt(int) {
  interrupted.store(true);
}

}  // namespace

std::string clock_text(double seconds) {
  const auto whole = static_cast<long>(std::lround(seconds));
  if (whole >= 3600) return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

std::string progress_bar(double share, int width) {
  const int filled = static_cast<int>(std::clamp(share, 0.0, 1.0) * width);
  std::string bar;
  for (int i = 0; i < width; ++i) bar += i < filled ? "█" : "░";
  return bar;
}

void catch_interrupts() {
  struct sigaction action {};
  action.sa_handler = note_interrupt;
  sigemptyset(&action.sa_mask);
  // The default handler is restored by the first signal: a second one ends a command that does not poll.
  action.sa_flags = SA_RESETHAND | SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  // A closed terminal, but not under nohup.
  struct sigaction present {};
  sigaction(SIGHUP, nullptr, &present);
  if (present.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
}

bool interrupt_requested() {
  return interrupted.load(std::memory_order_relaxed);
}

void throw_if_interrupted() {
  if (interrupt_requested()) throw Interrupted();
}

std::string progress_line(const std::string& label, double share, double rate, double seconds_left, int bar_width) {
  share = std::clamp(share, 0.0, 1.0);
  std::string line = label + "  ";
  if (bar_width > 0) line += progress_bar(share, bar_width) + "  ";
  line += fmt::format("{:3.0f} %  {:.1f} x real time", std::floor(100.0 * share), rate);
  if (std::isfinite(seconds_left) && seconds_left >= 0.0) line += "  " + clock_text(seconds_left) + " left";
  return line;
}

Progress::Progress(std::string label, Time begin, Time end)
    : label_(std::move(label)),
      begin_(begin),
      end_(end),
      terminal_(isatty(STDERR_FILENO) == 1 && spdlog::should_log(spdlog::level::info)),
      last_(begin),
      start_(Clock::now()),
      next_print_(start_ + (terminal_ ? std::chrono::milliseconds(200) : std::chrono::seconds(5))) {}

Progress::~Progress() {
  finish();
}

void Progress::update(Time now) {
  last_ = std::max(last_, now);
  const Clock::time_point wall = Clock::now();
  if (wall < next_print_) return;
  print(last_, wall);
  next_print_ = wall + (terminal_ ? std::chrono::milliseconds(100) : std::chrono::seconds(5));
}

void Progress::advance(Time now) {
  update(now);
  throw_if_interrupted();
}

void Progress::finish() {
  if (finished_) return;
  finished_ = true;
  if (!open_line_) return;
  print(last_, Clock::now());
  std::fputc('\n', stderr);
}

void Progress::print(Time now, Clock::time_point wall) {
  const double elapsed = std::chrono::duration<double>(wall - start_).count();
  const double done = to_seconds(now - begin_);
  const double total = to_seconds(end_ - begin_);
  const double rate = elapsed > 0.0 ? done / elapsed : 0.0;
  const double left = rate > 0.0 ? (total - done) / rate : std::nan("");
  const std::string line = total > 0.0 ? progress_line(label_, done / total, rate, left, terminal_ ? 30 : 0)
                                       : fmt::format("{}  {:.1f} s of the log  {:.1f} x real time", label_, done, rate);
  if (!terminal_) return spdlog::info(line);
  open_line_ = true;
  std::fprintf(stderr, "\r\033[K%s", line.c_str());
}

}  // namespace lodestone
