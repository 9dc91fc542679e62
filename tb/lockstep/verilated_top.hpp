// SPDX-License-Identifier: Apache-2.0
// A Verilated tc_top, whatever its prefix, as a VerilatedRtl: include the prefix's own headers (V...,
// V...___024root, V...__Syms) before this one.
#pragma once

#include <verilated.h>

#include <algorithm>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>

#include "tb/lockstep/rising_edge.hpp"
#include "tb/lockstep/verilated_rtl.hpp"

// A flop's member in the Verilated root.
#define TC_PATH2(instance, name) tc_top__DOT__##instance##__DOT__##name
#define TC_PATH1(instance, name) TC_PATH2(instance, name)
#define TC_ROOT(name) root.TC_PATH1(TC_INSTANCE, name)
#define TC_TEXT2(x) #x
#define TC_TEXT1(x) TC_TEXT2(x)

namespace meltstage::tb {

namespace verilated {

namespace spec = chip::spec;  // the flop lists are written inside meltstage::chip

// Low `width` bits, as the RTL stores them.
template <unsigned width, class T>
constexpr std::uint64_t bits(T value) {
  return static_cast<std::uint64_t>(value) & (~std::uint64_t{0} >> (64 - width));
}

// "u_uartc__DOT__u_rx" -> "u_uartc.u_rx"
inline std::string dotted(std::string path) {
  for (std::size_t at; (at = path.find("__DOT__")) != std::string::npos;) path.replace(at, 7, ".");
  return path;
}

// Words of an RTL array stand at the end of the model's, which may have unused entries before them.
template <class Model, class Rtl>
constexpr std::size_t words_before(const Model& model, const Rtl&) {
  return model.size() - sizeof(Rtl) / sizeof(std::declval<Rtl&>()[0]);
}

template <class Root>
bool equal(const Root& root, const chip::Chip& model) {
  std::uint64_t difference = 0;
#define TC_FLOP(type, name, width, reset) difference |= TC_ROOT(name) ^ bits<width>(model.TC_MEMBER.name);
#define TC_ARRAY(type, name, count, width)                                                               \
  {                                                                                                      \
    const auto& words = model.TC_MEMBER.name;                                                            \
    difference |=                                                                                        \
        !std::equal(words.begin() + words_before(words, TC_ROOT(name)), words.end(), &TC_ROOT(name)[0]); \
  }
#include "cmodel/for_each_flop.inc"
  return difference == 0;
}

template <class Root>
std::vector<FlopDifference> list_differences(const Root& root, const chip::Chip& model) {
  std::vector<FlopDifference> list;
  const auto compare = [&](const char* instance, const std::string& name, std::uint64_t dut,
                           std::uint64_t expected) {
    if (dut != expected) list.push_back({dotted(instance) + "." + name, dut, expected});
  };
#define TC_FLOP(type, name, width, reset) \
  compare(TC_TEXT1(TC_INSTANCE), #name, TC_ROOT(name), bits<width>(model.TC_MEMBER.name));
#define TC_ARRAY(type, name, count, width)                                                           \
  {                                                                                                  \
    const std::size_t before = words_before(model.TC_MEMBER.name, TC_ROOT(name));                    \
    for (std::size_t i = before; i < count; ++i)                                                     \
      compare(TC_TEXT1(TC_INSTANCE), #name "[" + std::to_string(i) + "]", TC_ROOT(name)[i - before], \
              model.TC_MEMBER.name[i]);                                                              \
  }
#include "cmodel/for_each_flop.inc"
  return list;
}

template <class Root>
unsigned count_bits(const Root&) {
  std::size_t total = 0;
#define TC_FLOP(type, name, width, reset) total += width;
#define TC_ARRAY(type, name, count, width)      \
  for (unsigned word = 0; word < count; ++word) \
    total += std::popcount(chip::array_flops<decltype(chip::Chip::TC_MEMBER)>(word, width));
#include "cmodel/for_each_flop.inc"
  return static_cast<unsigned>(total);
}

// What the assertions remember belongs to the state before (rtl/tc_assert.svh, rtl/properties/).
template <class Root>
void resume_assertions(Root& root) {
#define TC_FORGET(instance) root.TC_PATH1(instance, past_ok_q) = 0;
  TC_FORGET(u_uartc)
  TC_FORGET(u_uartc__DOT__u_rx)
  TC_FORGET(u_uartc__DOT__u_frame)
  TC_FORGET(u_uartc__DOT__u_tx)
  TC_FORGET(u_uartc__DOT__u_tlm)
  TC_FORGET(u_sysctrl)
  TC_FORGET(u_paramc)
  TC_FORGET(u_sensc)
  TC_FORGET(u_algor__DOT__u_properties)
  TC_FORGET(u_atune)
  TC_FORGET(u_pwmc)
  TC_FORGET(u_guard)
  TC_FORGET(u_quality)
  TC_FORGET(u_properties)
#undef TC_FORGET
#define TC_RESUME(instance) root.TC_PATH1(instance, resumed_q) = 1;
  TC_RESUME(u_uartc)
  TC_RESUME(u_uartc__DOT__u_rx)
  TC_RESUME(u_uartc__DOT__u_frame)
  TC_RESUME(u_uartc__DOT__u_tx)
  TC_RESUME(u_uartc__DOT__u_tlm)
  TC_RESUME(u_sensc)
  TC_RESUME(u_algor__DOT__u_properties)
  TC_RESUME(u_pwmc)
  TC_RESUME(u_properties)
#undef TC_RESUME
}

template <class Root>
void store(Root& root, const chip::Chip& model) {
#define TC_FLOP(type, name, width, reset) \
  TC_ROOT(name) =                         \
      static_cast<std::remove_reference_t<decltype(TC_ROOT(name))>>(bits<width>(model.TC_MEMBER.name));
#define TC_ARRAY(type, name, count, width)                                                            \
  {                                                                                                   \
    const std::size_t before = words_before(model.TC_MEMBER.name, TC_ROOT(name));                     \
    for (std::size_t i = before; i < count; ++i) TC_ROOT(name)[i - before] = model.TC_MEMBER.name[i]; \
  }
#include "cmodel/for_each_flop.inc"
  // The generated chip has no assertions.
  if constexpr (requires { root.TC_PATH1(u_properties, past_ok_q); }) resume_assertions(root);
}

template <class Top>
class VerilatedTop : public VerilatedRtl {
 public:
  VerilatedTop() : top_(&context_) {
    context_.errorLimit(
        std::numeric_limits<int>::max());  // a failed assertion is told by step(), and ends no process
    top_.scan_en_i = 0;
    top_.scan_i = 0;
    apply({.rst_n = false});
    top_.clk_i = 0;
    top_.eval();
  }
  ~VerilatedTop() override {
    top_.final();
    // Verilator 5.006 unregisters an instance's scopes from the thread's context; that must be its own.
    Verilated::threadContextp(&context_);
  }

  chip::Outputs step(const chip::Inputs& in) override {
    apply(in);
    clock();
    if (context_.errorCount() != 0) throw AssertionFailed();
    return chip::take_outputs(top_);
  }

  bool flops_equal(const chip::Chip& model) const override { return equal(*top_.rootp, model); }
  std::vector<FlopDifference> differences(const chip::Chip& model) const override {
    return list_differences(*top_.rootp, model);
  }
  unsigned flop_bits() const override { return count_bits(*top_.rootp); }
  std::string name() const override { return "Verilated RTL"; }

  void load(const chip::Chip& model, const chip::Inputs& in) override {
    // Out of reset first, so that no reset edge follows and overwrites what is loaded. Verilator does not
    // expect flops to be written (flops.vlt): a repeated initial settling makes it recompute everything
    // behind them.
    apply(in);
    top_.eval();
    store(*top_.rootp, model);
    top_.rootp->vlSymsp->__Vm_didInit = false;
    top_.eval();
  }

  void set_assertions(bool on) override { context_.assertOn(on); }

 protected:
  virtual void clock() { rising_edge(top_); }
  void apply(const chip::Inputs& in) {
    // Each step begins here. Another instance, since gone, may have been the thread's.
    Verilated::threadContextp(&context_);
    chip::put_inputs(in, top_);
    if (!in.rst_n) top_.eval();  // asynchronous: acts before the clock edge
  }

  VerilatedContext context_;
  Top top_;
};

}  // namespace verilated

}  // namespace meltstage::tb
