// SPDX-License-Identifier: Apache-2.0
// The closed forms of idle time as circuits, to be compared (docs/verify/proof.md): n clocks at once, and
// with TC_STEPPED the last one of them by step(). n is a pin of TC_CLOCKS_BITS bits.
//
// Where the two are equal for each n from 1 to N, n clocks at once are n steps for each n to N: by induction,
// as one clock at once is a step, and n at once are n - 1 at once and a step.
#include "hls/chip/chip_tables.hpp"

#ifndef TC_CLOCKS_BITS
#define TC_CLOCKS_BITS 2
#endif

namespace {

struct InputPins {
  Inputs of_model;
  std::uint32_t clocks;
};

struct OutputPins {
  std::uint8_t none;
};

}  // namespace

extern "C" {

void hls_reset(Chip* chip) { *chip = Chip{}; }

// Nothing happens where so many clocks are not quiet.
void hls_step(Chip* chip, const InputPins* in) {
  chip->mem.refresh_params();  // no flops, but what follows from them
  const std::uint64_t clocks = in->clocks;
  if (clocks == 0 || chip->quiet(in->of_model) < clocks) return;
#ifdef TC_STEPPED
  if (clocks > 1) chip->skip(in->of_model, clocks - 1);
  chip->step(in->of_model);
#else
  chip->skip(in->of_model, clocks);
#endif
}

void hls_outputs(const Chip*, const InputPins*, OutputPins* out) { out->none = 0; }

extern const meltstage::hls::Field hls_input_pins[] = {
#define TC_PIN(port, member, bits) \
  meltstage::hls::field<decltype(Inputs::member)>(#port, offsetof(InputPins, of_model.member), bits),
    TC_INPUT_PINS(TC_PIN) TC_TEST_PINS(TC_PIN)
#undef TC_PIN
        meltstage::hls::field<std::uint32_t>("clocks_i", offsetof(InputPins, clocks), TC_CLOCKS_BITS)};
extern const meltstage::hls::Field hls_output_pins[] = {HLS_FIELD(OutputPins, none, 1)};
}
