// SPDX-License-Identifier: Apache-2.0
#include "random_run.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <deque>
#include <optional>
#include <vector>

#include "base/rng.hpp"
#include "random_requests.hpp"
#include "scenarios.hpp"

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

// ---- What the seeds are about ----------------------------------------------------------------------------

// Values of the control and detector registers between which a heating head is moved: ends, ties and steps
// that the arithmetic meets exactly (temperatures on a grid of 0.5 degC, which the sensor and both number
// formats hold).
const Choices& control_choices() {
  using namespace spec;
  static const Choices list{{kRegSetpoint, {600, 600, 620, 580, 800, 0, 1480, 1490, 1500}},
                            {kRegRampUp, {0, 0, 0, 625, 1562, 37}},
                            {kRegRampDown, {0, 0, 0, 625, 1562, 37}},
                            {kRegMode, {0, 0, 1}},
                            {kRegManualDuty, {0, 2500, 10000, 10000, 3000}},
                            {kRegFfExt, {0, 0, 500, 10000}},
                            {kRegHostWd, {0, 0, 0, 4, 100}},
                            {kRegTlmPeriod, {0, 1, 2, 5}},
                            {kRegAtWindow, {0, 5, 10, 20, 20}},
                            {kRegAtDwell, {0, 0, 1, 3}},
                            {kRegCtrl, {0x37, 0x33, 0x72, 0x10, 0x05, 0x45, 0x3F, 0x08, 0x44, 0x36}},
                            {kRegKp, {6208, 6208, 0, 0, 65535, 100}},
                            {kRegKiApproach, {1669, 65535, 65535, 0}},
                            {kRegKiHold, {3339, 65535, 0}},
                            {kRegKd, {0, 0, 46163, 500, 65535}},
                            {kRegDFilter, {0, 0, 4, 6, 1}},
                            {kRegKff, {16534, 16534, 0, 65535}},
                            {kRegTAmb, {250, 250, static_cast<std::uint16_t>(-400), 600}},
                            {kRegBandFull, {180, 5, 0, 20, 5000}},
                            {kRegBandOff, {5000, 0, 5, 20}},
                            {kRegDutyMax, {10000, 10000, 10000, 3000, 3000, 6000, 1000, 1000, 0}},
                            {kRegSlew, {0, 0, 0, 100, 2000, 10000}},
                            {kRegTMax, {1500, 1500, 1500, 900}},
                            {kRegTMin, {0, 0, 0, 500}},
                            {kRegExcLimit, {150, 10, 20, 5000}},
                            {kRegExcTime, {50, 1, 0}},
                            {kRegLbaTime, {0, 360, 1, 2}},
                            {kRegLbaRise, {20, 5, 10}},
                            {kRegHoldMult, {0, 0, 333, 65535}},
                            {kRegHoldAdd, {0, 3000, 3000, 500}},
                            {kRegHoldTime, {0, 1, 1, 300}},
                            {kRegDtdtMax, {0, 0, 0, 0, 100, 20}},
                            {kRegZeroRise, {0, 0, 0, 0, 0, 0, 0, 0, 80, 10}},
                            {kRegZeroWait, {300, 1, 3}},
                            {kRegBadMax, {15, 3, 1}},
                            {kRegSampleTimeout, {20, 50, 3}},
                            {kRegFbTime, {48, 200, 2000}},
                            {kRegPwmPrescale, {0, 0, 0, 1, 3}},
                            {kRegPwmPeriod, {600, 700, 100, 2, 3, 2, 37, 2, 3, 2, 2}},
                            {kRegPwmMinOn, {0, 0, 10, 300}},
                            {kRegPreset, {58, 58, 0, 256}},
                            {kRegFfDrop, {0, 0, 3000, 65535}}};
  return list;
}

// The same for a loop that has little but its integral, which then meets its limit exactly.
const Choices& integral_choices() {
  using namespace spec;
  static const Choices list = [] {
    Choices all = control_choices();
    const Choices others{{kRegMode, {0}},
                         {kRegFfExt, {0}},
                         {kRegKp, {0, 0, 0, 100}},
                         {kRegKiApproach, {65535}},
                         {kRegKiHold, {65535, 3339}},
                         {kRegKd, {0, 0, 0, 65535}},
                         {kRegCtrl, {0x10, 0x32, 0x01, 0x05, 0x07, 0x15, 0x45, 0x3D}},
                         {kRegBandFull, {5000, 5000, 20}},
                         {kRegDutyMax, {10000, 3000, 3000, 1000}},
                         {kRegHoldMult, {0}},
                         {kRegHoldAdd, {3000, 1000, 0}},
                         {kRegExcTime, {1, 0}}};
    for (const Choice& other : others) {
      const auto same = [&](const Choice& choice) { return choice.reg == other.reg; };
      *std::find_if(all.begin(), all.end(), same) = other;
    }
    return all;
  }();
  return list;
}

// A loop that is tuned again and again, on a head that follows the relay.
const Choices& tuning_choices() {
  using namespace spec;
  static const Choices list{{kRegSetpoint, {600, 600, 600, 620, 1500}},
                            {kRegRampUp, {0, 0, 625}},
                            {kRegHostWd, {0}},
                            {kRegCtrl, {0x37, 0x37, 0x33}},
                            {kRegKp, {6208, 0, 65535}},
                            {kRegTAmb, {250, 250, 250, 700}},
                            {kRegDutyMax, {10000, 10000, 3000}},
                            {kRegExcLimit, {5000}},
                            {kRegLbaTime, {0}},
                            {kRegHoldTime, {0}},
                            {kRegDtdtMax, {0}},
                            {kRegZeroRise, {0}},
                            {kRegBadMax, {15}},
                            {kRegSampleTimeout, {100}},
                            {kRegFfDrop, {0, 2000}},
                            {kRegPwmPeriod, {600}}};
  return list;
}

// Detectors with short times, so that each can trip within a run; limits that the head meets exactly.
const Choices& detector_choices() {
  using namespace spec;
  static const Choices list{{kRegSetpoint, {600}},   {kRegHostWd, {40, 10}},   {kRegTlmPeriod, {5}},
                            {kRegAtDwell, {1}},      {kRegCtrl, {0x37, 0x72}}, {kRegKd, {0}},
                            {kRegDFilter, {0}},      {kRegBandOff, {100}},     {kRegTMax, {990, 990, 1500}},
                            {kRegTMin, {0, 500}},    {kRegExcTime, {1}},       {kRegLbaTime, {1}},
                            {kRegHoldMult, {0}},     {kRegHoldAdd, {0}},       {kRegHoldTime, {0, 0, 1}},
                            {kRegDtdtMax, {0, 100}}, {kRegZeroRise, {50}},     {kRegZeroWait, {2}},
                            {kRegBadMax, {2, 15}},   {kRegSampleTimeout, {2}}, {kRegFbTime, {200}},
                            {kRegPwmPeriod, {600}}};
  return list;
}

// A loop that heats by a manual duty, whatever the head does, and a lock that comes and goes.
const Choices& protocol_choices() {
  using namespace spec;
  static const Choices list{
      {kRegSetpoint, {600, 700}}, {kRegMode, {1}},         {kRegManualDuty, {5000, 2500}},
      {kRegHostWd, {0}},          {kRegTlmPeriod, {0, 2}}, {kRegAtWindow, {10, 20}},
      {kRegAtDwell, {0, 3}},      {kRegLock, {0, 1}},      {kRegDtdtMax, {0}},
      {kRegZeroRise, {0}},        {kRegBadMax, {15}},      {kRegSampleTimeout, {100}},
      {kRegPwmPeriod, {600}}};
  return list;
}

// What of a head that heats whatever its sensor says, and a frame of the sensor's own or of any shape.
const Choices& sensor_choices() {
  using namespace spec;
  static const Choices list{{kRegMode, {1}},
                            {kRegManualDuty, {3000}},
                            {kRegHostWd, {0}},
                            {kRegTMax, {5000}},
                            {kRegTMin, {static_cast<std::uint16_t>(-400)}},
                            {kRegDtdtMax, {0}},
                            {kRegZeroRise, {0}},
                            {kRegBadMax, {15, 3}},
                            {kRegSampleTimeout, {100}},
                            {kRegSensTrim, {0, 16, static_cast<std::uint16_t>(-2048), 2047}},
                            {kRegSpiDiv, {2, 3, 7}},
                            {kRegPwmPeriod, {600}}};
  return list;
}

ModbusRequest (*const kTune)(Rng&, std::uint8_t, const Choices&) = order<spec::kCmdTune>;
ModbusRequest (*const kRun)(Rng&, std::uint8_t, const Choices&) = order<spec::kCmdRun>;
ModbusRequest (*const kStop)(Rng&, std::uint8_t, const Choices&) = order<spec::kCmdStop>;
ModbusRequest (*const kClear)(Rng&, std::uint8_t, const Choices&) = order<spec::kCmdClearFault>;

// Leaves the settings alone.
const Mix& attentive_mix() {
  static const Mix mix{{1, kClear}, {1, kRun}, {2, read_all}};
  return mix;
}
const Mix& orderly_mix() {
  static const Mix mix{{3, kClear}, {2, kStop}, {4, kRun}, {3, set_one}, {2, read_all}};
  return mix;
}
const Mix& tuning_mix() {
  static const Mix mix{{1, kClear}, {1, kRun}, {12, kTune}, {4, set_one}, {4, read_all}};
  return mix;
}
const Mix& setting_mix() {
  static const Mix mix{{1, kClear},   {2, kStop},    {1, order_by_block}, {1, kRun},
                       {14, set_one}, {2, read_all}, {1, identify}};
  return mix;
}
const Mix& protocol_mix() {
  static const Mix mix{{4, kStop},
                       {1, nearly_stop},
                       {1, order<spec::kCmdHold>},
                       {1, order<spec::kCmdCommit>},
                       {1, order<spec::kCmdDiscard>},
                       {4, order_by_block},
                       {4, set_one},
                       {1, read_some},
                       {3, identify},
                       {2, server_id},
                       {1, echo},
                       {14, wrong_length},
                       {8, wrong_function},
                       {1, anything}};
  return mix;
}
const Mix& any_mix() {
  static const Mix mix{{1, anything}};
  return mix;
}
const Mix& half_any_mix() {
  static const Mix mix{{1, anything}, {1, set_one}, {1, kRun}, {1, read_all}};
  return mix;
}

const Choices& no_choices() {
  static const Choices none;
  return none;
}

using Temperature = double (*)(Rng& rng, double degc, const chip::Chip& chip);

struct Kind {
  const Choices& (*choices)();
  const Mix& (*mix)();
  Temperature temperature;
  unsigned calm;         // so many times more rarely does the line fail
  unsigned damaged;      // one frame in so many is damaged
  unsigned pause;        // clocks between two frames, at most
  unsigned move;         // one look in so many moves the temperature
  bool recovers;         // the host clears a fault and starts again before anything else
  bool breaks;           // fault scenarios one after another, in place of chance
  bool random_settings;  // of bus, PWM and some other registers
  bool any_sensor;
};

// ---- The head --------------------------------------------------------------------------------------------

double wandering(Rng& rng, double degc, const chip::Chip&) {
  return std::clamp(degc + (rng.uniform() - 0.5) * 8.0, -30.0, 200.0);
}

// At work near its set-point, or leaving it the way each detector is made for.
double at_work(Rng& rng, double, const chip::Chip&) {
  constexpr std::array kPlaces{50.0, 55.0, 59.0, 60.5, 75.0, 99.0, -20.0, 190.0};
  return one_in(rng, 3) ? kPlaces[rng.below(kPlaces.size())] : 58.0 + 4.0 * rng.uniform();
}

// A temperature at which a comparison of the chip finds both sides equal.
double at_a_limit(Rng& rng, const chip::Chip& chip) {
  const auto tenths = [&](spec::Reg reg) { return chip.params().s16(reg) / 10.0; };
  const auto degc = [](std::int16_t temperature) { return temperature / 64.0; };
  const double pv = degc(chip.guard.pv_q);
  const double setpoint = degc(chip.algor.sp_work_q);
  const double limits[] = {setpoint,
                           setpoint + tenths(spec::kRegAtWindow),
                           setpoint - tenths(spec::kRegAtWindow),
                           setpoint + tenths(spec::kRegExcLimit),
                           setpoint - tenths(spec::kRegBandFull),
                           setpoint + tenths(spec::kRegBandOff),
                           pv + tenths(spec::kRegDtdtMax),
                           pv - tenths(spec::kRegDtdtMax),
                           degc(chip.guard.lba_ref_q) + tenths(spec::kRegLbaRise),
                           degc(chip.guard.zero_ref_q) + tenths(spec::kRegZeroRise),
                           tenths(spec::kRegTMax),
                           tenths(spec::kRegTMin)};
  return limits[rng.below(std::size(limits))];
}

// Stays near the set-point, goes to a limit and comes back; in steps of a quarter degree, as the sensor sees
// it.
double between_limits(Rng& rng, double degc, const chip::Chip& chip) {
  const double setpoint = chip.algor.target_q / 64.0;
  const double step = 0.25 * (static_cast<double>(rng.below(3)) - 1.0);
  // Some causes last until the head itself mends them.
  const auto caused = [&](spec::Fault fault) { return (chip.guard.cause_q >> fault & 1) != 0; };
  if (caused(spec::kFaultZeroRise)) return chip.guard.zero_ref_q / 64.0 - 1.0;
  if (caused(spec::kFaultRate)) return degc;
  if (caused(spec::kFaultOverTemp) || caused(spec::kFaultUnderTemp)) return 58.0;
  switch (rng.below(5)) {
    case 0:
      return std::clamp(at_a_limit(rng, chip) + (one_in(rng, 3) ? step : 0.0), -30.0, 200.0);
    case 1:
      return setpoint > 0 ? setpoint - 10.0 * rng.uniform() : 55.0;
    case 2:
    case 3:
      return setpoint > 0 ? setpoint + 4.0 * step : 58.0;
    default:
      return degc + step;
  }
}

// Swings through the relay's band, quickly while it is being tuned.
double swinging(Rng& rng, double degc, const chip::Chip& chip) {
  const double setpoint = chip.algor.sp_work_q / 64.0;
  if (!chip.atune.tuning()) return setpoint - 1.0 + 2.0 * rng.uniform();
  const double far = one_in(rng, 8) ? 0.25 : 0.5 + 4.0 * rng.uniform();
  return one_in(rng, 12) ? degc : setpoint + (chip.atune.on_q != 0 ? far : -far);
}

// ---- Kinds -----------------------------------------------------------------------------------------------

// In turn over the seeds.
constexpr std::array kKinds{
    // A host that wants the head to work, detectors with short times.
    Kind{detector_choices, orderly_mix, at_work, 12, 96, 6'000, 8, true, false, false, false},
    // Whatever comes to a host's mind, to a chip set up at random.
    Kind{no_choices, any_mix, wandering, 1, 8, 10'000, 8, false, false, true, false},
    // Each fault scenario in turn breaks, and is mended; the host leaves the settings alone.
    Kind{no_choices, attentive_mix, nullptr, 0, 96, 10'000, 0, false, true, false, false},
    // A heating head moved between limits, its loop set anew all the time.
    Kind{control_choices, setting_mix, between_limits, 12, 96, 3'000, 2, true, false, false, false},
    // Every form of request in quick succession.
    Kind{protocol_choices, protocol_mix, wandering, 24, 64, 1'500, 8, true, false, false, false},
    // The same with an integral loop.
    Kind{integral_choices, setting_mix, between_limits, 12, 96, 3'000, 2, true, false, false, false},
    // Each sensor, and frames of any shape.
    Kind{sensor_choices, setting_mix, wandering, 24, 96, 4'000, 2, true, false, false, true},
    // As the second, but the host tries to keep the head working.
    Kind{control_choices, half_any_mix, between_limits, 2, 24, 4'000, 2, true, false, true, false},
    // A head that is tuned.
    Kind{tuning_choices, tuning_mix, swinging, 48, 96, 6'000, 1, true, false, false, false},
};

const Kind& kind_of(std::uint64_t seed) { return kKinds[seed % kKinds.size()]; }

Settings with(Settings all, const Settings& more) {
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

// A value inside the register's range.
Setting any_legal(Rng& rng, unsigned index) {
  const spec::RegisterInfo& info = spec::kHolding[index];
  const auto span = static_cast<std::uint64_t>(info.max - info.min) + 1;
  return {static_cast<spec::Reg>(index),
          static_cast<std::uint16_t>(info.min + static_cast<std::int64_t>(rng.below(span)))};
}

Settings random_settings(Rng& rng) {
  constexpr std::array<std::uint16_t, 4> kBauds{5000, 5000, 4000, 2304};
  Settings settings{{spec::kRegBaud, kBauds[rng.below(kBauds.size())]},
                    {spec::kRegFormat, static_cast<std::uint16_t>(rng.below(8))},
                    {spec::kRegAddress, static_cast<std::uint16_t>(one_in(rng, 2) ? rng.below(248) : 0)},
                    {spec::kRegSpiDiv, static_cast<std::uint16_t>(2 + rng.below(6))},
                    {spec::kRegPwmPeriod, static_cast<std::uint16_t>(2 + rng.below(700))},
                    {spec::kRegPwmMinOn, static_cast<std::uint16_t>(rng.below(100))},
                    {spec::kRegPwmPrescale, static_cast<std::uint16_t>(rng.below(4))}};
  for (int i = 0; i < 8; ++i) {
    const auto index = static_cast<unsigned>(1 + rng.below(spec::kRegPwmPrescale - 1));
    if (writable(index) && index != spec::kRegLock) settings.push_back(any_legal(rng, index));
  }
  return settings;
}

// The part on the bench: the first by far the most often.
std::size_t part_of(std::uint64_t seed) {
  return kind_of(seed).any_sensor ? 1 + seed / kKinds.size() % (spec::kSensorPresets.size() - 1) : 1;
}

// The description of a part, as a host would write it for one that the chip does not know.
Settings as_custom(const spec::SensorPreset& part) {
  const auto high = [](std::uint32_t word) { return static_cast<std::uint16_t>(word >> 16); };
  const auto low = [](std::uint32_t word) { return static_cast<std::uint16_t>(word); };
  return {{spec::kRegSensType, 0},
          {spec::kRegSensFrame, part.frame},
          {spec::kRegSensData, part.data},
          {spec::kRegSensScale, part.scale},
          {spec::kRegSensOffset, part.offset},
          {spec::kRegSensFaultMask, part.fault_mask},
          {spec::kRegSensCheckMaskH, high(part.check_mask)},
          {spec::kRegSensCheckMaskL, low(part.check_mask)},
          {spec::kRegSensCheckValueH, high(part.check_value)},
          {spec::kRegSensCheckValueL, low(part.check_value)},
          {spec::kRegSensSetup, part.setup}};
}

// A frame of any length and mode whose checks, if any, the line passes now and then.
Settings any_description(Rng& rng) {
  Settings settings = as_custom({});
  for (Setting& setting : settings) {
    const bool check = setting.reg >= spec::kRegSensFaultMask && setting.reg <= spec::kRegSensCheckValueL;
    if (setting.reg != spec::kRegSensType && (!check || one_in(rng, 4)))
      setting = any_legal(rng, setting.reg);
  }
  return settings;
}

Settings sensor_settings(Rng& rng, std::size_t part) {
  switch (rng.below(4)) {
    case 0:
      return {{spec::kRegSensType, static_cast<std::uint16_t>(part)}};
    case 1:
      return {{spec::kRegSensType, static_cast<std::uint16_t>(rng.below(8))}};
    case 2:
      return as_custom(spec::kSensorPresets[part]);
    default:
      return any_description(rng);
  }
}

Settings start_settings(std::uint64_t seed) {
  const Kind& kind = kind_of(seed);
  Rng rng = stream(seed, "settings");
  Settings settings = quick();
  if (kind.random_settings) settings = with(settings, random_settings(rng));
  settings = with(settings, draw(rng, kind.choices()));
  if (kind.any_sensor) settings.push_back({spec::kRegSensType, static_cast<std::uint16_t>(part_of(seed))});
  return settings;
}

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
      if (guard.fault_q != 0 && guard.cause_q == 0) return kClear(rng, bench_.unit(), choices);
      if (guard.fault_q == 0 && guard.run_q == 0) return kRun(rng, bench_.unit(), choices);
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
  bench.poke(
      [&](chip::Chip& chip) { chip.sysctrl.state_q ^= static_cast<std::uint8_t>(1u << rng.below(5)); });
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
  Breakdowns breakdowns(bench, chance, host, seed / kKinds.size());
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
