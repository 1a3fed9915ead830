#pragma once

#include <string>

#include "tools/plotting/drawing.h"

namespace lodestone {

/// The drawing as the bytes of a file. The same drawing gives the same bytes. Throw InputError where the drawing
/// library refuses (out of memory, too large a sheet).
std::string png_of(const Drawing& drawing);
std::string pdf_of(const Drawing& drawing);
std::string svg_of(const Drawing& drawing);

/// How far `text` advances when set in letters of `size`, in the unit of `size`.
double advance_of(const std::string& text, double size);

}  // namespace lodestone
