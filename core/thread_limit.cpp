#include "core/thread_limit.h"

#include <dlfcn.h>
#include <tbb/global_control.h>

#include <optional>
#include <string_view>

#include "core/error.h"

namespace lodestone {

namespace {

/// A function of a library, if the process has loaded it. Debian's alternatives choose the BLAS at installation, so
/// that nothing is linked against one.
template <class Function>
Function* openblas_function(const char* name) {
  void* handle = dlopen("libopenblas.so.0", RTLD_LAZY | RTLD_NOLOAD);
  if (handle == nullptr) return nullptr;
  auto* function = reinterpret_cast<Function*>(dlsym(handle, name));
  dlclose(handle);
  return function;
}

}  // namespace

std::string blas_description() {
  // Computed once: OpenBLAS fills a buffer of its own.
  static const std::string description = [] {
    auto* config = openblas_function<char*()>("openblas_get_config");
    auto* core = openblas_function<char*()>("openblas_get_corename");
    if (config == nullptr || core == nullptr) return std::string();
    // "OpenBLAS 0.3.21 NO_LAPACKE DYNAMIC_ARCH ..."
    const std::string_view all = config();
    return std::string(all.substr(0, all.find(' ', all.find(' ') + 1))) + ", " + core();
  }();
  return description;
}

void limit_blas() {
  auto* config = openblas_function<char*()>("openblas_get_config");
  if (config != nullptr && std::string_view(config()).find("SINGLE_THREADED") != std::string_view::npos) {
    throw InputError(
        "BLAS: OpenBLAS is installed without threads (libopenblas0-serial); two threads that call it at once get wrong "
        "numbers; install libopenblas0-pthread, which is used with one thread a call");
  }
  if (auto* set = openblas_function<void(int)>("openblas_set_num_threads")) set(1);
}

int usable_threads() {
  return static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
}

struct ThreadLimit::Control {
  std::optional<tbb::global_control> limit;
};

ThreadLimit::ThreadLimit(int threads) : control_(std::make_unique<Control>()) {
  if (threads > 0) {
    control_->limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  }
  limit_blas();
}

ThreadLimit::~ThreadLimit() = default;

}  // namespace lodestone
