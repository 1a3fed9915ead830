#include "factors/chain_kernels.h"

#include <cmath>

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define LODESTONE_WIDEST __attribute__((target_clones("avx2", "default")))
#else
#define LODESTONE_WIDEST
#endif

namespace lodestone {

namespace {

/// Four doubles anywhere in memory. Written out because the compiler unrolls the loops below before it would vectorize
/// them.
typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));

inline const Four& four(const double* from) {
  return *reinterpret_cast<const Four*>(from);
}
inline Four& four(double* from) {
  return *reinterpret_cast<Four*>(from);
}

template <int fours>
[[gnu::always_inline]] inline void add_strip(const double* a, int stride_a, int columns_a, const double* b,
                                             int stride_b, int rows, double sign, double* c, int stride_c) {
  for (int i = 0; i < columns_a; ++i) {
    Four sum[fours] = {};
    for (int k = 0; k < rows; ++k) {
      const double factor = a[k * stride_a + i];
      if (factor == 0.0) continue;
      const double* row = b + k * stride_b;
      for (int j = 0; j < fours; ++j) sum[j] += factor * four(row + 4 * j);
    }
    for (int j = 0; j < fours; ++j) four(c + i * stride_c + 4 * j) += sign * sum[j];
  }
}

}  // namespace

LODESTONE_WIDEST
void add_transposed_product(const double* a, int stride_a, int columns_a, const double* b, int stride_b, int columns_b,
                            int rows, double sign, double* c, int stride_c) {
  int j = 0;
  for (; j + 16 <= columns_b; j += 16)
    add_strip<4>(a, stride_a, columns_a, b + j, stride_b, rows, sign, c + j, stride_c);
  for (; j < columns_b; j += 4) add_strip<1>(a, stride_a, columns_a, b + j, stride_b, rows, sign, c + j, stride_c);
}

LODESTONE_WIDEST
bool eliminate_rows(double* matrix, int stride, int rows, int columns) {
  for (int i = 0; i < rows; ++i) {
    double* pivot_row = matrix + i * stride;
    if (!(pivot_row[i] > 0.0)) return false;
    const double scale = 1.0 / std::sqrt(pivot_row[i]);
    for (int j = i / 4 * 4; j < columns; j += 4) four(pivot_row + j) *= scale;
    for (int k = i + 1; k < rows; ++k) {
      const double factor = pivot_row[k];
      double* row = matrix + k * stride;
      for (int j = k / 4 * 4; j < columns; j += 4) four(row + j) -= factor * four(pivot_row + j);
    }
  }
  return true;
}

}  // namespace lodestone
