// SPDX-License-Identifier: Apache-2.0
#include "tb/lockstep/verilated_rtl.hpp"

#include <verilated_fst_c.h>

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

}  // namespace

std::unique_ptr<VerilatedRtl> make_verilated_rtl() {
  return std::make_unique<verilated::VerilatedTop<Vtc_top>>();
}
std::unique_ptr<VerilatedRtl> make_traced_rtl(const std::filesystem::path& path) {
  return std::make_unique<TracedTop>(path);
}

}  // namespace meltstage::tb
