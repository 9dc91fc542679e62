// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/core/bench_file.hpp"

#include "asic/dft/core/faults.hpp"
#include "tests/fuzz/entry.hpp"

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  return meltstage::reads_or_refuses(data, size, [](std::string_view text) {
    meltstage::dft::collapse(meltstage::dft::parse_bench(text, "fuzz.bench"));
  });
}
