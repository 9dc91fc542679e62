// SPDX-License-Identifier: Apache-2.0
#include "app/chip/saved_registers.hpp"

#include <fmt/format.h>

#include "cmodel/spec.hpp"
#include "tests/fuzz/entry.hpp"
#include "tests/fuzz/memory_file.hpp"

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  return meltstage::reads_or_refuses(data, size, [](std::string_view text) {
    // every file of another register map is refused at once
    const meltstage::MemoryFile file(
        fmt::format("map_crc = 0x{:04X}\n{}", meltstage::chip::spec::kMapCrc, text));
    meltstage::app::read_saved_registers(file.path());
  });
}
