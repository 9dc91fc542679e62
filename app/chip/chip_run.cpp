// SPDX-License-Identifier: Apache-2.0
#include "app/chip/chip_run.hpp"

#include <fmt/format.h>

#include <string>

#include "app/chip/latched_fault.hpp"

namespace meltstage::app {

void run_chip(host::Controller& controller) {
  try {
    controller.run();
  } catch (const host::BusError& refused) {
    std::string sentence;
    try {
      sentence = latched_fault(controller);
    } catch (const host::BusError&) {  // it does not answer either: the first error says why
    }
    if (sentence.empty()) throw;
    throw host::BusError(fmt::format("{}; {}", refused.what(), sentence));
  }
}

}  // namespace meltstage::app
