// SPDX-License-Identifier: Apache-2.0
#include "tb/stimulus/random_kinds.hpp"

#include <algorithm>
#include <array>

namespace meltstage::tb {

namespace {

// Values of the control and detector registers between which a heating head is moved: ends, ties and steps
// that the arithmetic meets exactly (temperatures on a grid of 0.5 degC, which the sensor and both number
// formats hold). The words of CTRL are mixes of its bits, here and below, and stand for no certain ones.
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
                            {kRegCtrl, {0x37, 0x33, 0x72, 0x1610, 0x05, 0x5545, 0xFFBF, 0x08, 0x44, 0x36}},
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
                         {kRegCtrl, {0x10, 0x32, 0x01, 0x1605, 0x07, 0x15, 0xFFC5, 0x3D}},
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
                            {kRegCtrl, {0x37, 0x1637, 0x33}},
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
  static const Choices list{
      {kRegSetpoint, {600}},        {kRegHostWd, {40, 10}}, {kRegTlmPeriod, {5}},  {kRegAtDwell, {1}},
      {kRegCtrl, {0x37, 0xFFF2}},   {kRegKd, {0}},          {kRegDFilter, {0}},    {kRegBandOff, {100}},
      {kRegTMax, {990, 990, 1500}}, {kRegTMin, {0, 500}},   {kRegExcTime, {1}},    {kRegLbaTime, {1, 10, 20}},
      {kRegLbaRise, {20, 1}},       {kRegHoldMult, {0}},    {kRegHoldAdd, {0}},    {kRegHoldTime, {0, 0, 1}},
      {kRegDtdtMax, {0, 100}},      {kRegZeroRise, {50}},   {kRegZeroWait, {2}},   {kRegBadMax, {2, 15}},
      {kRegSampleTimeout, {2}},     {kRegFbTime, {200}},    {kRegPwmPeriod, {600}}};
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

// ---- The head --------------------------------------------------------------------------------------------

double wandering(Rng& rng, double degc, const chip::Chip&) {
  return std::clamp(degc + (rng.uniform() - 0.5) * 8.0, -30.0, 200.0);
}

// HoldPower asks: a live head falls, a dead reading stays.
double asked(Rng& rng, double degc) { return one_in(rng, 4) ? degc : degc - 10.0; }

// At work near its set-point, or leaving it the way each detector is made for.
double at_work(Rng& rng, double degc, const chip::Chip& chip) {
  constexpr std::array kPlaces{50.0, 55.0, 59.0, 60.5, 75.0, 99.0, -20.0, 190.0};
  if (chip.guard.hold_test_q != 0) return asked(rng, degc);
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
  if (chip.guard.hold_test_q != 0) return asked(rng, degc);
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

// Half of the time one bit: of several, another one answers for it.
Setting any_fault_mask(Rng& rng) {
  if (one_in(rng, 2)) return any_legal(rng, spec::kRegSensFaultMask);
  return {spec::kRegSensFaultMask, static_cast<std::uint16_t>(1u << rng.below(16))};
}

// A frame of any length and mode whose checks, if any, the line passes now and then.
Settings any_description(Rng& rng) {
  Settings settings = as_custom({});
  for (Setting& setting : settings) {
    const bool check = setting.reg >= spec::kRegSensFaultMask && setting.reg <= spec::kRegSensCheckValueL;
    if (setting.reg != spec::kRegSensType && (!check || one_in(rng, 4)))
      setting = setting.reg == spec::kRegSensFaultMask ? any_fault_mask(rng) : any_legal(rng, setting.reg);
  }
  return settings;
}

}  // namespace

const Kind& kind_of(std::uint64_t seed) { return kKinds[seed % kKinds.size()]; }

std::size_t turn_of(std::uint64_t seed) { return seed / kKinds.size(); }

Settings with(Settings all, const Settings& more) {
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

std::size_t part_of(std::uint64_t seed) {
  return kind_of(seed).any_sensor ? 1 + turn_of(seed) % (spec::kSensorPresets.size() - 1) : 1;
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

}  // namespace meltstage::tb
