// SPDX-License-Identifier: Apache-2.0
// Integers of a known number of bits for arithmetic that is written once and runs on several number types:
// plain integers (PlainBits, below), SystemC's sc_int, a solver's bit-vectors (tests/proofs/kernel/). +, -
// and * are exact: the result is as wide as it can become, as in a datapath without overflow. Only wrap(),
// wrap_u(), clamp() and Flop narrow.
#pragma once

#include <algorithm>
#include <cstdint>
#include <type_traits>

namespace meltstage::chip {

// Bits of a two's complement number that holds `value`.
constexpr int width_of(std::int64_t value) {
  int width = 1;
  for (std::int64_t rest = value; rest != 0 && rest != -1; rest >>= 1) ++width;
  return width;
}

// A constant; its value is its type, so that its width is known.
template <std::int64_t V>
struct Const {
  constexpr Const<-V> operator-() const { return {}; }
};

// 2048_k is Const<2048>.
template <char... Digits>
constexpr auto operator""_k() {
  constexpr std::int64_t kValue = [] {
    std::int64_t value = 0;
    ((value = value * 10 + (Digits - '0')), ...);
    return value;
  }();
  return Const<kValue>{};
}

// A whole number that fits W bits in two's complement. `B` says how bits are kept:
//   Bits<W>, Bool            types of a number and of a condition
//   Stored<T, W>             type of a flop of W bits that is a T in the model
//   constant<W>(v)           load<T, W>(stored)    store<T, W>(bits)
//   resize<W, From>(bits)    sign-extended or cut to W bits
//   zero_extend<W>(bits)     low W bits as a number without sign, in W + 1 bits
//   shift_right(x, n)        arithmetic
//   select(c, a, b)          c ? a : b
//   choose(state, c, a, b)   if (c) a(); else b(); where both work on `state`
// and + - * << < > <= >= == != between Bits of one width, && || ! on Bool.
template <class B, int W>
struct Int {
  static_assert(W >= 1 && W <= 64);
  static constexpr int kWidth = W;
  using Bits = typename B::template Bits<W>;
  Bits bits;

  constexpr explicit Int(const Bits& value) : bits(value) {}
  template <int V>
  requires(V < W) constexpr Int(const Int<B, V>& narrower) : bits(B::template resize<W, V>(narrower.bits)) {}
  template <std::int64_t V>
  requires(width_of(V) <= W) constexpr Int(Const<V>) : bits(B::template constant<W>(V)) {}
};

template <class B, int V, int W>
constexpr auto operator+(const Int<B, V>& a, const Int<B, W>& b) {
  constexpr int kWidth = std::max(V, W) + 1;
  using Sum = Int<B, kWidth>;
  return Sum(typename Sum::Bits(Sum(a).bits + Sum(b).bits));
}
template <class B, int V, int W>
constexpr auto operator-(const Int<B, V>& a, const Int<B, W>& b) {
  constexpr int kWidth = std::max(V, W) + 1;
  using Difference = Int<B, kWidth>;
  return Difference(typename Difference::Bits(Difference(a).bits - Difference(b).bits));
}
template <class B, int V, int W>
constexpr auto operator*(const Int<B, V>& a, const Int<B, W>& b) {
  using Product = Int<B, V + W>;
  return Product(typename Product::Bits(Product(a).bits * Product(b).bits));
}
template <class B, int W>
constexpr auto operator-(const Int<B, W>& a) {
  return Const<0>{} - a;
}

#define TC_COMPARISON(op)                                                          \
  template <class B, int V, int W>                                                 \
  constexpr typename B::Bool operator op(const Int<B, V>& a, const Int<B, W>& b) { \
    using Wide = Int<B, std::max(V, W)>;                                           \
    return typename B::Bool(Wide(a).bits op Wide(b).bits);                         \
  }
#define TC_WITH_CONSTANT(op)                                   \
  template <class B, int W, std::int64_t V>                    \
  constexpr auto operator op(const Int<B, W>& a, Const<V> b) { \
    return a op Int<B, width_of(V)>(b);                        \
  }                                                            \
  template <class B, int W, std::int64_t V>                    \
  constexpr auto operator op(Const<V> a, const Int<B, W>& b) { \
    return Int<B, width_of(V)>(a) op b;                        \
  }
TC_COMPARISON(<)
TC_COMPARISON(<=)
TC_COMPARISON(>)
TC_COMPARISON(>=)
TC_COMPARISON(==)
TC_COMPARISON(!=)
TC_WITH_CONSTANT(+)
TC_WITH_CONSTANT(-)
TC_WITH_CONSTANT(*)
TC_WITH_CONSTANT(<)
TC_WITH_CONSTANT(<=)
TC_WITH_CONSTANT(>)
TC_WITH_CONSTANT(>=)
TC_WITH_CONSTANT(==)
TC_WITH_CONSTANT(!=)
#undef TC_COMPARISON
#undef TC_WITH_CONSTANT

// Times 2^N, exact.
template <class B, int W, std::int64_t N>
constexpr auto operator<<(const Int<B, W>& a, Const<N>) {
  static_assert(W > 1);
  using Wide = Int<B, W + N>;
  return Wide(typename Wide::Bits(Wide(a).bits * Wide(Const<(std::int64_t{1} << N)>{}).bits));
}
// Over 2^N, rounded down.
template <class B, int W, std::int64_t N>
constexpr auto operator>>(const Int<B, W>& a, Const<N> n) {
  static_assert(N < W);
  using Bits = typename Int<B, W>::Bits;
  return Int<B, W - N>(B::template resize<W - N, W>(Bits(B::shift_right(a.bits, Int<B, W>(n).bits))));
}
template <class B, int W, int V>
constexpr auto operator>>(const Int<B, W>& a, const Int<B, V>& n) {
  static_assert(V <= W);
  return Int<B, W>(typename Int<B, W>::Bits(B::shift_right(a.bits, Int<B, W>(n).bits)));
}

// Low N bits, with or without sign.
template <int N, class B, int W>
constexpr auto wrap(const Int<B, W>& a) {
  return Int<B, N>(B::template resize<N, W>(a.bits));
}
template <int N, class B, int W>
constexpr auto wrap_u(const Int<B, W>& a) {
  return Int<B, N + 1>(B::template zero_extend<N>(a.bits));
}

// c ? a : b; both are worked out.
template <class B, int V, int W>
constexpr auto select(const typename B::Bool& c, const Int<B, V>& a, const Int<B, W>& b) {
  using Wide = Int<B, std::max(V, W)>;
  return Wide(typename Wide::Bits(B::select(c, Wide(a).bits, Wide(b).bits)));
}
template <class B, int W, std::int64_t V>
constexpr auto select(const typename B::Bool& c, const Int<B, W>& a, Const<V> b) {
  return select(c, a, Int<B, width_of(V)>(b));
}
template <class B, int W, std::int64_t V>
constexpr auto select(const typename B::Bool& c, Const<V> a, const Int<B, W>& b) {
  return select(c, Int<B, width_of(V)>(a), b);
}

// Held to Low..High, which is all the bits that are left.
template <std::int64_t Low, std::int64_t High, class B, int W>
constexpr auto clamp(const Int<B, W>& a) {
  constexpr int kWidth = std::max(width_of(Low), width_of(High));
  if constexpr (W < kWidth) {
    return clamp<Low, High>(Int<B, kWidth>(a));
  } else {
    return wrap<kWidth>(select(a < Const<Low>{}, Const<Low>{}, select(a > Const<High>{}, Const<High>{}, a)));
  }
}

// A flop of W bits somewhere else: q() reads, q = x writes its low W bits; only the sign may get lost that
// way.
template <class B, class T, int W>
class Flop {
 public:
  using Stored = typename B::template Stored<T, W>;
  static constexpr int kWidth = std::is_signed_v<T> ? W : W + 1;

  explicit Flop(Stored& stored) : stored_(stored) {}
  Flop(const Flop&) = delete;
  Stored& stored() const { return stored_; }
  Int<B, kWidth> operator()() const { return Int<B, kWidth>(B::template load<T, W>(stored_)); }
  template <int V>
  requires(V <= kWidth) void operator=(const Int<B, V>& value) {
    stored_ = B::template store<T, W>(Int<B, kWidth>(value).bits);
  }
  template <std::int64_t V>
  requires(width_of(V) <= kWidth) void operator=(Const<V> value) { *this = Int<B, kWidth>(value); }
  void operator=(const typename B::Bool& value) {
    static_assert(W == 1);
    *this =
        Int<B, kWidth>(B::select(value, Int<B, kWidth>(Const<1>{}).bits, Int<B, kWidth>(Const<0>{}).bits));
  }

 private:
  Stored& stored_;
};

// Every number is an int64, every flop the plain integer of the model.
struct PlainBits {
  template <int W>
  using Bits = std::int64_t;
  using Bool = bool;
  template <class T, int W>
  using Stored = T;

  template <int W>
  static constexpr std::int64_t constant(std::int64_t value) {
    return value;
  }
  template <class T, int W>
  static constexpr std::int64_t load(const T& stored) {
    return stored;
  }
  template <class T, int W>
  static constexpr T store(std::int64_t bits) {
    if constexpr (std::is_signed_v<T>) return static_cast<T>(resize<W, 64>(bits));
    return static_cast<T>(zero_extend<W>(bits));
  }
  template <int W, int From>
  static constexpr std::int64_t resize(std::int64_t bits) {
    if constexpr (W >= From) return bits;
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(bits) << (64 - W)) >> (64 - W);
  }
  template <int W>
  static constexpr std::int64_t zero_extend(std::int64_t bits) {
    return bits & ((std::int64_t{1} << W) - 1);
  }
  static constexpr std::int64_t shift_right(std::int64_t x, std::int64_t n) { return x >> n; }
  static constexpr std::int64_t select(bool condition, std::int64_t a, std::int64_t b) {
    return condition ? a : b;
  }
  template <class State, class Then, class Else>
  static constexpr void choose(State&, bool condition, const Then& then, const Else& otherwise) {
    if (condition) {
      then();
    } else {
      otherwise();
    }
  }
};

}  // namespace meltstage::chip
