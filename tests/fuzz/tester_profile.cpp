// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/files/tester_profile.hpp"

#include "tests/fuzz/entry.hpp"
#include "tests/fuzz/memory_file.hpp"

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  return meltstage::reads_or_refuses(data, size, [](std::string_view text) {
    const meltstage::MemoryFile file(text);
    meltstage::dft::read_tester_profile(file.path());
  });
}
