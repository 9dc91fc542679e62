// SPDX-License-Identifier: Apache-2.0
// Number type of cmodel/exact_int.hpp over z3: a number of W bits is a bit-vector expression of W bits, a
// condition a Boolean expression, an if the if-then-else of every flop.
#pragma once

#include <z3++.h>

#include <cstdint>
#include <type_traits>
#include <vector>

#include "cmodel/algor.hpp"

namespace meltstage::proof {

struct SolverBits {
  template <int W>
  using Bits = z3::expr;
  using Bool = z3::expr;
  template <class T, int W>
  using Stored = z3::expr;

  // The one context of the program; constants need it.
  static z3::context& context() {
    static z3::context the_context;
    return the_context;
  }

  template <int W>
  static z3::expr constant(std::int64_t value) {
    return context().bv_val(value, W);
  }
  template <class T, int W>
  static z3::expr load(const z3::expr& stored) {
    return std::is_signed_v<T> ? stored : z3::zext(stored, 1);
  }
  template <class T, int W>
  static z3::expr store(const z3::expr& bits) {
    return bits.extract(W - 1, 0);
  }
  template <int W, int From>
  static z3::expr resize(const z3::expr& bits) {
    if constexpr (W < From) return bits.extract(W - 1, 0);
    return W == From ? bits : z3::sext(bits, W - From);
  }
  template <int W>
  static z3::expr zero_extend(const z3::expr& bits) {
    return z3::zext(bits.extract(W - 1, 0), 1);
  }
  static z3::expr shift_right(const z3::expr& x, const z3::expr& n) { return z3::ashr(x, n); }
  static z3::expr select(const z3::expr& condition, const z3::expr& a, const z3::expr& b) {
    return z3::ite(condition, a, b);
  }
  // Both ways are gone, from the same flops.
  template <class Flops, class Then, class Else>
  static void choose(Flops& q, const z3::expr& condition, const Then& then, const Else& otherwise) {
#define TC_STORED(type, name, width, reset) &q.name.stored(),
    const std::vector<z3::expr*> flops{TC_ALGOR_FLOPS(TC_STORED)};
#undef TC_STORED
    std::vector<z3::expr> before;
    for (const z3::expr* flop : flops) before.push_back(*flop);
    then();
    std::vector<z3::expr> after;
    for (std::size_t i = 0; i < flops.size(); ++i) {
      after.push_back(*flops[i]);
      *flops[i] = before[i];
    }
    otherwise();
    for (std::size_t i = 0; i < flops.size(); ++i) *flops[i] = z3::ite(condition, after[i], *flops[i]);
  }
};

}  // namespace meltstage::proof
