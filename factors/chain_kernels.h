#pragma once

namespace lodestone {

// Small dense loops over row-major arrays, on plain doubles so that the compiler may pick the widest vectors of the
// machine: every output is summed in the same order whatever their width, so the bits do not depend on it.

/// c += sign · aᵀ b over `rows` rows. a: columns_a wide, b: columns_b wide (a multiple of 4); c: columns_a × columns_b.
/// The strides are in doubles. Zeros of a cost nothing.
void add_transposed_product(const double* a, int stride_a, int columns_a, const double* b, int stride_b, int columns_b,
                            int rows, double sign, double* c, int stride_c);

/// Cholesky on the rows of [D | rest], D the first `rows` columns: D = Rᵀ R, upper R in D's place, R⁻ᵀ rest in the
/// rest's. `columns` is a multiple of 4. False where D is not positive.
bool eliminate_rows(double* matrix, int stride, int rows, int columns);

}  // namespace lodestone
