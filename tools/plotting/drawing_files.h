#pragma once

#include <string>

#include "tools/plotting/drawing.h"

namespace lodestone {

/// The drawing as the bytes of a file. The same drawing gives the same bytes. Throw InputError if the drawing library
/// fails (out of memory, sheet too large).
std::string png_of(const Drawing& drawing);
std::string pdf_of(const Drawing& drawing);
std::string svg_of(const Drawing& drawing);

/// The advance width of `text` in letters of `size`, in the unit of `size`.
double advance_of(const std::string& text, double size);

}  // namespace lodestone
