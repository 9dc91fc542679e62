// SPDX-License-Identifier: Apache-2.0
// What every fuzzed reader promises: any bytes are read, or refused by one UserError of one line.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "base/error.hpp"

namespace meltstage {

template <class Read>
int reads_or_refuses(const std::uint8_t* data, std::size_t size, const Read& read) {
  try {
    read(std::string_view(reinterpret_cast<const char*>(data), size));
  } catch (const UserError& error) {
    constexpr std::size_t kLongest = 1 << 16;  // names of a netlist are told whole
    const std::string_view message = error.what();
    const bool is_line = !message.empty() && message.size() <= kLongest &&
                         std::all_of(message.begin(), message.end(), [](char c) {
                           return static_cast<unsigned char>(c) >= ' ' && c != '\x7F';
                         });
    if (!is_line) {
      std::fprintf(stderr, "a message of %zu bytes, expected one line of at most %zu: %s\n", message.size(),
                   kLongest, error.what());
      std::abort();
    }
  }
  return 0;
}

}  // namespace meltstage

/// The reader's function: libFuzzer's own name, or one of its own where several are linked together
/// (CMakeLists.txt).
extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size);
