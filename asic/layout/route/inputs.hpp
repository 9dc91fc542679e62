// SPDX-License-Identifier: Apache-2.0
// What a router may be given.
#pragma once

#include "asic/layout/db/design.hpp"

namespace meltstage::layout {

/// Throws UserError with the place in the file when a net has wires already, as they would be lost, when a
/// cell lies over another or beside the sites of the rows (where there are rows), and when a layer of wires
/// or pins has no spacing.
void require_routable(const Design& design, const Technology& technology);

}  // namespace meltstage::layout
