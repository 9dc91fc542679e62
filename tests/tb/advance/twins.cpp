// SPDX-License-Identifier: Apache-2.0
#include "twins.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "base/rng.hpp"
#include "cmodel/advance.hpp"
#include "tb/pins/head.hpp"
#include "tb/trials/upset.hpp"

namespace meltstage::chip {
namespace {

// f(name, value, width) for each flop, an array's words one by one.
template <class Model, class F>
void visit_flops(Model& model, F&& f) {
#define TC_FLOP(type, name, width, reset) f(#name, model.TC_MEMBER.name, width);
#define TC_ARRAY(type, name, count, width) \
  for (auto& word : model.TC_MEMBER.name) f(#name, word, width);
#include "cmodel/for_each_flop.inc"
}

}  // namespace
}  // namespace meltstage::chip

namespace meltstage::tb {
namespace {

namespace spec = chip::spec;

struct PinChange {
  std::uint64_t cycle;
  chip::Inputs in;
  chip::Outputs out;
  friend bool operator==(const PinChange&, const PinChange&) = default;
};

// A chip, its surroundings and the pin changes since the last stop.
struct Twin {
  Head head;
  chip::Run run;
  std::vector<PinChange> changes;
  chip::Inputs in{.rst_n = false};
  chip::Outputs out{};
  std::uint64_t looks = 0;

  explicit Twin(const HeadConfig& config) : head(config) {}

  chip::Inputs step(std::uint64_t cycle, const chip::Outputs& pins) {
    ++looks;
    return head.step(cycle, pins);
  }
  std::uint64_t next_event() const { return head.next_event(); }

  void observe(std::uint64_t cycle, const chip::Inputs& now_in, const chip::Outputs& now_out) {
    if (now_in == in && now_out == out) return;
    in = now_in;
    out = now_out;
    changes.push_back({cycle, in, out});
  }
};

// A sensor as it stands in SENS_TYPE.
std::uint16_t sensor_type_of(std::uint64_t seed) {
  return static_cast<std::uint16_t>(1 + seed % (spec::kSensorPresets.size() - 1));
}

HeadConfig config_of(std::uint64_t seed) {
  HeadConfig config;
  config.sensor = std::string(spec::kSensorPresets[sensor_type_of(seed)].name);
  config.seed = seed;
  config.addr_strap = static_cast<std::uint8_t>(seed % 3 == 0 ? seed % 8 : 0);
  return config;
}

ModbusRequest write_of(Rng& rng, std::uint8_t unit) {
  const auto reg = static_cast<unsigned>(1 + rng.below(spec::kHoldingCount - 1));
  const spec::RegisterInfo& info = spec::kHolding[reg];
  const auto span = static_cast<std::uint64_t>(info.max - info.min) + 1;
  const auto value = static_cast<std::uint16_t>(info.min + static_cast<std::int64_t>(rng.below(span)));
  return write_single_register(unit, static_cast<std::uint16_t>(spec::kHoldingBase + reg), value);
}

// Both twins alike. Everything is drawn once.
class Fate {
 public:
  Fate(std::uint64_t seed, Twin& a, Twin& b)
      : rng_(stream(seed, "fate")),
        sensor_type_(sensor_type_of(seed)),
        calm_(seed % 2 == 0),
        twins_{&a, &b} {}

  // Clocks to the next stop: anything from one clock to a second.
  std::uint64_t clocks() {
    constexpr std::array<std::uint64_t, 8> kScales{4, 40, 300, 5'000, 20'000, 100'000, 200'000, 2'000'000};
    return 1 + rng_.below(kScales[rng_.below(kScales.size())]);
  }

  void strike() {
    const std::uint64_t cycle = twins_[0]->run.cycle;
    const bool idle = twins_[0]->run.chip.guard.run_q == 0;
    if (idle && one_in(3)) mend_and_heat(cycle);
    if (calm_ && !one_in(8)) return;
    switch (rng_.below(18)) {
      case 0:
      case 1:
        submit(write_of(rng_, unit()));
        break;
      case 2:
        command(spec::kCmdClearFault);
        command(spec::kCmdRun);
        break;
      case 4:
        command(one_in(3) ? spec::kCmdStop : spec::kCmdRun);
        break;
      case 5:
        submit(
            read_input_registers(unit(), 0, static_cast<std::uint16_t>(1 + rng_.below(spec::kInputCount))));
        break;
      case 6: {
        const std::uint64_t at = cycle + 1 + rng_.below(3'000);
        const std::uint64_t length = 1 + rng_.below(400);
        each([&](Twin& t) { t.head.host().transmitter().glitch(at, length); });
        break;
      }
      case 7: {
        const bool pressed = one_in(3);
        each([&](Twin& t) { t.head.set_inhibit(pressed); });
        break;
      }
      case 8: {
        const bool asserted = one_in(3);
        each([&](Twin& t) { t.head.set_reset(asserted); });
        break;
      }
      case 9: {
        constexpr std::array kProbes{ProbeFault::none, ProbeFault::none, ProbeFault::open,
                                     ProbeFault::short_to_ground};
        const SpiFaults faults{.probe = kProbes[rng_.below(kProbes.size())],
                               .miso = one_in(4) ? MisoFault::stuck_high : MisoFault::none};
        each([&](Twin& t) { t.head.sensor().set_faults(faults); });
        break;
      }
      case 10: {
        const HeaterFaults faults{.element_open = one_in(4), .switch_shorted = one_in(4)};
        each([&](Twin& t) { t.head.plant().set_faults(cycle, faults); });
        break;
      }
      case 11: {  // an upset of any flop, legal state or not
        const auto bit = static_cast<std::size_t>(rng_.below(flop_bits().size()));
        if (one_in(2)) each([&](Twin& t) { invert_flop_bit(t.run.chip, bit); });
        break;
      }
      case 12:
        submit(report_server_id(unit()));
        break;
      case 13: {
        const bool high = one_in(2);
        each([&](Twin& t) { t.head.set_drop(high); });
        break;
      }
      case 14:
        command(spec::kCmdTune);
        break;
      default:
        break;
    }
  }

 private:
  template <class F>
  void each(F&& f) {
    for (Twin* twin : twins_) f(*twin);
  }
  bool one_in(std::uint64_t n) { return rng_.below(n) == 0; }
  std::uint8_t unit() const { return twins_[0]->run.chip.uartc.address_q; }
  void submit(const ModbusRequest& request) {
    each([&](Twin& t) { t.head.host().submit(request); });
  }
  void command(std::uint16_t word) { submit(write_single_register(unit(), spec::kHoldingBase, word)); }

  // All is sound again, and the chip is put where it heats, so that PWM, ticks and telemetry come often.
  void mend_and_heat(std::uint64_t cycle) {
    const chip::Chip heating = heating_chip();
    each([&](Twin& t) {
      t.head.set_reset(false);
      t.head.set_inhibit(false);
      t.head.sensor().set_faults({});
      t.head.plant().set_faults(cycle, {});
      t.run.chip = heating;
      t.run.out = heating.outputs({});
    });
  }

  chip::Chip heating_chip() {
    chip::Chip chip;
    for (int i = 0; i < 4; ++i) chip.step({});  // the reset synchroniser lets go
    const auto set = [&](spec::Reg reg, std::uint64_t value) {
      chip.mem.preset(reg, static_cast<std::uint16_t>(value));
    };
    set(spec::kRegSensType, sensor_type_);
    set(spec::kRegTs, 10 + rng_.below(one_in(2) ? 20 : 200));
    set(spec::kRegPwmPeriod, 2 + rng_.below(one_in(2) ? 500 : 60'000));
    set(spec::kRegPwmPrescale, one_in(2) ? 0 : rng_.below(20));
    set(spec::kRegTlmPeriod, rng_.below(4));
    set(spec::kRegRampUp, one_in(2) ? 0 : 500);
    set(spec::kRegDtdtMax, 0);
    set(spec::kRegMode, rng_.below(2));
    set(spec::kRegManualDuty, rng_.below(10'000));
    set(spec::kRegSpiDiv, 2 + rng_.below(one_in(2) ? 4 : 200));
    set(spec::kRegFbTime, one_in(4) ? rng_.below(4) : 120);
    chip.sysctrl.state_q = spec::kStCfgPwm;
    chip.guard.pv_valid_q = 1;
    chip.guard.settled_q = 1;
    chip.guard.pv_q = 25 * 64;
    chip.guard.run_q = 1;
    chip.guard.run_nq = 0;
    return chip;
  }

  Rng rng_;
  std::uint16_t sensor_type_;
  bool calm_;  // little else than heating happens
  std::array<Twin*, 2> twins_;
};

std::string describe(const PinChange& change) {
  const auto& [cycle, in, out] = change;
  return fmt::format(
      "cycle {}: rst_n {:d} rx {:d} miso {:d} fb {:d} inhibit {:d} | tx {:d} de {:d} tlm {:d} sclk {:d} cs_n "
      "{:d} mosi {:d} heater {:d} "
      "safe_en {:d} fault_n {:d} at_temp {:d}",
      cycle, in.rst_n, in.uart_rx, in.spi_miso, in.heater_fb, in.inhibit, out.uart_tx, out.uart_de,
      out.tlm_tx, out.spi_sclk, out.spi_cs_n, out.spi_mosi, out.heater, out.safe_en, out.fault_n,
      out.at_temp);
}

void compare(std::uint64_t seed, const Twin& stepped, const Twin& advanced) {
  const auto [a, b] = std::mismatch(stepped.changes.begin(), stepped.changes.end(), advanced.changes.begin(),
                                    advanced.changes.end());
  if (a != stepped.changes.end() || b != advanced.changes.end()) {
    throw TwinsDiffer(fmt::format("seed {}: pin change\n  stepped  {}\n  advanced {}", seed,
                                  a != stepped.changes.end() ? describe(*a) : "none",
                                  b != advanced.changes.end() ? describe(*b) : "none"));
  }
  const std::string flops = different_flops(stepped.run.chip, advanced.run.chip);
  if (!flops.empty())
    throw TwinsDiffer(fmt::format("seed {}: at cycle {}\n{}", seed, stepped.run.cycle, flops));
  if (!(stepped.run.out == advanced.run.out))
    throw TwinsDiffer(fmt::format("seed {}: at cycle {} the pins that the caller is left with differ", seed,
                                  stepped.run.cycle));
}

}  // namespace

std::string different_flops(const chip::Chip& stepped, const chip::Chip& advanced) {
  std::vector<std::uint64_t> values;
  chip::visit_flops(stepped, [&](const char*, const auto& value, unsigned) {
    values.push_back(static_cast<std::uint64_t>(value));
  });
  std::string list;
  std::size_t i = 0;
  chip::visit_flops(advanced, [&](const char* name, const auto& value, unsigned) {
    const auto other = static_cast<std::uint64_t>(value);
    if (values[i] != other)
      list += fmt::format("  {} stepped {:#x} advanced {:#x}\n", name, values[i], other);
    ++i;
  });
  if (stepped.params().value != advanced.params().value) list += "  parameters beside the memory\n";
  return list;
}

TwinCount run_twins(std::uint64_t seed, std::uint64_t clocks) {
  Twin stepped(config_of(seed));
  Twin advanced(config_of(seed));
  Fate fate(seed, stepped, advanced);
  TwinCount count;
  while (stepped.run.cycle < clocks) {
    fate.strike();
    const std::uint64_t until = stepped.run.cycle + fate.clocks();
    chip::step_until(stepped.run, until, stepped, [&](auto... now) { stepped.observe(now...); });
    chip::advance(advanced.run, until, advanced, [&](auto... now) { advanced.observe(now...); });
    compare(seed, stepped, advanced);
    ++count.stops;
    count.pin_changes += stepped.changes.size();
    stepped.changes.clear();
    advanced.changes.clear();
  }
  count.clocks = stepped.run.cycle;
  count.looks = advanced.looks;
  return count;
}

}  // namespace meltstage::tb
