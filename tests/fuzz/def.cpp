// SPDX-License-Identifier: Apache-2.0
#include "asic/layout/db/design.hpp"
#include "tests/fuzz/entry.hpp"

namespace {

using namespace meltstage::layout;

constexpr const char* kLef = R"(LAYER m1 TYPE ROUTING ; DIRECTION HORIZONTAL ; PITCH 1 ; WIDTH 0.3 ; END m1
LAYER v1 TYPE CUT ; END v1
LAYER m2 TYPE ROUTING ; DIRECTION VERTICAL ; PITCH 0.8 ; WIDTH 0.3 ; END m2
VIA M2_M1 DEFAULT LAYER m1 ; RECT -0.2 -0.2 0.2 0.2 ; LAYER v1 ; RECT -0.1 -0.1 0.1 0.1 ; LAYER m2 ; RECT -0.2 -0.2 0.2 0.2 ; END M2_M1
SITE core SIZE 0.8 BY 10 ; END core
MACRO INV SIZE 1.6 BY 10 ; PIN A DIRECTION INPUT ; PORT LAYER m1 ; RECT 0 1 0.4 2 ; END END A
PIN Y DIRECTION OUTPUT ; PORT LAYER m1 ; RECT 1 1 1.4 2 ; END END Y END INV
END LIBRARY
)";

const Technology& technology() {
  static const Technology read = [] {
    Technology made;
    parse_lef(kLef, "fuzz.lef", made);
    return made;
  }();
  return read;
}

}  // namespace

extern "C" int FUZZ_ENTRY(const std::uint8_t* data, std::size_t size) {
  return meltstage::reads_or_refuses(data, size, [](std::string_view text) {
    const Design design = parse_def(text, "fuzz.def", technology());
    def_text(design, technology());
    verilog_text(design, technology());
  });
}
