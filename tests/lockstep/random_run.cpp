// SPDX-License-Identifier: Apache-2.0
#include "random_run.hpp"

#include <algorithm>
#include <array>
#include <deque>
#include <vector>

#include "scenarios.hpp"
#include "tb/devices/rng.hpp"

namespace meltstage::tb {

namespace {

// Each kind of chance has its own sub-stream, so that a new kind does not shift the others.
struct Chances {
  explicit Chances(std::uint64_t seed)
      : host(stream(seed, "host")),
        line(stream(seed, "line-noise")),
        sensor(stream(seed, "sensor-faults")),
        plant(stream(seed, "plant")),
        reset(stream(seed, "reset")),
        upset(stream(seed, "upset")) {}
  Rng host, line, sensor, plant, reset, upset;
};

bool one_in(Rng& rng, std::uint64_t n) { return rng.below(n) == 0; }

std::uint16_t any16(Rng& rng) { return static_cast<std::uint16_t>(rng.bits()); }

// A value for a register: mostly inside its range, often at an end, sometimes anything.
std::uint16_t value_for(Rng& rng, unsigned index) {
  const spec::RegisterInfo& info = spec::kHolding[index];
  switch (rng.below(6)) {
    case 0:
      return static_cast<std::uint16_t>(info.min);
    case 1:
      return static_cast<std::uint16_t>(info.max);
    case 2:
      return any16(rng);
    default:
      return static_cast<std::uint16_t>(info.min + static_cast<std::int64_t>(rng.below(
                                                       static_cast<std::uint64_t>(info.max - info.min) + 1)));
  }
}

// Registers that a random host may write without slowing everything to a crawl.
bool writable(unsigned index) {
  return index != spec::kRegBaud && index != spec::kRegTs && index != spec::kRegSpiDiv;
}

constexpr std::array kCommands{spec::kCmdRun,  spec::kCmdRun,        spec::kCmdRun,
                               spec::kCmdStop, spec::kCmdClearFault, spec::kCmdClearFault,
                               spec::kCmdHold, spec::kCmdCommit,     spec::kCmdDiscard};

ModbusRequest random_request(Rng& rng, std::uint8_t unit) {
  const auto to = static_cast<std::uint8_t>(one_in(rng, 12) ? 0 : one_in(rng, 12) ? rng.below(256) : unit);
  switch (rng.below(14)) {
    case 0:
      return read_input_registers(to, static_cast<std::uint16_t>(rng.below(28)),
                                  static_cast<std::uint16_t>(rng.below(36)));
    case 1:
      return read_holding_registers(to, static_cast<std::uint16_t>(spec::kHoldingBase + rng.below(62)),
                                    static_cast<std::uint16_t>(rng.below(36)));
    case 2:
    case 3:
    case 4:
      return write_single_register(to, spec::kHoldingBase, kCommands[rng.below(kCommands.size())]);
    case 5:
    case 6:
    case 7: {
      unsigned index;
      do index = static_cast<unsigned>(rng.below(spec::kHoldingCount));
      while (!writable(index));
      return write_single_register(to, static_cast<std::uint16_t>(spec::kHoldingBase + index),
                                   value_for(rng, index));
    }
    case 8:
    case 9: {
      const unsigned first = 1 + static_cast<unsigned>(rng.below(spec::kRegTs - 1));
      std::vector<std::uint16_t> values;
      const unsigned count = 1 + static_cast<unsigned>(rng.below(std::min(16u, spec::kRegTs - first)));
      for (unsigned i = 0; i < count; ++i) values.push_back(value_for(rng, first + i));
      return write_multiple_registers(to, static_cast<std::uint16_t>(spec::kHoldingBase + first), values);
    }
    case 10:
      return diagnostic_echo(to, any16(rng));
    case 11:
      return report_server_id(to);
    case 12:
      return read_device_identification(to, static_cast<std::uint8_t>(rng.below(6)),
                                        static_cast<std::uint8_t>(rng.below(5)));
    default: {
      std::vector<std::uint8_t> bytes{to, static_cast<std::uint8_t>(rng.below(128))};
      for (std::uint64_t n = rng.below(9); n > 0; --n) bytes.push_back(static_cast<std::uint8_t>(rng.bits()));
      return with_crc(bytes);
    }
  }
}

// What a bad line does to a frame.
void damage(Rng& rng, ModbusRequest& request) {
  auto& frame = request.frame;
  switch (rng.below(7)) {
    case 0:
      frame[rng.below(frame.size())].data ^= static_cast<std::uint8_t>(1u << rng.below(8));
      break;
    case 1:
      frame.resize(1 + rng.below(frame.size()));
      break;
    case 2:
      frame[rng.below(frame.size())].gap_bits = static_cast<double>(rng.below(80));
      break;
    case 3:
      frame[rng.below(frame.size())].wrong_parity = true;
      break;
    case 4:
      frame[rng.below(frame.size())].missing_stop = true;
      break;
    case 5: {  // the next frame without a gap
      const ModbusRequest merged = read_input_registers(frame[0].data, 0, 1);
      frame.insert(frame.end(), merged.frame.begin(), merged.frame.end());
      break;
    }
    default:
      for (std::uint64_t n = 1 + rng.below(40); n > 0; --n)
        frame.push_back({.data = static_cast<std::uint8_t>(rng.bits())});
      break;
  }
}

// What a host sends that leaves the settings alone.
ModbusRequest attentive_request(Rng& rng, std::uint8_t unit) {
  switch (rng.below(4)) {
    case 0:
      return write_single_register(unit, spec::kHoldingBase, spec::kCmdClearFault);
    case 1:
      return write_single_register(unit, spec::kHoldingBase, spec::kCmdRun);
    default:
      return read_input_registers(unit, 0, spec::kInputCount);
  }
}

// What a host sends that wants the head to work: clear, run, poll, and settings that do not stand in their
// own way.
ModbusRequest orderly_request(Rng& rng, std::uint8_t unit) {
  switch (rng.below(12)) {
    case 0:
    case 1:
    case 2:
      return write_single_register(unit, spec::kHoldingBase, spec::kCmdClearFault);
    case 10:
    case 11:
      return write_single_register(unit, spec::kHoldingBase, spec::kCmdStop);
    case 3:
    case 4:
    case 5:
    case 6:
      return write_single_register(unit, spec::kHoldingBase, spec::kCmdRun);
    case 7:
      return write_single_register(unit, spec::kHoldingBase + spec::kRegSetpoint,
                                   static_cast<std::uint16_t>(400 + rng.below(600)));
    case 8:
      return write_single_register(unit, spec::kHoldingBase + spec::kRegMode,
                                   static_cast<std::uint16_t>(one_in(rng, 4)));
    default:
      return read_input_registers(unit, 0, spec::kInputCount);
  }
}

// A head that is at work near its set-point, or leaves it the way each detector is made for.
double head_temperature(Rng& rng) {
  constexpr std::array kPlaces{50.0, 55.0, 59.0, 60.5, 75.0, 99.0, -20.0, 190.0};
  return one_in(rng, 3) ? kPlaces[rng.below(kPlaces.size())] : 58.0 + 4.0 * rng.uniform();
}

void disturb_sensor(Rng& rng, World& world) {
  world.sensor = {};
  switch (rng.below(8)) {
    case 0:
      world.sensor.probe = ProbeFault::Open;
      break;
    case 1:
      world.sensor.probe = ProbeFault::ShortToGround;
      break;
    case 2:
      world.sensor.miso = MisoFault::StuckLow;
      break;
    case 3:
      world.sensor.miso = MisoFault::StuckHigh;
      break;
    case 4:
      world.sensor.reserved_bits_wrong = true;
      break;
    default:
      break;
  }
}

// Detectors with short times, so that each can trip within a run.
Settings detectors(std::uint64_t seed) {
  Settings settings = quick({{spec::kRegSetpoint, 600},
                             {spec::kRegLbaTime, 1},
                             {spec::kRegExcTime, 1},
                             {spec::kRegZeroWait, 2},
                             {spec::kRegZeroRise, 50},
                             {spec::kRegHostWd, 40},
                             {spec::kRegBadMax, 2},
                             {spec::kRegSampleTimeout, 2},
                             {spec::kRegAtDwell, 1},
                             {spec::kRegFbTime, 200},
                             {spec::kRegPwmPeriod, 600},
                             {spec::kRegTlmPeriod, 5},
                             {spec::kRegDFilter, 0},
                             {spec::kRegKd, 0},
                             {spec::kRegHoldMult, 0},
                             {spec::kRegHoldAdd, 0}});
  settings.push_back({spec::kRegDtdtMax, static_cast<std::uint16_t>(seed % 4 == 0 ? 100 : 0)});
  settings.push_back({spec::kRegCtrl, static_cast<std::uint16_t>(seed % 8 < 4 ? 0x37 : 0x72)});
  settings.push_back({spec::kRegBadMax, static_cast<std::uint16_t>(seed % 16 == 2 ? 15 : 2)});
  settings.push_back({spec::kRegHoldTime, static_cast<std::uint16_t>(seed % 8 == 6 ? 1 : 0)});
  settings.push_back({spec::kRegBandOff, 100});
  // Limits that the head meets exactly (head_temperature).
  settings.push_back({spec::kRegTMax, static_cast<std::uint16_t>(seed % 3 == 0 ? 1500 : 990)});
  settings.push_back({spec::kRegTMin, static_cast<std::uint16_t>(seed % 4 == 0 ? 500 : 0)});
  return settings;
}

// What the seeds are about, in turn.
enum class Kind : std::uint8_t {
  Anything,  // a host that sends whatever comes to its mind to a chip set up at random
  Orderly,   // a host that wants the head to work, detectors with short times
  Breaks,    // a host that leaves the settings alone; each fault scenario in turn breaks, and is mended
};

Kind kind_of(std::uint64_t seed) {
  constexpr std::array kKinds{Kind::Orderly, Kind::Anything, Kind::Breaks, Kind::Anything};
  return kKinds[seed % kKinds.size()];
}

Settings random_settings(std::uint64_t seed) {
  Rng rng = stream(seed, "settings");
  constexpr std::array<std::uint16_t, 4> kBauds{5000, 5000, 4000, 2304};
  Settings settings = quick({{spec::kRegBaud, kBauds[rng.below(kBauds.size())]},
                             {spec::kRegFormat, static_cast<std::uint16_t>(rng.below(4))},
                             {spec::kRegAddress, static_cast<std::uint16_t>(one_in(rng, 2) ? rng.below(248) : 0)},
                             {spec::kRegSpiDiv, static_cast<std::uint16_t>(2 + rng.below(6))},
                             {spec::kRegPwmPeriod, static_cast<std::uint16_t>(2 + rng.below(700))},
                             {spec::kRegPwmMinOn, static_cast<std::uint16_t>(rng.below(100))},
                             {spec::kRegPwmPrescale, static_cast<std::uint16_t>(rng.below(4))}});
  for (int i = 0; i < 8; ++i) {
    const auto index = static_cast<unsigned>(1 + rng.below(spec::kRegPwmPrescale - 1));
    const spec::RegisterInfo& info = spec::kHolding[index];
    if (!writable(index) || index == spec::kRegLock) continue;
    const auto span = static_cast<std::uint64_t>(info.max - info.min) + 1;
    settings.push_back({static_cast<spec::Reg>(index),
                        static_cast<std::uint16_t>(info.min + static_cast<std::int64_t>(rng.below(span)))});
  }
  return settings;
}

Settings with(const Settings& more) {
  Settings all = quick();
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

// One bit of a word of either set, sometimes two.
void flip_parameter(Rng& rng, Bench& bench) {
  const auto reg = static_cast<spec::Reg>(1 + rng.below(spec::kHoldingCount - 1));
  const std::uint32_t mask = 1u << rng.below(22) | (one_in(rng, 6) ? 1u << rng.below(22) : 0u);
  const bool staged = one_in(rng, 2);
  bench.poke([&](chip::Chip& chip) {
    if (staged) chip.mem.staged_q[reg] ^= mask;
    else flip_active(chip, reg, mask);
  });
}

// Time that mere waiting would fill: the next control tick, or the next 0.1 s with it, comes early.
void hurry(Rng& rng, Bench& bench) {
  bench.poke([&](chip::Chip& chip) {
    chip.sysctrl.ms_cnt_q = spec::kClkHz / 1000 - 3;
    if (one_in(rng, 2)) chip.sysctrl.tenth_cnt_q = 99;
    if (chip.sysctrl.tick_pend_q == 0)
      chip.sysctrl.ts_cnt_q = static_cast<std::uint16_t>((chip.params()[spec::kRegTs] - 1) & 0x7FF);
  });
}

// The host: sends when the line is free, most of the time politely.
class Host {
 public:
  Host(Bench& bench, Chances& chance, Kind kind) : bench_(bench), chance_(chance), kind_(kind) {}

  // A sequence is under way whose frames belong to one control period.
  bool in_sequence() const { return !sequence_.empty(); }
  // Sends nothing before `cycle`.
  void silent_until(std::uint64_t cycle) { next_frame_ = cycle; }

  void step() {
    // A host whose frame was not heard leaves the line alone until the chip has forgotten it (1.75 ms of
    // silence).
    const bool answered = bench_.model().uartc.messages() != heard_ || bench_.cycle() >= last_frame_ + 26'000;
    if (bench_.sending() || bench_.out().uart_de || bench_.cycle() < next_frame_ || !answered) return;
    heard_ = bench_.model().uartc.messages();
    last_frame_ = bench_.cycle();
    bench_.send(next_request());
    // Mostly a polite pause, sometimes on top of the answer, sometimes too long for the watchdog.
    next_frame_ = bench_.cycle() + (in_sequence()               ? 3'000
                                    : one_in(chance_.host, 20) ? 90'000
                                    : one_in(chance_.host, 6)  ? 500
                                                               : 4'000 + chance_.host.below(10'000));
  }

 private:
  ModbusRequest next_request() {
    if (kind_ == Kind::Anything && sequence_.empty() && one_in(chance_.host, 25)) begin_held_writes();
    if (in_sequence()) {
      ModbusRequest request = sequence_.front();
      sequence_.pop_front();
      return request;
    }
    ModbusRequest request = kind_ == Kind::Anything  ? random_request(chance_.host, bench_.unit())
                            : kind_ == Kind::Orderly ? orderly_request(chance_.host, bench_.unit())
                                                     : attentive_request(chance_.host, bench_.unit());
    if (one_in(chance_.line, kind_ == Kind::Anything ? 8 : 96)) damage(chance_.line, request);
    return request;
  }

  // Hold, a write, Commit, and a write that comes while the commit waits for its tick (exception 06); the read keeps the
  // sequence open until that one has been answered.
  void begin_held_writes() {
    const std::uint8_t unit = bench_.unit();
    const auto value = static_cast<std::uint16_t>(chance_.host.below(1'000));
    const auto at = [](spec::Reg reg) { return static_cast<std::uint16_t>(spec::kHoldingBase + reg); };
    for (const ModbusRequest& request :
         {write_single_register(unit, at(spec::kRegLock), 0), write_single_register(unit, at(spec::kRegCmd), spec::kCmdHold),
          write_single_register(unit, at(spec::kRegAtDwell), value),
          write_single_register(unit, at(spec::kRegCmd), spec::kCmdCommit),
          write_single_register(unit, at(spec::kRegKp), value), read_input_registers(unit, 0, 1)}) {
      sequence_.push_back(request);
    }
  }

  Bench& bench_;
  Chances& chance_;
  Kind kind_;
  std::deque<ModbusRequest> sequence_;
  std::uint64_t next_frame_ = 0;
  std::uint64_t last_frame_ = 0;
  std::uint16_t heard_ = 0;
};

// What befalls the chip and its surroundings at any moment.
void befall(Chances& chance, Bench& bench, Kind kind) {
  const std::uint64_t calm = kind == Kind::Anything ? 1 : 12;  // so many times more rarely
  if (one_in(chance.line, 40 * calm))
    bench.transmitter().glitch(bench.cycle() + 1 + chance.line.below(500), 1 + chance.line.below(30));
  if (one_in(chance.sensor, 120)) disturb_sensor(chance.sensor, bench.world);
  if (one_in(chance.sensor, 40)) bench.world.sensor = {};
  if (one_in(chance.sensor, 60)) bench.sensor().corrupt_next_frame(1u << chance.sensor.below(32));
  if (one_in(chance.sensor, 200)) bench.world.feedback = static_cast<Feedback>(chance.sensor.below(3));
  if (one_in(chance.sensor, 20)) bench.world.feedback = Feedback::Follows;
  if (one_in(chance.reset, 400)) bench.world.inhibit = true;
  if (one_in(chance.reset, 4)) bench.world.inhibit = false;
  if (one_in(chance.upset, 60 * calm)) flip_parameter(chance.upset, bench);
  if (one_in(chance.upset, 500)) {
    bench.poke([&](chip::Chip& chip) {
      chip.sysctrl.state_q ^= static_cast<std::uint8_t>(1u << chance.upset.below(5));
    });
  }
  if (one_in(chance.reset, 600)) {
    bench.world.addr_strap = static_cast<std::uint8_t>(chance.reset.below(8));
    bench.world.reset = true;
    bench.run(1 + chance.reset.below(5));
    bench.world.reset = false;
    bench.run(4);  // the reset synchroniser lets go before anything pokes at the state
  }
}

void move_temperature(Chances& chance, Bench& bench, Kind kind) {
  if (!one_in(chance.plant, 8)) return;
  double& degc = bench.world.temperature_degc;
  degc = kind == Kind::Orderly ? head_temperature(chance.plant)
                               : std::clamp(degc + (chance.plant.uniform() - 0.5) * 8.0, -30.0, 200.0);
}

// Fault scenarios one after another, each on a chip set up for it: sound, broken at some moment, mended at another.
class Breakdowns {
 public:
  Breakdowns(Bench& bench, Chances& chance, Host& host, std::uint64_t seed)
      : bench_(bench), chance_(chance), host_(host), next_(static_cast<std::size_t>(seed) * 7) {}

  void step() {
    if (bench_.cycle() < until_) return;
    switch (phase_++) {
      case 0:
        begin();
        break;
      case 1:
        scenario_->broken(bench_);
        // A watchdog needs a host that says nothing.
        if (scenario_->fault == spec::kFaultHostWatchdog) host_.silent_until(bench_.cycle() + 40'000);
        break;
      default:
        scenario_->mend(bench_);
        phase_ = 0;
        break;
    }
    until_ = bench_.cycle() + 15'000 + chance_.plant.below(20'000);
  }

 private:
  void begin() {
    const auto& all = fault_scenarios();
    scenario_ = &all[next_++ % all.size()];
    bench_.world = World{};
    bench_.poke([&](chip::Chip& chip) { chip = chip_with(with(scenario_->settings)); });
    scenario_->sound(bench_);
    bench_.next_tick();
    if (scenario_->heating) bench_.command(spec::kCmdRun);
  }

  Bench& bench_;
  Chances& chance_;
  Host& host_;
  const FaultScenario* scenario_ = nullptr;
  std::size_t next_;
  int phase_ = 0;
  std::uint64_t until_ = 0;
};

}  // namespace

chip::Chip random_start(std::uint64_t seed) {
  switch (kind_of(seed)) {
    case Kind::Anything:
      return chip_with(random_settings(seed));
    case Kind::Orderly:
      return chip_with(detectors(seed / 2));
    default:
      return chip_with(quick());
  }
}

RandomRun random_run(std::unique_ptr<Device> device, std::uint64_t seed, std::uint64_t clocks) {
  const Kind kind = kind_of(seed);
  Chances chance(seed);
  Bench bench(std::move(device), "MAX31855", seed);
  bench.world.temperature_degc = 50.0;
  Host host(bench, chance, kind);
  Breakdowns breakdowns(bench, chance, host, seed / 4);
  while (bench.cycle() < clocks) {
    if (kind == Kind::Breaks) {
      breakdowns.step();
    } else {
      befall(chance, bench, kind);
      move_temperature(chance, bench, kind);
    }
    host.step();
    if (!host.in_sequence() && one_in(chance.plant, 3)) hurry(chance.plant, bench);
    bench.run(1 + chance.plant.below(1'500));
  }
  return {bench.coverage(), bench.finish(), bench.stimulus_hash()};
}

}  // namespace meltstage::tb
