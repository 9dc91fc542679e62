// SPDX-License-Identifier: Apache-2.0
#include "tb/pins/head.hpp"

namespace meltstage::tb {

namespace {
constexpr double kPumpHold_s = 1e-3;  // the charge pump bridges that without an edge
}  // namespace

void Head::move_relay(std::uint64_t cycle, bool safe_en) {
  if (safe_en != safe_en_) {
    safe_en_ = safe_en;
    if (relay_opens_ < cycle || relay_opens_ == kNoEvent) plant_.set_supply_ratio(cycle, supply_ratio_);
    relay_opens_ = cycle + pump_hold_clocks_;
  } else {
    plant_.set_supply_ratio(cycle, 0.0);
    relay_opens_ = kNoEvent;
  }
}

void Head::set_supply_ratio(std::uint64_t cycle, double ratio) {
  supply_ratio_ = ratio;
  const bool closed = !second_switch_ || (relay_opens_ != 0 && relay_opens_ != kNoEvent);
  if (closed) plant_.set_supply_ratio(cycle, ratio);
}

Head::Head(const HeadConfig& config)
    : pump_hold_clocks_(static_cast<std::uint64_t>(kPumpHold_s * config.clock_hz)),
      plant_(config.plant, config.clock_hz),
      second_switch_(config.second_switch),
      sensor_(make_spi_sensor(config.sensor,
                              {.clock_hz = config.clock_hz,
                               .source = [this](std::uint64_t cycle) { return element_degc(cycle); },
                               .noise_sigma_degc = config.sensor_noise_degc,
                               .noise = stream(config.seed, "sensor"),
                               .conversion_s = config.conversion_s})),
      host_({.line = {config.clock_hz, config.baud, config.format}}, stream(config.seed, "host")),
      telemetry_({config.clock_hz, config.baud, config.format}) {
  pins_.addr_strap = config.addr_strap;
  if (second_switch_) {
    plant_.set_supply_ratio(0, 0.0);
  } else {
    relay_opens_ = kNoEvent;
  }
}

}  // namespace meltstage::tb
