// SPDX-License-Identifier: Apache-2.0
// Words of 512 lanes as vectors of the machine; for the simulators' own files.
#pragma once

#include "asic/dft/core/circuit.hpp"
#include "asic/dft/core/patterns.hpp"

namespace meltstage::dft {

// Compiled for each width of vector register; the loader takes the one that fits the machine.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define MELTSTAGE_WIDE __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define MELTSTAGE_WIDE
#endif
#define MELTSTAGE_INLINE __attribute__((always_inline)) inline

using Lanes = std::uint64_t __attribute__((vector_size(64), may_alias));

MELTSTAGE_INLINE Lanes& lanes(Word& word) { return *reinterpret_cast<Lanes*>(&word); }
MELTSTAGE_INLINE const Lanes& lanes(const Word& word) { return *reinterpret_cast<const Lanes*>(&word); }

MELTSTAGE_INLINE bool is_zero(const Lanes& a) {
  return ((a[0] | a[1]) | (a[2] | a[3]) | (a[4] | a[5]) | (a[6] | a[7])) == 0;
}

// A gate's value; `in` gives the lanes of an input by position.
template <class In>
MELTSTAGE_INLINE void evaluate(Gate kind, std::size_t inputs, const In& in, Lanes& result) {
  const Lanes ones = ~Lanes{};
  switch (kind) {
    case Gate::tie0:
      result = Lanes{};
      return;
    case Gate::tie1:
      result = ones;
      return;
    case Gate::input:
      return;
    case Gate::mux: {
      const Lanes s = in(2);
      result = (in(0) & ~s) | (in(1) & s);
      return;
    }
    default:
      break;
  }
  Lanes value = in(0);
  switch (kind) {
    case Gate::all:
    case Gate::nall:
      for (std::size_t i = 1; i < inputs; ++i) value &= in(i);
      break;
    case Gate::any:
    case Gate::none:
      for (std::size_t i = 1; i < inputs; ++i) value |= in(i);
      break;
    case Gate::parity:
    case Gate::same:
      for (std::size_t i = 1; i < inputs; ++i) value ^= in(i);
      break;
    default:
      break;
  }
  const bool invert = kind == Gate::inv || kind == Gate::nall || kind == Gate::none || kind == Gate::same;
  result = invert ? ~value : value;
}

}  // namespace meltstage::dft
