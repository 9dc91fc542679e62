// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <string_view>

namespace meltstage {

/// Named random sub-stream of one 64-bit seed: the same seed and name give the same numbers on every machine,
/// whatever other streams draw. Generator xoshiro256** seeded by splitmix64 (Blackman, Vigna 2018); the name
/// enters as its FNV-1a hash.
class Rng {
 public:
  Rng(std::uint64_t seed, std::string_view name) {
    std::uint64_t hash = 0xcbf29ce484222325U;
    for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
    std::uint64_t x = seed ^ hash;
    for (auto& word : state_) word = splitmix64(x);
  }

  /// Next 64 random bits.
  std::uint64_t bits() {
    const std::uint64_t result = std::rotl(state_[1] * 5, 7) * 9;
    const std::uint64_t t = state_[1] << 17;
    state_[2] ^= state_[0];
    state_[3] ^= state_[1];
    state_[1] ^= state_[2];
    state_[0] ^= state_[3];
    state_[2] ^= t;
    state_[3] = std::rotl(state_[3], 45);
    return result;
  }

  /// Uniform in [0, 1), 53 bits.
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

  /// Uniform integer in [0, bound), bound >= 1, without bias (Lemire's bound by rejection).
  std::uint64_t below(std::uint64_t bound) {
    const std::uint64_t rejected = (0 - bound) % bound;
    std::uint64_t x = bits();
    while (x < rejected) x = bits();
    return x % bound;
  }

  /// Standard normal by Karney's exact sampling (ACM TOMS 42, 2016, algorithm N): comparisons and one
  /// division only, so that no mathematical library can change a bit of it.
  double gaussian() {
    for (;;) {
      int k = 0;
      while (bernoulli_exp(0.5)) ++k;
      bool accepted = true;
      for (int i = 0; accepted && i < k * (k - 1); ++i) accepted = bernoulli_exp(0.5);
      if (!accepted) continue;
      const double x = uniform();
      const double p = (2.0 * k + x) / (2.0 * k + 2.0);
      for (int i = 0; accepted && i <= k; ++i) accepted = bernoulli_exp_product(x, p);
      if (accepted) return (bits() >> 63) != 0U ? -(k + x) : k + x;
    }
  }

 private:
  static std::uint64_t splitmix64(std::uint64_t& x) {
    std::uint64_t z = (x += 0x9e3779b97f4a7c15U);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  }

  // True with probability exp(-x), 0 <= x <= 1: von Neumann, length of a falling run of uniforms.
  bool bernoulli_exp(double x) { return bernoulli_exp_product(x, 1.0); }

  // True with probability exp(-x p), 0 <= x, p <= 1.
  bool bernoulli_exp_product(double x, double p) {
    double last = x;
    for (bool even = true;; even = !even) {
      const double z = uniform();
      if (!(z < last) || !(uniform() < p)) return even;
      last = z;
    }
  }

  std::array<std::uint64_t, 4> state_{};
};

/// The sub-stream `name` of `seed`.
inline Rng stream(std::uint64_t seed, std::string_view name) { return {seed, name}; }

/// A chance of 1 in n, at least 1.
inline bool one_in(Rng& rng, std::uint64_t n) { return rng.below(n) == 0; }

}  // namespace meltstage
