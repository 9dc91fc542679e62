// SPDX-License-Identifier: Apache-2.0
// What the handles are.
#pragma once

#include "bindings/c/meltstage.h"
#include "bindings/common/model_chip.hpp"
#include "motion/profile/retarget.hpp"
#include "motion/tour/path.hpp"
#include "tb/scenario/scripted_run.hpp"

struct ms_chip {
  meltstage::bindings::ModelChip model;
};

struct ms_run {
  meltstage::tb::ScriptedRun run;
};

struct ms_profile {
  meltstage::motion::JerkProfile profile;
  double from_mm = 0.0;
};

struct ms_tour {
  meltstage::motion::Plan plan;
};
