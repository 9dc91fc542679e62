// SPDX-License-Identifier: Apache-2.0
// replay_chip RECORDING: the chip's recorded pins (.mvec, docs/make/formats/mvec.md) on the netlist that was
// read back from the board's bitstream, each output compared behind each clock. Exits with 1 on a mismatch, 2
// when the recording can't be used.
#include <cstdint>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

#include "Vbitstream.h"
#include "recording/stream.hpp"
#include "recording/text.hpp"

using meltstage::recording::Cursor;
using meltstage::recording::Header;
using meltstage::recording::Stream;

namespace {

constexpr std::uint64_t kEnough = 1000;  // mismatches that end a run
constexpr int kLoadClocks = 32;          // the board holds reset while it counts to 15 after loading

struct Input {
  const char* name;
  void (*set)(Vbitstream& board, std::uint64_t level);
};
struct Output {
  const char* name;
  bool (*get)(const Vbitstream& board);
};

#define BOARD_INPUT(pin)                                                          \
  {                                                                               \
#pin, [](Vbitstream & board, std::uint64_t level) { board.pin = level != 0; } \
  }
#define BOARD_OUTPUT(pin)                                        \
  {                                                              \
#pin, [](const Vbitstream& board) { return board.pin != 0; } \
  }

const Input kInputs[] = {
    BOARD_INPUT(rst_ni),
    BOARD_INPUT(uart_rx_i),
    BOARD_INPUT(spi_miso_i),
    BOARD_INPUT(heater_fb_i),
    BOARD_INPUT(inhibit_i),
    BOARD_INPUT(drop_i),
    {"addr_strap_i",
     [](Vbitstream& board, std::uint64_t level) {
       board.strap_ni_0_ = !(level & 1);
       board.strap_ni_1_ = !(level >> 1 & 1);
       board.strap_ni_2_ = !(level >> 2 & 1);
     }},
    {"test_mode_i", [](Vbitstream& board, std::uint64_t level) { board.test_mode_ni = level == 0; }},
};
const Output kOutputs[] = {
    BOARD_OUTPUT(uart_tx_o), BOARD_OUTPUT(uart_de_o),  BOARD_OUTPUT(tlm_tx_o), BOARD_OUTPUT(spi_sclk_o),
    BOARD_OUTPUT(spi_cs_no), BOARD_OUTPUT(spi_mosi_o), BOARD_OUTPUT(heater_o), BOARD_OUTPUT(safe_en_o),
    BOARD_OUTPUT(fault_no),  BOARD_OUTPUT(at_temp_o),
};

std::uint32_t pin_named(const Header& header, const std::string& name) {
  for (std::uint32_t pin = 0; pin < header.pins.size(); ++pin)
    if (header.pins[pin].name == name) return pin;
  throw std::runtime_error("the recording has no pin " + name +
                           ", expected the chip's pins, as `meltstage dft functional --board` records them");
}

int replay(const char* path) {
  const Stream recording = meltstage::recording::read_text(path);
  std::vector<std::uint32_t> inputs, outputs;
  for (const Input& input : kInputs) inputs.push_back(pin_named(recording.header(), input.name));
  for (const Output& output : kOutputs) outputs.push_back(pin_named(recording.header(), output.name));

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

  Cursor at(recording);
  std::uint64_t clocks = 0, mismatches = 0;
  do {
    for (std::size_t i = 0; i < inputs.size(); ++i) kInputs[i].set(board, at.value(inputs[i]));
    clock();
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      const bool recorded = at.value(outputs[i]) != 0;
      if (kOutputs[i].get(board) == recorded) continue;
      if (++mismatches <= 3)
        std::printf("clock %llu: %s is %d, recorded %d\n", static_cast<unsigned long long>(at.cycle()),
                    kOutputs[i].name, !recorded, recorded);
    }
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
