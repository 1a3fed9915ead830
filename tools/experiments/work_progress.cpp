#include "tools/experiments/work_progress.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cmath>

#include "tools/progress.h"

namespace lodestone::reproduce {

namespace {

/// Columns of the terminal; 0 if unknown.
std::size_t line_width(std::FILE* stream) {
  winsize size{};
  return ioctl(fileno(stream), TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

}  // namespace

WorkProgress::WorkProgress(std::FILE* stream)
    : stream_(stream), terminal_(isatty(fileno(stream)) == 1 && spdlog::should_log(spdlog::level::info)) {}

WorkProgress::~WorkProgress() {
  finish();
}

void WorkProgress::update(const WorkShare& work) {
  const Clock::time_point now = Clock::now();
  if (!terminal_ || now < next_) return;
  next_ = now + std::chrono::milliseconds(250);
  const double hours = std::chrono::duration<double>(now - start_).count() / 3600.0;
  const double rate = hours > 0.0 ? static_cast<double>(work.done) / hours : 0.0;
  const std::string plain =
      fmt::format("  {:3.0f} %  {} of {} steps, {:.0f} an hour  {} left  ", std::floor(100.0 * work.share), work.done,
                  work.total, rate, clock_text(work.seconds_left));
  constexpr std::size_t bar = 20;
  const std::size_t width = line_width(stream_);
  std::string active = work.active;
  // A wrapped line cannot be redrawn.
  if (width > 0)
    active.resize(std::min(active.size(), width > plain.size() + bar + 1 ? width - plain.size() - bar - 1 : 0));
  std::fprintf(stream_, "\r\033[K%s%s%s", progress_bar(work.share, bar).c_str(), plain.c_str(), active.c_str());
  std::fflush(stream_);
  open_line_ = true;
}

void WorkProgress::tell(const WorkShare& work, const std::string& text) {
  finish();
  spdlog::info("[{}/{}] {}{}", work.done, work.total, text,
               work.done < work.total ? fmt::format("; {} left", clock_text(work.seconds_left)) : "");
  next_ = Clock::now();
}

void WorkProgress::finish() {
  if (!open_line_) return;
  std::fputs("\r\033[K", stream_);
  std::fflush(stream_);
  open_line_ = false;
}

}  // namespace lodestone::reproduce
