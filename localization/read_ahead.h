#pragma once

#include <exception>
#include <functional>
#include <future>
#include <utility>

#include "core/measurements.h"
#include "core/warnings.h"

namespace lodestone {

/// Reads a log one bundle ahead, on a thread of its own, while the caller works on the bundle before. With one thread
/// (ThreadLimit) each bundle is read when it is asked for. The caller gets the same bundles, warnings and exceptions at
/// the same calls either way.
class ReadAhead {
 public:
  /// `read`: gives the next bundle and adds to `found` what it warns of; false at the end of the log. Each `next` moves
  /// from `found` to `warnings` what belongs to its bundle. Both must outlive this.
  ReadAhead(std::function<bool(ScanBundle&)> read, WarningLog& found, WarningLog& warnings)
      : read_(std::move(read)), found_(found), warnings_(warnings) {}

  /// The next bundle; false at the end of the log. Rethrows the exceptions of `read`.
  bool next(ScanBundle& bundle);

 private:
  struct Piece {
    bool any = false;
    ScanBundle bundle;
    WarningLog warnings;
    std::exception_ptr error;
  };
  Piece read();

  std::function<bool(ScanBundle&)> read_;
  WarningLog& found_;
  WarningLog& warnings_;
  std::future<Piece> ahead_;  // its destructor waits for the thread
};

}  // namespace lodestone
