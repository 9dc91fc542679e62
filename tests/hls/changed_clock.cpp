// SPDX-License-Identifier: Apache-2.0
// One clock of a changed model, built into a library that `refutations` loads: whatever cmodel/ stands in the
// include path.
#include "cmodel/chip.hpp"

extern "C" {

void changed_step(meltstage::chip::Chip* chip, const meltstage::chip::Inputs* in,
                  meltstage::chip::Outputs* out) {
  chip->mem.refresh_params();
  *out = chip->step(*in);
}

void changed_outputs(const meltstage::chip::Chip* chip, const meltstage::chip::Inputs* in,
                     meltstage::chip::Outputs* out) {
  *out = chip->outputs(*in);
}
}
