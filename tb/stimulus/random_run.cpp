// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/random_run.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <deque>
#include <optional>
#include <vector>

#include "base/rng.hpp"
#include "tb/stimulus/random_kinds.hpp"
#include "tb/stimulus/scenarios.hpp"

namespace meltstage::tb {

namespace {

// Each kind of chance has its own sub-stream, so that a new kind does not shift the others.
struct Chances {
  explicit Chances(std::uint64_t seed)
      : host(stream(seed, "host")),
        line(stream(seed, "line-noise")),
        sensor(stream(seed, "sensor-faults")),
        inhibit(stream(seed, "inhibit")),
        drop(stream(seed, "droplets")),
        plant(stream(seed, "plant")),
        time(stream(seed, "time")),
        reset(stream(seed, "reset")),
        upset(stream(seed, "upset")),
        flip(stream(seed, "flip")),
        test_mode(stream(seed, "test-mode")) {}
  Rng host, line, sensor, inhibit, drop, plant, time, reset, upset, flip, test_mode;
};

void write_words(chip::Chip& chip, const Settings& settings) {
  for (const Setting& s : settings) chip.mem.preset(s.reg, s.value);
}

// ---- What happens at any moment ---------------------------------------------------------------------------

void disturb_sensor(Rng& rng, World& world) {
  world.sensor = {};
  switch (rng.below(8)) {
    case 0:
      world.sensor.probe = ProbeFault::open;
      break;
    case 1:
      world.sensor.probe = ProbeFault::short_to_ground;
      break;
    case 2:
      world.sensor.miso = MisoFault::stuck_low;
      break;
    case 3:
      world.sensor.miso = MisoFault::stuck_high;
      break;
    case 4:
      world.sensor.reserved_bits_wrong = true;
      break;
    default:
      break;
  }
}

// No flip stands in this set: each row and each column is even, columns counted from the reset values.
bool is_even(const decltype(chip::Mem::staged_q)& set) {
  static const chip::Mem reset;
  std::uint32_t columns = 0;
  for (std::size_t i = 0; i < set.size(); ++i) {
    if (std::popcount(set[i]) % 2 != 0) return false;
    columns ^= set[i] ^ reset.staged_q[i];
  }
  return columns == 0;
}

// Flips in the parameter memory; what is beyond repair is written anew some time later.
class Flips {
 public:
  Flips(Bench& bench, Rng& rng) : bench_(bench), rng_(rng) {}

  void step() {
    // Two of them in different words between two passes are beyond repair too: not before the last is mended.
    if (one_in(rng_, 60) && is_even(bench_.model().mem.staged_q) && is_even(bench_.model().mem.active_q))
      flip();
    if (sound_ && one_in(rng_, 20)) write_anew();
  }

 private:
  // One bit of a word of either set, sometimes two; half of the time one of the lowest bits. Of PWM_PERIOD,
  // which MEM hands out corrected, only two make a difference.
  void flip() {
    const auto any = static_cast<spec::Reg>(1 + rng_.below(spec::kHoldingCount - 1));
    const spec::Reg reg = one_in(rng_, 3) ? spec::kRegPwmPeriod : any;
    const bool period = reg == spec::kRegPwmPeriod;
    const std::uint32_t second =
        !one_in(rng_, period ? 2 : 12) ? 0u : 1u << (period ? 16 + rng_.below(6) : rng_.below(22));
    const std::uint32_t mask =
        (1u << rng_.below(one_in(rng_, 2) ? 2 : 22) | second) & spec::kHolding[reg].stored;
    const bool staged = one_in(rng_, 2);
    if (second != 0 && !sound_) sound_ = bench_.model().mem;
    bench_.poke([&](chip::Chip& chip) {
      if (staged)
        chip.mem.staged_q[reg] ^= mask;
      else
        flip_active(chip, reg, mask);
    });
  }

  void write_anew() {
    bench_.poke([&](chip::Chip& chip) {
      chip.mem.staged_q = sound_->staged_q;
      chip.mem.active_q = sound_->active_q;
      chip.mem.refresh_params();
    });
    sound_.reset();
  }

  Bench& bench_;
  Rng& rng_;
  std::optional<chip::Mem> sound_;
};

// Time that mere waiting would fill: the next control tick, or the next 0.1 s with it, comes early.
void hurry(Rng& rng, Bench& bench) {
  bench.poke([&](chip::Chip& chip) {
    chip.sysctrl.ms_cnt_q = spec::kClkHz / 1000 - 3;
    if (one_in(rng, 2)) chip.sysctrl.tenth_cnt_q = 99;
    if (chip.sysctrl.tick_pend_q == 0)
      chip.sysctrl.ts_cnt_q = static_cast<std::uint16_t>((chip.params()[spec::kRegTs] - 1) & 0x7FF);
  });
}

// The silence after a bad frame ends early.
void hurry_line(Bench& bench) {
  const chip::UartRx& rx = bench.model().uartc.rx;
  if (bench.sending() || rx.gap_q != 0 || rx.quiet_q < 10) return;
  bench.poke([](chip::Chip& chip) { chip.uartc.rx.quiet_q = 3; });
}

// The next two ticks come so early that the second finds the first not finished.
void be_late(Bench& bench) {
  const auto reads = [](const chip::Chip& chip) { return chip.sysctrl.state_q == spec::kStReadTemp; };
  if (!bench.run_until(reads, 3'000)) return;
  bench.poke([](chip::Chip& chip) {
    chip.sysctrl.tick_pend_q = 1;
    chip.sysctrl.ms_cnt_q = spec::kClkHz / 1000 - 3;
    chip.sysctrl.ts_cnt_q = static_cast<std::uint16_t>((chip.params()[spec::kRegTs] - 1) & 0x7FF);
  });
}

// Counters as they stand after a long time, just before their top.
void age(Rng& rng, Bench& bench) {
  static constexpr void (*kAges[])(chip::Chip&) = {
      [](chip::Chip& c) { c.guard.samples_q = 0xFFFE; },
      [](chip::Chip& c) { c.guard.sensor_errors_q = 0xFFFE; },
      [](chip::Chip& c) {
        if (c.params()[spec::kRegBadMax] == 15) c.guard.bad_q = 14;
      },
      [](chip::Chip& c) { c.guard.zero_q = 0xFFFE; },
      [](chip::Chip& c) { c.guard.at_q = 0xFFFE; },
      [](chip::Chip& c) { c.mem.corrected_q = 0xFFFE; },
      [](chip::Chip& c) { c.algor.drops_q = 254; },
      [](chip::Chip& c) { c.quality.since_q = 0xFFFE; },
      [](chip::Chip& c) {
        c.quality.clocks_q = spec::kClkHz / 10 - 2;
        c.quality.on_q = 0xFFFFFFFF;
      },
      [](chip::Chip& c) { c.uartc.frame.messages_q = 0xFFFE; },
      [](chip::Chip& c) { c.uartc.frame.crc_errors_q = 0xFFFE; },
      [](chip::Chip& c) { c.uartc.frame.char_errors_q = 0xFFFE; },
  };
  bench.poke(kAges[rng.below(std::size(kAges))]);
}

// Whether each flop (an array as one) stands at another value than after reset.
using Stirred = bool (*)(const chip::Chip&);
const std::vector<Stirred>& stirred_flops() {
  static const std::vector<Stirred> list{
#define TC_FLOP(type, name, width, reset) \
  [](const chip::Chip& chip) { return chip.TC_MEMBER.name != static_cast<type>(reset); },
#define TC_ARRAY(type, name, count, width)
#include "cmodel/for_each_flop.inc"
  };
  return list;
}

// Resets aimed at the clocks in which a flop that no reset of this run has put back yet is not as reset
// leaves it. Most of them give the state from before back, so that the head goes on working.
class Resets {
 public:
  Resets(Bench& bench, Rng& rng)
      : bench_(bench), rng_(rng), left_(stirred_flops()), next_(rng.below(kPause)) {}

  // Runs so many clocks, or to the end of a reset that falls into them.
  void run(std::uint64_t clocks) {
    if (bench_.cycle() < next_) {
      bench_.run(clocks);
      return;
    }
    const auto one_is_stirred = [&](const chip::Chip& chip) {
      return std::any_of(left_.begin(), left_.end(), [&](Stirred stirred) { return stirred(chip); });
    };
    if (!bench_.run_until(one_is_stirred, clocks)) return;
    if (one_in(rng_, 6)) bench_.run(rng_.below(400));
    strike();
    if (one_in(rng_, 20)) left_ = stirred_flops();
    next_ = bench_.cycle() + rng_.below(kPause);
  }

 private:
  void strike() {
    const chip::Chip before = bench_.model();
    std::erase_if(left_, [&](Stirred stirred) { return stirred(before); });
    if (one_in(rng_, 4)) bench_.world.addr_strap = static_cast<std::uint8_t>(rng_.below(8));
    bench_.world.reset = true;
    bench_.run(1 + rng_.below(one_in(rng_, 4) ? 5 : 2));
    bench_.world.reset = false;
    bench_.run(4);  // the reset synchroniser lets go before anything pokes
    const bool starts_again = one_in(rng_, 40);
    if (starts_again) bench_.run(rng_.below(3'000));
    bench_.poke([&](chip::Chip& chip) {
      if (starts_again)
        chip.mem = before.mem;
      else
        chip = before;
    });
  }

  static constexpr std::uint64_t kPause = 5'000;

  Bench& bench_;
  Rng& rng_;
  std::vector<Stirred> left_;
  std::uint64_t next_;
};

// The host: sends when the line is free, most of the time politely.
class Host {
 public:
  Host(Bench& bench, Chances& chance, const Kind& kind) : bench_(bench), chance_(chance), kind_(kind) {}

  // A sequence is under way whose frames belong to one control period.
  bool in_sequence() const { return !sequence_.empty(); }
  // Sends nothing before `cycle`.
  void silent_until(std::uint64_t cycle) { next_frame_ = cycle; }

  void step() {
    // A polite host leaves the line alone until the chip has answered, or has forgotten a frame that it did
    // not like.
    const chip::Uartc& uart = bench_.model().uartc;
    const bool busy = uart.frame.count_q != 0 || uart.cmd_valid() || uart.rsp_busy();
    if (bench_.sending() || (busy && polite_) || bench_.cycle() < next_frame_) return;
    bench_.send(next_request());
    // Mostly a polite pause, sometimes on top of the answer, sometimes too long for the watchdog.
    Rng& rng = chance_.host;
    polite_ = in_sequence() || !one_in(rng, 12);
    next_frame_ =
        bench_.cycle() + (one_in(rng, 30) && !in_sequence() ? 9 * kind_.pause : 500 + rng.below(kind_.pause));
  }

 private:
  ModbusRequest next_request() {
    if (!in_sequence() && kind_.random_settings && one_in(chance_.host, 25)) begin_held_writes();
    if (in_sequence()) {
      ModbusRequest request = sequence_.front();
      sequence_.pop_front();
      return request;
    }
    ModbusRequest request = wanted_request();
    if (one_in(chance_.line, kind_.damaged)) damage(chance_.line, request);
    return request;
  }

  ModbusRequest wanted_request() {
    Rng& rng = chance_.host;
    const chip::Guard& guard = bench_.model().guard;
    const Choices& choices = kind_.choices();
    if (kind_.recovers && !one_in(rng, 4)) {
      if (bench_.model().params()[spec::kRegLock] != 0 && one_in(rng, 6))
        return unlock(rng, bench_.unit(), choices);
      if (guard.fault_q != 0 && guard.cause_q == 0)
        return order<spec::kCmdClearFault>(rng, bench_.unit(), choices);
      if (guard.fault_q == 0 && guard.run_q == 0) return order<spec::kCmdRun>(rng, bench_.unit(), choices);
    }
    return draw(rng, kind_.mix(), bench_.unit(), choices);
  }

  // Hold, a write, and Commit or Discard; then a write that comes while the commit waits for its tick
  // (exception 06), or while MEM takes back its words, and reads, which show what is left and keep the
  // sequence open until all has been answered.
  void begin_held_writes() {
    const std::uint8_t unit = bench_.unit();
    const auto value = static_cast<std::uint16_t>(chance_.host.below(1'000));
    const auto to_cmd = [&](spec::Cmd cmd) {
      return write_single_register(unit, holding_address(spec::kRegCmd), cmd);
    };
    for (const ModbusRequest& request :
         {write_single_register(unit, holding_address(spec::kRegLock), 0), to_cmd(spec::kCmdHold),
          write_single_register(unit, holding_address(spec::kRegAtDwell), value),
          to_cmd(one_in(chance_.host, 2) ? spec::kCmdCommit : spec::kCmdDiscard),
          write_single_register(unit, holding_address(spec::kRegKp), value),
          read_holding_registers(unit, holding_address(spec::kRegAtDwell), 1),
          read_input_registers(unit, 0, 1)}) {
      sequence_.push_back(request);
    }
  }

  Bench& bench_;
  Chances& chance_;
  const Kind& kind_;
  std::deque<ModbusRequest> sequence_;
  std::uint64_t next_frame_ = 0;
  bool polite_ = true;
};

void befall_line(Rng& rng, Bench& bench, const Kind& kind) {
  if (one_in(rng, 40 * kind.calm))
    bench.transmitter().glitch(bench.cycle() + 1 + rng.below(500), 1 + rng.below(30));
}

void befall_sensor(Rng& rng, Bench& bench, const Kind& kind) {
  if (one_in(rng, kind.any_sensor ? 30 : 120)) disturb_sensor(rng, bench.world);
  if (one_in(rng, kind.recovers ? 10 : 40)) bench.world.sensor = {};
  if (one_in(rng, 60)) bench.sensor().corrupt_next_frame(1u << rng.below(32));
  if (one_in(rng, 200)) bench.world.feedback = static_cast<Feedback>(rng.below(3));
  if (one_in(rng, 20)) bench.world.feedback = Feedback::follows;
}

void befall_switch(Rng& rng, Bench& bench) {
  if (one_in(rng, 400)) bench.world.inhibit = true;
  if (one_in(rng, 4)) bench.world.inhibit = false;
}

void befall_trigger(Rng& rng, Bench& bench) {
  if (one_in(rng, 6)) bench.world.drop = !bench.world.drop;
}

void befall_test_mode(Rng& rng, Bench& bench) {
  if (one_in(rng, bench.model().guard.run_q != 0 ? 100 : 1'000)) bench.world.test_mode = true;
  if (one_in(rng, 8)) bench.world.test_mode = false;
}

void befall_state(Rng& rng, Bench& bench, const Kind& kind) {
  if (!one_in(rng, kind.recovers ? 2'000 : 500)) return;
  const auto flip = static_cast<std::uint8_t>(1u << rng.below(5));
  // While a pulse stands, the RTL's assertions tie it to the state that sent it; the flip would break them.
  const auto& sysctrl = bench.model().sysctrl;
  if (sysctrl.tick_q != 0 || sysctrl.commit_q != 0 || sysctrl.sens_start_q != 0) return;
  bench.poke([&](chip::Chip& chip) { chip.sysctrl.state_q ^= flip; });
}

// An experiment that is near its end, or near its time limit.
void hurry_tuning(Rng& rng, Bench& bench) {
  if (bench.model().atune.phase_q != chip::kTuneCycle) return;
  if (one_in(rng, 30)) bench.poke([](chip::Chip& c) { c.atune.cycles_q = spec::kTuneAdaptCycles - 1; });
  if (one_in(rng, 15)) bench.poke([](chip::Chip& c) { c.atune.cycles_q = spec::kTuneCycles - 1; });
  if (one_in(rng, 30)) bench.poke([](chip::Chip& c) { c.atune.limit_q = spec::kTuneLimit - 1; });
}

void befall_time(Rng& rng, Bench& bench) {
  hurry_tuning(rng, bench);
  if (one_in(rng, 3)) hurry(rng, bench);
  if (one_in(rng, 3)) hurry_line(bench);
  if (one_in(rng, 400)) be_late(bench);
  if (one_in(rng, 40)) age(rng, bench);
}

// What befalls the chip and its surroundings.
void befall(Chances& chance, Bench& bench, const Kind& kind, std::size_t part) {
  befall_line(chance.line, bench, kind);
  befall_sensor(chance.sensor, bench, kind);
  befall_switch(chance.inhibit, bench);
  befall_trigger(chance.drop, bench);
  befall_test_mode(chance.test_mode, bench);
  befall_state(chance.upset, bench, kind);
  if (kind.any_sensor && one_in(chance.sensor, 12)) {
    const Settings settings = sensor_settings(chance.sensor, part);
    bench.poke([&](chip::Chip& chip) { write_words(chip, settings); });
  }
  if (one_in(chance.plant, kind.move))
    bench.world.temperature_degc =
        kind.temperature(chance.plant, bench.world.temperature_degc, bench.model());
}

// Fault scenarios one after another, each on a chip set up for it: sound, broken at some moment, mended at
// another.
class Breakdowns {
 public:
  Breakdowns(Bench& bench, Chances& chance, Host& host, std::uint64_t seed)
      : bench_(bench),
        chance_(chance),
        host_(host),
        next_(static_cast<std::size_t>(seed) * kScenariosInARun) {}

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
    until_ = bench_.cycle() + 12'000 + chance_.plant.below(18'000);
  }

 private:
  static constexpr std::size_t kScenariosInARun = 4;  // about; the next run goes on from there

  void begin() {
    const auto& all = fault_scenarios();
    scenario_ = &all[next_++ % all.size()];
    bench_.world = World{};
    bench_.poke([&](chip::Chip& chip) { chip = chip_with(with(quick(), scenario_->settings)); });
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

chip::Chip random_start(std::uint64_t seed) { return chip_with(start_settings(seed)); }

RandomRun random_run(std::unique_ptr<Device> device, std::uint64_t seed, std::uint64_t clocks) {
  const Kind& kind = kind_of(seed);
  const std::size_t part = part_of(seed);
  Chances chance(seed);
  Bench bench(std::move(device), std::string(spec::kSensorPresets[part].name), seed);
  bench.world.temperature_degc = 50.0;
  Host host(bench, chance, kind);
  Resets resets(bench, chance.reset);
  Flips flips(bench, chance.flip);
  Breakdowns breakdowns(bench, chance, host, turn_of(seed));
  while (bench.cycle() < clocks) {
    if (kind.breaks) {
      breakdowns.step();
    } else {
      befall(chance, bench, kind, part);
      flips.step();
    }
    host.step();
    if (!host.in_sequence()) befall_time(chance.time, bench);
    const std::uint64_t look = 1 + chance.plant.below(1'500);
    if (kind.breaks)
      bench.run(look);
    else
      resets.run(look);
  }
  return {bench.coverage(), bench.finish(), bench.stimulus_hash()};
}

}  // namespace meltstage::tb
