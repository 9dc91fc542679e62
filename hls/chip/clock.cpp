// SPDX-License-Identifier: Apache-2.0
// The model of the chip as a circuit: its pins, one clock.
#include "hls/chip/chip_tables.hpp"

namespace {

// With the pins of scan, which act when scan insertion has put chains between them.
struct InputPins {
  Inputs of_model;
  std::uint8_t scan_en;
  std::uint8_t scan;
};

// Outputs of pins.hpp are single bits, which have no address.
struct OutputPins {
#define TC_OUTPUT_MEMBER(port, member, bits) std::uint8_t member;
  TC_OUTPUT_PINS(TC_OUTPUT_MEMBER)
#undef TC_OUTPUT_MEMBER
  std::uint8_t scan;
};

}  // namespace

extern "C" {

void hls_reset(Chip* chip) { *chip = Chip{}; }

void hls_step(Chip* chip, const InputPins* in) {
  chip->mem.refresh_params();  // no flops, but what follows from them
  chip->step(in->of_model);
}

// The reset behind the reset synchroniser, which Chip::step() has, too.
void hls_in_reset(const Chip* chip, const InputPins* in, std::uint8_t* in_reset) {
  const Inputs& pins = in->of_model;
  *in_reset = pins.rst_n && (chip->rst_sync.rst_n() || pins.test_mode) ? 0 : 1;
}

void hls_outputs(const Chip* chip, const InputPins* in, OutputPins* out) {
  const meltstage::chip::Outputs pins = chip->outputs(in->of_model);
#define TC_COPY(port, member, bits) out->member = pins.member;
  TC_OUTPUT_PINS(TC_COPY)
#undef TC_COPY
  out->scan = 0;
}

extern const meltstage::hls::Field hls_input_pins[] = {
#define TC_PIN(port, member, bits) \
  meltstage::hls::field<decltype(Inputs::member)>(#port, offsetof(InputPins, of_model.member), bits),
    TC_INPUT_PINS(TC_PIN) TC_TEST_PINS(TC_PIN)
#undef TC_PIN
        meltstage::hls::field<std::uint8_t>("scan_en_i", offsetof(InputPins, scan_en), 1),
    meltstage::hls::field<std::uint8_t>("scan_i", offsetof(InputPins, scan), spec::kScanChains),
};
extern const meltstage::hls::Field hls_output_pins[] = {
#define TC_PIN(port, member, bits) \
  meltstage::hls::field<std::uint8_t>(#port, offsetof(OutputPins, member), bits),
    TC_OUTPUT_PINS(TC_PIN)
#undef TC_PIN
        meltstage::hls::field<std::uint8_t>("scan_o", offsetof(OutputPins, scan), spec::kScanChains),
};
}
