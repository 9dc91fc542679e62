// SPDX-License-Identifier: Apache-2.0
#include "tb/head.hpp"

namespace meltstage::tb {

namespace {
constexpr double kClockHz = chip::spec::kClkHz;
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
}

}  // namespace meltstage::tb
