// SPDX-License-Identifier: Apache-2.0
// Inside the motion room: where the copper of a Gerber aperture macro lies.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string_view>

namespace meltstage::motion::detail {

/// In the units of the file, about the point at which the aperture is flashed.
struct MacroCopper {
  bool any = false;
  double x = 0.0, y = 0.0;  ///< the middle of all that is dark: of its extent in x and in y
  bool on_middle = false;   ///< there is copper in the middle, with what is cleared taken away
  bool on_origin = false;
};

/// Says in one message what is wrong with a macro, and doesn't return.
using MacroDefect = std::function<void(std::string_view found, std::string_view expected)>;

/// Works out the blocks of a macro (behind its name, each with its '*') for an aperture's parameters $1, $2
/// ... `steps` counts what has been worked out over all apertures of a file; too much of it is a defect.
MacroCopper copper_of_macro(std::string_view blocks, std::span<const double> parameters, std::size_t& steps,
                            const MacroDefect& defect);

}  // namespace meltstage::motion::detail
