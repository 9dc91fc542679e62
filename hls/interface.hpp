// SPDX-License-Identifier: Apache-2.0
// What a C++ source says of itself to become a circuit. It defines, with C linkage,
//
//   void hls_reset(State*);                                 the state in reset
//   void hls_step(State*, const Inputs*);                   one rising clock edge
//   void hls_outputs(const State*, const Inputs*, Outputs*);
//   const meltstage::hls::Field hls_flops[], hls_input_pins[], hls_output_pins[];   what lies where in these
//
// if flops have a reset of their own, as one that ends with the clock,
//
//   void hls_in_reset(const State*, const Inputs*, std::uint8_t*);   1 while they show their reset values
//
// and, if a proof needs to know what holds in all states that are reached from reset,
//
//   void hls_invariants(const State*, Invariants*);          1 for each that holds
//   const meltstage::hls::Field hls_invariant_names[];
//
// These functions are pure: no input or output, no globals that change, no allocation, loops with a bound.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace meltstage::hls {

/// A flop or pin: an integer of a struct, or some bits of it.
struct Field {
  const char* name;      // as the circuit shall call it; __DOT__ in it stands for a dot
  std::uint32_t offset;  // in the struct, bytes
  std::uint32_t bytes;   // of the integer: 1, 2, 4 or 8
  std::uint32_t width;   // bits that the circuit has of it, from the lowest one
  std::uint32_t is_signed;
  std::uint64_t kept;  // of these the ones that can change; the others stay as in reset
  std::int32_t word;   // of an array: its index; otherwise -1
};

template <class T>
constexpr Field field(const char* name, std::size_t offset, unsigned width,
                      std::uint64_t kept = ~std::uint64_t{0}) {
  static_assert(std::is_integral_v<T> && sizeof(T) <= 8);
  return {name, static_cast<std::uint32_t>(offset), sizeof(T), width, std::is_signed_v<T> ? 1u : 0u, kept,
          -1};
}

}  // namespace meltstage::hls

/// A member of a struct as a flop or pin of its own name.
#define HLS_FIELD(structure, member, width) \
  ::meltstage::hls::field<decltype(structure::member)>(#member, offsetof(structure, member), width)
