// SPDX-License-Identifier: Apache-2.0
#include "kernel_side.hpp"

#include "cmodel/algor_kernel.hpp"
#include "solver_bits.hpp"

namespace meltstage::proof {

namespace {

using chip::Int;
using chip::PlainBits;
namespace kernel = chip::algor_kernel;

// A word of W bits to and from the number types.
template <class B>
struct WordOf;
template <>
struct WordOf<SolverBits> {
  using Word = z3::expr;
  static z3::expr condition(const z3::expr& word) { return word == SolverBits::context().bv_val(1, 1); }
  template <class T, int W>
  static z3::expr stored(const z3::expr& word) {
    return word;
  }
  template <int W>
  static z3::expr word(const z3::expr& stored) {
    return stored;
  }
  static z3::expr word(const Int<SolverBits, 18>& number) { return number.bits; }
  static z3::expr select(const z3::expr& condition, const z3::expr& a, const z3::expr& b) {
    return z3::ite(condition, a, b);
  }
  static z3::expr bit(const z3::expr& condition) {
    return z3::ite(condition, SolverBits::context().bv_val(1, 1), SolverBits::context().bv_val(0, 1));
  }
};
template <>
struct WordOf<PlainBits> {
  using Word = std::uint64_t;
  static bool condition(std::uint64_t word) { return word != 0; }
  template <class T, int W>
  static T stored(std::uint64_t word) {
    return PlainBits::store<T, W>(static_cast<std::int64_t>(word));
  }
  template <int W, class T>
  static std::uint64_t word(const T& stored) {
    return static_cast<std::uint64_t>(stored) & ((std::uint64_t{1} << W) - 1);
  }
  static std::uint64_t word(const Int<PlainBits, 18>& number) { return word<18>(number.bits); }
  static std::uint64_t select(bool condition, std::uint64_t a, std::uint64_t b) { return condition ? a : b; }
  static std::uint64_t bit(bool condition) { return condition ? 1 : 0; }
};

template <class B>
struct State {
#define TC_MEMBER(type, name, width, reset) typename B::template Stored<type, width> name;
  TC_ALGOR_FLOPS(TC_MEMBER)
#undef TC_MEMBER
};

template <class B>
Words<typename WordOf<B>::Word> clock(const Words<typename WordOf<B>::Word>& before) {
  using W = WordOf<B>;
#define TC_TAKE(type, name, width, reset) .name = W::template stored<type, width>(before.at(#name)),
  State<B> state{TC_ALGOR_FLOPS(TC_TAKE)};
#undef TC_TAKE
  std::vector<typename B::template Stored<std::uint16_t, 16>> params;
  for (unsigned r = 0; r < chip::spec::kHoldingCount; ++r) {
    params.push_back(W::template stored<std::uint16_t, 16>(before.at(register_name(r))));
  }
  auto q = kernel::flops_of<B>(state);

  Words<typename W::Word> words;
  words.emplace("done_o", W::template word<1>(q.done_q.stored()));
  words.emplace("duty_o", W::template word<17>(q.duty_q.stored()));
  words.emplace("sp_work_o", W::template word<16>(q.sp_work_q.stored()));
  words.emplace("ramping_o", W::bit(kernel::ramping(q)));
  words.emplace("i_o", W::template word<32>(q.i_q.stored()));
  words.emplace("filt_o", W::template word<22>(q.filt_q.stored()));
  words.emplace("limited_o", W::bit(kernel::limited(q)));
  words.emplace("segment_o", W::template word<2>(q.segment_q.stored()));
  words.emplace("i_held_o", W::template word<1>(q.i_held_q.stored()));
  words.emplace("hold_limit_o", W::template word<18>(q.hold_q.stored()));
  words.emplace("target_o", W::template word<16>(q.target_q.stored()));
  words.emplace("amb_o", W::template word<16>(q.amb_q.stored()));
  words.emplace("duty_max_o", W::template word<17>(q.duty_max_q.stored()));
  words.emplace("term_p_o", W::word(kernel::term_p(q)));
  words.emplace("term_i_o", W::word(kernel::term_i(q)));
  words.emplace("term_d_o", W::word(kernel::term_d(q)));

  const auto pv = W::template stored<std::int16_t, 16>(before.at("pv_i"));
  const auto duty = [&](const char* name) {
    return Int<B, 18>(
        B::template load<std::uint32_t, 17>(W::template stored<std::uint32_t, 17>(before.at(name))));
  };
  const kernel::Pins<B, decltype(params)> pins{.params = params,
                                               .start = W::condition(before.at("start_i")),
                                               .sample_ok = W::condition(before.at("sample_ok_i")),
                                               .run = W::condition(before.at("run_i")),
                                               .at_temp = W::condition(before.at("at_temp_i")),
                                               .ms = W::condition(before.at("ms_i")),
                                               .pv = Int<B, 16>(pv),
                                               .drop = W::condition(before.at("drop_i")),
                                               .hold_test = W::condition(before.at("hold_test_i")),
                                               .tuning = W::condition(before.at("tuning_i")),
                                               .tune_duty = duty("tune_duty_i"),
                                               .tune_hold = duty("tune_hold_i")};
  words.emplace("still_o", W::bit(kernel::still(q, pins)));
  const auto idle = kernel::idle(q, pins);
  kernel::clock(q, pins);
#define TC_GIVE(type, name, width, reset)                       \
  const auto next_##name = W::template word<width>(state.name); \
  words.emplace(#name, next_##name);                            \
  words.emplace(idle_name(#name), W::select(idle, next_##name, before.at(#name)));
  TC_ALGOR_FLOPS(TC_GIVE)
#undef TC_GIVE
  return words;
}

}  // namespace

std::vector<FlopWord> flop_words() {
#define TC_WORD(type, name, width, reset) {#name, width, reset},
  return {TC_ALGOR_FLOPS(TC_WORD)};
#undef TC_WORD
}

std::string register_name(unsigned index) { return "params_i[" + std::to_string(index) + "]"; }

std::string idle_name(const std::string& flop) { return flop + " while idle"; }

Words<z3::expr> kernel_clock(const Words<z3::expr>& before) { return clock<SolverBits>(before); }
Words<std::uint64_t> kernel_clock(const Words<std::uint64_t>& before) { return clock<PlainBits>(before); }

}  // namespace meltstage::proof
