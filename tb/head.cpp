// SPDX-License-Identifier: Apache-2.0
#include "tb/head.hpp"

namespace meltstage::tb {

namespace {
constexpr double kClockHz = chip::spec::kClkHz;
constexpr std::uint64_t kPumpHoldClocks =
    chip::spec::kClkHz / 1000;  // the charge pump bridges 1 ms without an edge
}  // namespace

void Head::move_relay(std::uint64_t cycle, bool safe_en) {
  if (safe_en != safe_en_) {
    safe_en_ = safe_en;
    if (relay_opens_ < cycle || relay_opens_ == kNever) plant_.set_supply_ratio(cycle, 1.0);
    relay_opens_ = cycle + kPumpHoldClocks;
  } else {
    plant_.set_supply_ratio(cycle, 0.0);
    relay_opens_ = kNever;
  }
}

Head::Head(const HeadConfig& config)
    : plant_(config.plant, kClockHz),
      sensor_(make_spi_sensor(config.sensor,
                              {.clock_hz = kClockHz,
                               .source = [this](std::uint64_t cycle) { return plant_.sensor_degc(cycle); },
                               .noise_sigma_degc = config.sensor_noise_degc,
                               .noise = stream(config.seed, "sensor")})),
      host_({.line = {kClockHz, config.baud, config.format}}, stream(config.seed, "host")),
      telemetry_({kClockHz, config.baud, config.format}) {
  pins_.addr_strap = config.addr_strap;
  plant_.set_supply_ratio(0, 0.0);
}

}  // namespace meltstage::tb
