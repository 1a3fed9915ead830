#include "localization/read_ahead.h"

#include <utility>

#include "core/thread_limit.h"

namespace lodestone {

ReadAhead::Piece ReadAhead::read() {
  Piece piece;
  try {
    piece.any = read_(piece.bundle);
  } catch (...) {
    piece.error = std::current_exception();
  }
  piece.warnings = std::exchange(found_, {});
  return piece;
}

bool ReadAhead::next(ScanBundle& bundle) {
  Piece piece = ahead_.valid() ? ahead_.get() : read();
  warnings_.add(piece.warnings);
  if (piece.error) std::rethrow_exception(piece.error);
  if (!piece.any) return false;
  bundle = std::move(piece.bundle);
  if (usable_threads() > 1) ahead_ = std::async(std::launch::async, [this] { return read(); });
  return true;
}

}  // namespace lodestone
