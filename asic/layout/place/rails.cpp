// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/place/rails.hpp"

#include <fmt/format.h>

#include <optional>
#include <set>
#include <string>

#include "base/error.hpp"
#include "base/place.hpp"

namespace meltstage::layout {
namespace {

/// The supplies along a cell's lower and upper edge, by name.
struct Rails {
  std::string low, high;
  friend bool operator==(const Rails&, const Rails&) = default;
};

std::optional<Rails> rails_of(const Macro& macro) {
  Rails rails;
  for (const MacroPin& pin : macro.pins) {
    if (!is_supply(pin.use)) continue;
    for (const Shape& shape : pin.shapes) {
      if (shape.rect.width() < macro.width) continue;
      if (shape.rect.y0 <= 0) rails.low = pin.name;
      if (shape.rect.y1 >= macro.height) rails.high = pin.name;
    }
  }
  return rails.low.empty() || rails.high.empty() ? std::nullopt : std::optional(rails);
}

}  // namespace

void require_like_rails(const Design& design, const Technology& technology) {
  std::set<int> used;
  for (const Component& component : design.components) used.insert(component.macro);
  const Macro* first = nullptr;
  for (const int index : used) {
    const Macro& macro = technology.macros[static_cast<std::size_t>(index)];
    if (!macro.symmetric_x)
      throw UserError(fmt::format(
          "{}: MACRO {}: found SYMMETRY without X, expected it, as every second row is upside down",
          technology.files, shown(macro.name)));
    const std::optional<Rails> rails = rails_of(macro);
    if (!rails) continue;
    if (first == nullptr) first = &macro;
    if (const Rails expected = *rails_of(*first); *rails != expected)
      throw UserError(fmt::format(
          "{}: MACRO {}: found the rails {} below and {} above, expected {} and {} as MACRO {} has",
          technology.files, shown(macro.name), shown(rails->low), shown(rails->high), shown(expected.low),
          shown(expected.high), shown(first->name)));
  }
}

}  // namespace meltstage::layout
