// SPDX-License-Identifier: Apache-2.0
// A push button without its bounces: the output takes the button's level once that has stood for hold_i + 1
// clocks.
#include <cstdint>

#include "hls/interface.hpp"

struct State {
  std::uint8_t level_q;    // the button in the clock before
  std::uint8_t steady_q;   // clocks for which it has stood, at most 15
  std::uint8_t pressed_q;  // the output
};
struct Inputs {
  std::uint8_t rst_ni, button_i, hold_i;
};
struct Outputs {
  std::uint8_t pressed_o;
};

extern "C" {
void hls_reset(State* state) { *state = {}; }

void hls_step(State* state, const Inputs* in) {
  if (in->rst_ni == 0) return hls_reset(state);
  if (in->button_i != state->level_q) {
    state->steady_q = 0;
  } else if (state->steady_q < 15) {
    ++state->steady_q;
  }
  if (state->steady_q > in->hold_i) state->pressed_q = in->button_i;
  state->level_q = in->button_i;
}

void hls_outputs(const State* state, const Inputs*, Outputs* out) { out->pressed_o = state->pressed_q; }

extern const meltstage::hls::Field hls_flops[] = {HLS_FIELD(State, level_q, 1), HLS_FIELD(State, steady_q, 4),
                                                  HLS_FIELD(State, pressed_q, 1)};
extern const meltstage::hls::Field hls_input_pins[] = {
    HLS_FIELD(Inputs, rst_ni, 1), HLS_FIELD(Inputs, button_i, 1), HLS_FIELD(Inputs, hold_i, 4)};
extern const meltstage::hls::Field hls_output_pins[] = {HLS_FIELD(Outputs, pressed_o, 1)};
}
