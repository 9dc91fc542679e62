// SPDX-License-Identifier: Apache-2.0
// Pieces of the functional set: sensors, control periods, the control law and its arithmetic, ramps,
// regulation.
#include "asic/signoff/piece_steps.hpp"

namespace meltstage::app {

namespace {

class ControlPieces : private PieceSteps {
 public:
  explicit ControlPieces(PieceState& state) : PieceSteps(state) {}

  void record() {
    sensors();
    control_periods();
    loop_arithmetic();
    ramps();
    regulation();
  }

 private:
  // What a sensor of this description sends: its checked bits right, its fault bits clear, the rest any.
  std::uint32_t any_frame(std::uint32_t check_mask, std::uint32_t check_value, std::uint32_t fault_mask) {
    return ((static_cast<std::uint32_t>(random_.bits()) & ~check_mask) | (check_value & check_mask)) &
           ~(fault_mask & ~check_mask);
  }
  void sensors() {
    begin("sensors: presets, custom frames of every length and mode, bad frames");
    start_work();
    for (std::size_t type = 1; type < spec::kSensorPresets.size(); ++type) {
      const spec::SensorPreset& preset = spec::kSensorPresets[type];
      set(spec::kRegSensType, static_cast<std::int32_t>(type));
      set(spec::kRegSensTrim, in_range(spec::kRegSensTrim));
      set(spec::kRegSpiDiv, 2 + static_cast<std::int32_t>(below(12)));
      const unsigned length = (preset.frame & spec::kSensFrameLengthMask) >> spec::kSensFrameLength,
                     mode = (preset.frame & spec::kSensFrameSpiModeMask) >> spec::kSensFrameSpiMode;
      for (unsigned i = 0; i < often(4, 2); ++i) {
        s_.sensor().set(any_frame(preset.check_mask, preset.check_value, preset.fault_mask), length, mode);
        s_.ticks();
        look();
      }
      s_.sensor().set(static_cast<std::uint32_t>(random_.bits()), length, mode);
      s_.ticks();
      look();
    }
    for (unsigned i = 0; i < often(16, 5); ++i) {
      Parameters p = now_;
      p[spec::kRegSensType] = 0;
      p[spec::kRegSpiDiv] = i % 8 == 0 ? 255 : 2 + static_cast<std::int32_t>(below(20));
      for (std::uint16_t reg = spec::kRegSensFrame; reg <= spec::kRegSensTrim; ++reg) p[reg] = in_range(reg);
      const unsigned length = 1 + below(32), mode = below(4);
      constexpr unsigned kSigned = 1U << spec::kSensFrameSigned;
      p[spec::kRegSensFrame] =
          static_cast<std::int32_t>((p[spec::kRegSensFrame] & (spec::kSensFrameLowMask | kSigned)) |
                                    (mode << spec::kSensFrameSpiMode) | length);
      if (one_in(2)) p[spec::kRegSensSetup] = 0;
      if (one_in(2)) p[spec::kRegSensFaultMask] = 0;
      if (one_in(2)) {
        p[spec::kRegSensFrame] = static_cast<std::int32_t>(kSigned | (mode << spec::kSensFrameSpiMode) | 32);
        p[spec::kRegSensCheckMaskH] = p[spec::kRegSensCheckMaskL] = 0;
      }
      write_range(p, spec::kRegSensType, spec::kRegSpiDiv);
      const auto mask =
          static_cast<std::uint32_t>(p[spec::kRegSensCheckMaskH] << 16 | p[spec::kRegSensCheckMaskL]);
      const auto value =
          static_cast<std::uint32_t>(p[spec::kRegSensCheckValueH] << 16 | p[spec::kRegSensCheckValueL]);
      const auto faults = static_cast<std::uint32_t>(p[spec::kRegSensFaultMask]);
      for (unsigned frame = 0; frame < 2; ++frame) {
        s_.sensor().set(any_frame(mask, value, faults), p[spec::kRegSensFrame] & spec::kSensFrameLengthMask,
                        mode);
        s_.ticks();
        look();
      }
      // One checked or fault bit wrong.
      s_.sensor().set(any_frame(mask, value, faults) ^ (1U << below(32)),
                      p[spec::kRegSensFrame] & spec::kSensFrameLengthMask, mode);
      s_.ticks();
      look();
    }
    for (const std::uint32_t stuck : {0U, ~0U}) {
      s_.sensor().set(stuck, 32, 0);
      s_.ticks(2);
      look();
    }
    write_all(now_ = calm());
    sample(of_tenths(250));
    s_.ticks();
  }

  // Every bit of the control period: each is waited for.
  void control_periods() {
    begin("control periods, telemetry periods");
    start_work();
    heat();
    for (const std::int32_t ts : {2000, 1365, 682, 1024, 512, 341, 256, 170, 128, 85, 64, 31, 10}) {
      s_.write(spec::kRegTs, ts);
      s_.ticks(2);
      look();
    }
    set(spec::kRegTs, 40);
    s_.ticks(2);
    for (unsigned i = 0; i < often(24, 6); ++i) {
      // Whole powers of two are not waited for: what takes one for less is early.
      const bool waits = i % 2 == 0;
      const std::int32_t period = waits ? any_size(1, 2000) : 1 << (3 + i / 2 % 13);
      set(spec::kRegTlmPeriod, period);
      s_.run((waits ? static_cast<std::uint64_t>(period) + 120 : 120) * kTestTenth);
    }
    set(spec::kRegTlmPeriod, 0);
    s_.command(spec::kCmdStop);
  }

  // Gains, limits and temperatures of any size.
  void draw_law(Parameters& p, std::int16_t& pv) {
    for (std::uint16_t reg = spec::kRegSetpoint; reg <= spec::kRegFfExt; ++reg) p[reg] = in_range(reg);
    for (std::uint16_t reg = spec::kRegKp; reg <= spec::kRegSlew; ++reg) p[reg] = in_range(reg);
    for (const std::uint16_t reg :
         {spec::kRegHoldMult, spec::kRegHoldAdd, spec::kRegPreset, spec::kRegFfDrop, spec::kRegAtWindow})
      p[reg] = in_range(reg);
    p[spec::kRegSetpoint] = std::min<std::int32_t>(p[spec::kRegSetpoint], kSetpointTop);
    p[spec::kRegCtrl] =
        static_cast<std::int32_t>(below(1U << spec::kCtrlHeatRate) & ~(1U << spec::kCtrlFbEn));
    p[spec::kRegMode] = one_in(10) ? kManual : 0;
    p[spec::kRegAtDwell] = 0;
    if (!one_in(8)) p[spec::kRegRampUp] = p[spec::kRegRampDown] = 0;
    if (!one_in(4)) p[spec::kRegSlew] = 0;
    if (!one_in(3)) p[spec::kRegDutyMax] = 10000;
    if (one_in(2)) p[spec::kRegBandFull] = p[spec::kRegBandOff] = 5000;
    const std::int32_t near = of_tenths(p[spec::kRegSetpoint]) + (one_in(2) ? 1 : -1) * any_size(0, 4000);
    const bool far = one_in(3) || near < of_tenths(-390) || near > of_tenths(4990) || near == 0 || near == -1;
    pv = far ? any_temperature(-390, 4990) : static_cast<std::int16_t>(near);
  }

  // A new set each control period. Most are drawn until the duty is none of its limits, so that each bit of
  // each term counts in it; it shows in the length of the pulse.
  void loop_arithmetic() {
    begin("control law: gains, limits, temperatures of any size");
    start_work();
    now_[spec::kRegTs] = 330;
    write_all(now_);
    s_.ticks(2);
    heat();
    for (unsigned i = 0; i < often(150, 60); ++i) {
      Parameters p = now_;
      std::int16_t pv = 1;
      const bool any = one_in(4);
      for (unsigned tries = 0; tries < 200; ++tries) {
        draw_law(p, pv);
        const chip::Algor result = computed(p, pv);
        if (any || (result.duty_q > 64 && result.duty_q + 64 < result.duty_max_q)) break;
      }
      p[spec::kRegPwmPeriod] = 6000 + static_cast<std::int32_t>(below(12000));
      write_range(p, spec::kRegSetpoint, spec::kRegFfExt);
      write_range(p, spec::kRegCtrl, spec::kRegSlew);
      if (one_in(3)) {
        write_range(p, spec::kRegAtWindow, spec::kRegAtDwell);
        write_range(p, spec::kRegHoldMult, spec::kRegHoldAdd);
        write_range(p, spec::kRegPwmPeriod, spec::kRegPwmPeriod);
        write_range(p, spec::kRegPreset, spec::kRegFfDrop);
        now_ = p;
      } else {
        for (const std::uint16_t reg : {spec::kRegAtWindow, spec::kRegAtDwell, spec::kRegHoldMult,
                                        spec::kRegHoldAdd, spec::kRegPreset, spec::kRegFfDrop})
          p[reg] = now_[reg];
      }
      for (unsigned drops = below(6); drops > 0; --drops) s_.droplet(3);
      s_.set_temperature(pv);
      s_.ticks();
      s_.read_loop();
      if (!heating()) heat();
    }
    for (unsigned i = 0; i < 300; ++i) s_.droplet(2);  // the counter stops at its top
    s_.ticks();
    look();
    s_.command(spec::kCmdStop);
    write_all(now_ = calm());
    sample(of_tenths(250));
    s_.ticks();
  }

  void ramps() {
    begin("set-point ramps, telemetry");
    set(spec::kRegTlmPeriod, 1);
    for (const std::int32_t rate : {1562, 1365, 682, 100, 3}) {
      const std::int32_t from = 300 + static_cast<std::int32_t>(below(4000));
      sample(of_tenths(from));
      set(spec::kRegRampUp, rate);
      set(spec::kRegRampDown, 1562 - rate / 2);
      set(spec::kRegSetpoint, kSetpointTop);
      s_.ticks();
      heat();
      for (unsigned i = 0; i < often(4, 2); ++i) {
        sample(static_cast<std::int16_t>(of_tenths(from) + any_size(0, 300)));
        look();
      }
      set(spec::kRegSetpoint, 0);
      for (unsigned i = 0; i < often(4, 2); ++i) {
        sample(static_cast<std::int16_t>(of_tenths(from) - any_size(0, 300)));
        look();
      }
      s_.command(spec::kCmdStop);
    }
    set(spec::kRegTlmPeriod, 0);
  }

  // The way to a set-point, past it and back: quality figures, at-temperature output.
  void regulation() {
    begin("at temperature, quality figures");
    set(spec::kRegRampUp, 0);
    set(spec::kRegRampDown, 0);
    set(spec::kRegAtDwell, 0);
    set(spec::kRegTlmPeriod, 1);
    sample(of_tenths(250));
    heat();
    for (unsigned i = 0; i < often(12, 3); ++i) {
      const std::int32_t target = in_range(spec::kRegSetpoint);
      set(spec::kRegSetpoint, std::min<std::int32_t>(target, kSetpointTop));
      set(spec::kRegAtWindow, in_range(spec::kRegAtWindow));
      set(spec::kRegAtDwell, i % 6 == 0 ? 1 : 0);
      const std::int16_t middle = of_tenths(now_[spec::kRegSetpoint]);
      for (const int sign : {0, 1, -1, 1}) {
        const std::int32_t to = middle + sign * any_size(0, 6000);
        sample(static_cast<std::int16_t>(
            std::clamp<std::int32_t>(to == 0 || to == -1 ? 1 : to, of_tenths(-390), of_tenths(4990))));
      }
      sample(static_cast<std::int16_t>(middle + 1));
      s_.run(2 * kTestTenth);
      look();
    }
    s_.command(spec::kCmdStop);
    set(spec::kRegTlmPeriod, 0);
  }
};

}  // namespace

void record_control(PieceState& state) { ControlPieces(state).record(); }

}  // namespace meltstage::app
