// SPDX-License-Identifier: Apache-2.0
// ALGOR's kernel on SystemC's fixed-width types against the model on plain integers: a clock from a random
// state with random inputs, every flop and output equal. An intermediate result that needed more bits than
// its type gives it would show.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <systemc>
#include <type_traits>

#include "cmodel/algor_kernel.hpp"

namespace meltstage::chip {
namespace {

// A number of W bits is an sc_int<W>, a flop an sc_int<W> or sc_uint<W>.
struct SystemcBits {
  template <int W>
  using Bits = sc_dt::sc_int<W>;
  using Bool = bool;
  template <class T, int W>
  using Stored = std::conditional_t<std::is_signed_v<T>, sc_dt::sc_int<W>, sc_dt::sc_uint<W>>;

  template <int W>
  static sc_dt::sc_int<W> constant(std::int64_t value) {
    return value;
  }
  template <class T, int W>
  static sc_dt::int64 load(const Stored<T, W>& stored) {
    return stored.to_int64();
  }
  template <class T, int W, int V>
  static Stored<T, W> store(const sc_dt::sc_int<V>& bits) {
    return Stored<T, W>(bits.range(W - 1, 0));
  }
  template <int W, int From>
  static sc_dt::sc_int<W> resize(const sc_dt::sc_int<From>& bits) {
    return sc_dt::sc_int<W>(bits.to_int64());
  }
  template <int W, int From>
  static sc_dt::int64 zero_extend(const sc_dt::sc_int<From>& bits) {
    return sc_dt::sc_uint<W>(bits.range(W - 1, 0)).to_int64();
  }
  static sc_dt::int64 shift_right(sc_dt::int64 x, sc_dt::int64 n) { return x >> n; }
  template <int W>
  static sc_dt::sc_int<W> select(bool condition, const sc_dt::sc_int<W>& a, const sc_dt::sc_int<W>& b) {
    return condition ? a : b;
  }
  template <class State, class Then, class Else>
  static void choose(State&, bool condition, const Then& then, const Else& otherwise) {
    condition ? then() : otherwise();
  }
};

struct SystemcFlops {
#define TC_MEMBER(type, name, width, reset) SystemcBits::Stored<type, width> name;
  TC_ALGOR_FLOPS(TC_MEMBER)
#undef TC_MEMBER
};
using SystemcParams = std::array<sc_dt::sc_uint<16>, spec::kHoldingCount>;

// Words of any width, corners (all bits alike but the lowest or the highest, or few bits) as often as others.
class Words {
 public:
  explicit Words(std::uint64_t seed) : random_(seed) {}
  std::uint64_t below(std::uint64_t n) { return random_() % n; }
  std::uint64_t word(unsigned width) {
    const std::uint64_t ones = (std::uint64_t{1} << width) - 1;
    const std::uint64_t top = std::uint64_t{1} << (width - 1);
    const std::uint64_t any = random_();
    switch (any >> 60) {
      case 0:
        return 0;
      case 1:
        return 1;
      case 2:
        return ones;
      case 3:
        return ones - 1;
      case 4:
        return top & ones;
      case 5:
        return top - 1;
      case 6:
        return std::uint64_t{1} << (any % width);
      case 7:
        return (any & ones) >> (any % width);
      case 8:  // the highest duty, where the word holds one
        return 65536 & ones;
      default:
        return any & ones;
    }
  }

 private:
  std::mt19937_64 random_;
};

// One case: names what differs, empty when nothing does.
std::string compare_clock(Words& words, unsigned step, Params& p, SystemcParams& sc_p) {
  Algor plain;
  SystemcFlops systemc;
#define TC_FILL(type, name, width, reset)                                      \
  const std::uint64_t name = words.word(width);                                \
  plain.name = PlainBits::store<type, width>(static_cast<std::int64_t>(name)); \
  systemc.name = static_cast<SystemcBits::Stored<type, width>>(name);
  TC_ALGOR_FLOPS(TC_FILL)
#undef TC_FILL
  plain.step_q = static_cast<std::uint8_t>(step);
  systemc.step_q = step;
  // A few parameters change from case to case; in time all of them have all kinds of values.
  for (int i = 0; i < 4; ++i) {
    const std::uint64_t reg = words.below(spec::kHoldingCount);
    p.value[reg] = static_cast<std::uint16_t>(words.word(16));
    sc_p[reg] = p.value[reg];
  }
  const std::uint64_t pins = words.below(256);
  const auto pv = static_cast<std::int16_t>(words.word(16));
  const auto tune_duty = static_cast<std::uint32_t>(words.word(17));
  const auto tune_hold = static_cast<std::uint32_t>(words.word(17));
  const auto pin = [&](unsigned i) { return (pins >> i & 1) != 0; };

  const algor_kernel::Pins<SystemcBits, SystemcParams> in{.params = sc_p,
                                                          .start = pin(0),
                                                          .sample_ok = pin(1),
                                                          .run = pin(2),
                                                          .at_temp = pin(3),
                                                          .ms = pin(4),
                                                          .pv = Int<SystemcBits, 16>(pv),
                                                          .drop = pin(5),
                                                          .hold_test = pin(7),
                                                          .tuning = pin(6),
                                                          .tune_duty = Int<SystemcBits, 18>(tune_duty),
                                                          .tune_hold = Int<SystemcBits, 18>(tune_hold)};
  auto q = algor_kernel::flops_of<SystemcBits>(systemc);
  algor_kernel::clock(q, in);
  plain.step({.params = p,
              .start = pin(0),
              .sample_ok = pin(1),
              .run = pin(2),
              .at_temp = pin(3),
              .ms = pin(4),
              .pv = pv,
              .drop = pin(5),
              .hold_test = pin(7),
              .tuning = pin(6),
              .tune_duty = tune_duty,
              .tune_hold = tune_hold});

  std::string different;
#define TC_COMPARE(type, name, width, reset) \
  if (systemc.name.to_int64() != std::int64_t{plain.name}) different += " " #name;
  TC_ALGOR_FLOPS(TC_COMPARE)
#undef TC_COMPARE
  if (algor_kernel::ramping(q) != plain.ramping()) different += " ramping";
  if (algor_kernel::limited(q) != plain.limited()) different += " limited";
  if (algor_kernel::term_p(q).bits.to_int64() != plain.term_p()) different += " term_p";
  if (algor_kernel::term_i(q).bits.to_int64() != plain.term_i()) different += " term_i";
  if (algor_kernel::term_d(q).bits.to_int64() != plain.term_d()) different += " term_d";
  return different;
}

TEST(FixedWidth, KernelEqualsTheModelInEveryStep) {
  Words words(2023);
  Params p;
  SystemcParams sc_p;
  for (auto& reg : sc_p) reg = 0;
  for (int i = 0; i < 10'000'000; ++i) {
    const auto step = static_cast<unsigned>(i % 32);  // illegal codes too
    const std::string different = compare_clock(words, step, p, sc_p);
    ASSERT_EQ(different, "") << "case " << i << " step_q " << step;
  }
}

}  // namespace
}  // namespace meltstage::chip

int sc_main(int argc, char* argv[]) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
