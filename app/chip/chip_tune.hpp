// SPDX-License-Identifier: Apache-2.0
// `meltstage chip tune`: starts the chip's autotune and follows it to its end.
#pragma once

#include "host/controller.hpp"

namespace meltstage::app {

// Prints what was found and the gains that are now in force. Returns the exit status: 0 finished, 1 stopped,
// or left by Ctrl-C (the chip goes on; its host watchdog ends it).
int tune_chip(host::Controller& controller);

}  // namespace meltstage::app
