#pragma once

#include <chrono>

#include "bindings/bindings.h"

namespace lodestone::python {

/// Lets Ctrl-C end a long call that has released the interpreter lock.
class Interrupts {
 public:
  /// Throws KeyboardInterrupt if a signal has come. Requests the interpreter lock at most ten times a second.
  void check() {
    const auto now = std::chrono::steady_clock::now();
    if (now < next_) return;
    next_ = now + std::chrono::milliseconds(100);
    const py::gil_scoped_acquire locked;
    throw_if_signalled();
  }

  /// The same with the lock held, at every call.
  static void throw_if_signalled() {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }

 private:
  std::chrono::steady_clock::time_point next_{};
};

}  // namespace lodestone::python
