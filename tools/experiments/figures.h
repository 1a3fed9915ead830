#pragma once

#include "tools/experiments/reproduce_file.h"

namespace lodestone::reproduce {

/// Draws the experiment's figures of all finished runs into `root`/figures, each as PNG, PDF and SVG. Figures without a
/// finished run are omitted, and so are figures with a missing or broken file, after a warning. Throws InputError if
/// the folder cannot be made.
std::vector<DrawnFigure> draw_figures(const Experiment& experiment, const Results& results,
                                      const std::filesystem::path& root);

}  // namespace lodestone::reproduce
