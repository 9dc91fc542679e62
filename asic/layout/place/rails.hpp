// SPDX-License-Identifier: Apache-2.0
// The supplies along the edges of cells that stand in rows.
#pragma once

#include "asic/layout/db/design.hpp"

namespace meltstage::layout {

/// Rows are turned over in turns and cells abut, so the cells of a design have like rails at their edges, and
/// may be mirrored. Throws UserError, which names the two cells.
void require_like_rails(const Design& design, const Technology& technology);

}  // namespace meltstage::layout
