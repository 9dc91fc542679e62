// SPDX-License-Identifier: Apache-2.0
// The chip's model, a recording and the host's registers, from the installed parts.
#include <meltstage/cmodel/chip.hpp>
#include <meltstage/host/register_map.hpp>
#include <meltstage/recording/stream.hpp>

int main() {
  meltstage::chip::Chip chip;
  for (int clock = 0; clock < 100; ++clock) chip.step({});
  meltstage::recording::Stream stream;
  return meltstage::host::registers().empty() || stream.complete() ? 1 : 0;
}
