// SPDX-License-Identifier: Apache-2.0
// How each fault of the specification comes about: the registers, the sound world, and what breaks.
#pragma once

#include <array>
#include <functional>

#include "tb/lockstep/bench.hpp"

namespace meltstage::tb {

struct FaultScenario {
  spec::Fault fault;
  const char* name;
  Settings settings;                   // beside quick()
  bool heating;                        // Run is commanded before the break
  std::function<void(Bench&)> sound;   // world before the break
  std::function<void(Bench&)> broken;  // the break; it stands until mend
  std::function<void(Bench&)> mend;
  bool cause_stays;  // the cause outlives the heating, so that ClearFault is refused until it is mended
};

// One scenario a fault at least; several where a fault has several causes.
const std::vector<FaultScenario>& fault_scenarios();

}  // namespace meltstage::tb
