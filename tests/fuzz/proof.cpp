// SPDX-License-Identifier: Apache-2.0
#include "asic/dft/atpg/proof_check.hpp"
#include "tests/fuzz/entry.hpp"

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  return meltstage::reads_or_refuses(data, size, [](std::string_view text) {
    // formula and proof, parted by a line of =
    const std::size_t parting = std::min(text.find('='), text.size());
    std::string reason;
    meltstage::dft::refutes({"formula", std::string(text.substr(0, parting))},
                            {"proof", std::string(text.substr(std::min(parting + 1, text.size())))}, reason);
  });
}
