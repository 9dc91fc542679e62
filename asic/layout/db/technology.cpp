// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/technology.hpp"

#include <algorithm>

namespace meltstage::layout {

namespace {

template <typename Items>
int index_by_name(const Items& items, std::string_view name) {
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (items[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

}  // namespace

Nm Layer::spacing_for(Nm width_nm, Nm run_nm) const {
  Nm wanted = spacing;
  for (const SpacingRow& row : spacing_table) {
    if (width_nm < row.width) break;
    for (std::size_t i = 0; i < run_lengths.size() && run_nm >= run_lengths[i]; ++i)
      wanted = std::max(wanted, row.spacing[i]);
  }
  return wanted;
}

double AntennaRule::limit(double diffusion_um2) const {
  if (diffusion_um2 <= 0.0 || with_diffusion.empty()) return ratio;
  if (diffusion_um2 <= with_diffusion.front().first) return with_diffusion.front().second;
  for (std::size_t i = 1; i < with_diffusion.size(); ++i) {
    const auto [x0, y0] = with_diffusion[i - 1];
    const auto [x1, y1] = with_diffusion[i];
    if (diffusion_um2 <= x1) return y0 + (y1 - y0) * (diffusion_um2 - x0) / (x1 - x0);
  }
  return with_diffusion.back().second;
}

int Macro::find_pin(std::string_view pin) const { return index_by_name(pins, pin); }
int Technology::find_layer(std::string_view name) const { return index_by_name(layers, name); }
int Technology::find_via(std::string_view name) const { return index_by_name(vias, name); }
int Technology::find_via_rule(std::string_view name) const { return index_by_name(via_rules, name); }
int Technology::find_site(std::string_view name) const { return index_by_name(sites, name); }

int Technology::find_macro(std::string_view name) const {
  const auto found = macro_index.find(std::string(name));
  return found == macro_index.end() ? -1 : found->second;
}

std::vector<int> Technology::routing_layers() const {
  std::vector<int> found;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    if (layers[i].kind == LayerKind::routing) found.push_back(static_cast<int>(i));
  }
  return found;
}

}  // namespace meltstage::layout
