#pragma once

#include "tools/experiments/reproduce_file.h"

namespace lodestone::reproduce {

/// Draws the experiment's figures from the runs that are done into `root`/figures, each as PNG, PDF and SVG. A figure
/// none of whose runs is done is left out; one for which a file is missing or broken too, and that is told in one line.
/// Throws InputError where the folder cannot be made.
std::vector<DrawnFigure> draw_figures(const Experiment& experiment, const Results& results,
                                      const std::filesystem::path& root);

}  // namespace lodestone::reproduce
