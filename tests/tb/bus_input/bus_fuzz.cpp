// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: build/fuzz/tests/tb/bus_input/bus_fuzz CORPUS. docs/host/bus.md
#include "bus_inputs.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  meltstage::tb::drive({data, size});  // a Violation is not caught: libFuzzer keeps the input
  return 0;
}
