// SPDX-License-Identifier: Apache-2.0
// What the programs of the layout share: the call, messages of one line, exit status.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace meltstage::layout {

/// Parses the call and carries it out. What goes wrong is one line on the standard error, begun by the
/// program's name. Returns the exit status: that of `run`, or 2 for wrong input or use and for an answer that
/// could not be told.
int layout_main(CLI::App& app, int argc, char** argv, const std::function<int()>& run);

}  // namespace meltstage::layout
