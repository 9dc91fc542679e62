// SPDX-License-Identifier: Apache-2.0
// replay_chip RECORDING: the chip's recorded pins (.mvec, docs/make/formats/mvec.md) on the netlist that was
// read back from the board's bitstream, each output compared before each clock. Exits with 1 on a mismatch, 2
// when the recording can't be used.
#include <cstdint>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

#include "Vbitstream.h"
#include "cmodel/pins.hpp"
#include "recording/stream.hpp"
#include "recording/text.hpp"
#include "tb/pins/chip_pins.hpp"

using meltstage::chip::Inputs;
using meltstage::chip::Outputs;
using meltstage::recording::Cursor;
using meltstage::recording::Stream;
using meltstage::tb::before_clock;
using meltstage::tb::chip_pin_header;
using meltstage::tb::inputs_of;
using meltstage::tb::output_difference;
using meltstage::tb::outputs_of;

namespace {

constexpr std::uint64_t kEnough = 1000;  // mismatches that end a run
constexpr int kLoadClocks = 32;          // the board holds reset while it counts to 15 after loading

// The board has its switches to ground: low is on.
template <class Board>
void set_pins(Board& board, const Inputs& in) {
#define TC_PUT(port, member, bits) \
  if constexpr (requires { board.port; }) board.port = in.member;
  TC_INPUT_PINS(TC_PUT)
#undef TC_PUT
  board.strap_ni_0_ = !(in.addr_strap & 1);
  board.strap_ni_1_ = !(in.addr_strap >> 1 & 1);
  board.strap_ni_2_ = !(in.addr_strap >> 2 & 1);
  board.test_mode_ni = !in.test_mode;
}

int replay(const char* path) {
  const Stream recording = meltstage::recording::read_text(path);
  if (recording.header().pins != chip_pin_header("").pins)
    throw std::runtime_error(
        "the recording has other pins, expected the chip's, as `meltstage dft functional --board` records "
        "them");

  Vbitstream board;
  const auto clock = [&board] {
    board.eval();
    board.clk_i = 1;
    board.eval();
    board.clk_i = 0;
    board.eval();
  };
  board.rst_ni = 0;
  for (int i = 0; i < kLoadClocks; ++i) clock();

  Outputs left = meltstage::chip::take_outputs(board);
  Cursor at(recording);
  std::uint64_t clocks = 0, mismatches = 0;
  do {
    const Inputs in = inputs_of(at.values());
    const Outputs out = before_clock(left, in);
    set_pins(board, in);
    clock();
    left = meltstage::chip::take_outputs(board);
    const Outputs recorded = outputs_of(at.values());
    if (out != recorded && ++mismatches <= 3)
      std::printf("clock %llu: %s\n", static_cast<unsigned long long>(at.cycle()),
                  output_difference(recorded, out).c_str());
    ++clocks;
  } while (mismatches < kEnough && at.step());
  std::printf("%llu clocks of the chip's recorded pins, %llu mismatches\n",
              static_cast<unsigned long long>(clocks), static_cast<unsigned long long>(mismatches));
  return mismatches == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc != 2)
      throw std::runtime_error("found " + std::to_string(argc - 1) + " arguments, expected RECORDING");
    return replay(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "replay_chip: %s\n", error.what());
    return 2;
  }
}
