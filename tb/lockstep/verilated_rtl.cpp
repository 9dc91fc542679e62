// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/verilated_rtl.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <verilated_cov.h>
#include <verilated_fst_c.h>

#include <atomic>
#include <cstdlib>

#include "Vtc_top.h"
#include "Vtc_top__Syms.h"
#include "Vtc_top___024root.h"
#include "Vtc_top_traced.h"
#include "Vtc_top_traced__Syms.h"
#include "Vtc_top_traced___024root.h"
#include "base/error.hpp"
#include "tb/lockstep/verilated_top.hpp"

namespace meltstage::tb {

namespace {

class TracedTop final : public verilated::VerilatedTop<Vtc_top_traced> {
 public:
  explicit TracedTop(const std::filesystem::path& path) {
    context_.traceEverOn(true);
    top_.trace(&trace_, 99);
    trace_.open(path.c_str());
    if (!trace_.isOpen())
      throw UserError(path.string() + ": cannot be written, expected a path for waves (FST)");
  }
  ~TracedTop() override { trace_.close(); }

 protected:
  // Waves show both edges.
  void clock() override {
    for (const bool level : {true, false}) {
      top_.clk_i = level;
      top_.eval();
      trace_.dump(half_cycles_++);
    }
  }

 private:
  VerilatedFstC trace_;
  std::uint64_t half_cycles_ = 0;
};

#ifdef COUNT_RTL_LINES
// Leaves what it has counted in the folder RTL_COVERAGE, a file each; tests/coverage/measure.sh adds them up.
class PlainTop final : public verilated::VerilatedTop<Vtc_top> {
 public:
  ~PlainTop() override {
    static std::atomic<unsigned> number = 0;
    if (const char* folder = std::getenv("RTL_COVERAGE"))
      context_.coveragep()->write(fmt::format("{}/{}-{}.dat", folder, getpid(), number++).c_str());
  }
};
#else
using PlainTop = verilated::VerilatedTop<Vtc_top>;
#endif

}  // namespace

std::unique_ptr<VerilatedRtl> make_verilated_rtl() { return std::make_unique<PlainTop>(); }
std::unique_ptr<VerilatedRtl> make_traced_rtl(const std::filesystem::path& path) {
  return std::make_unique<TracedTop>(path);
}

}  // namespace meltstage::tb
