// SPDX-License-Identifier: Apache-2.0
// Generated from spec/*.toml by spec/generate.py; edit those.
// Of each fault what was measured, the limits it is judged by, and what a person does next.
// clang-format off
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "spec.hpp"

namespace meltstage::chip::spec {

struct FaultAdvice {
  std::span<const In> measured;  // registers that show what was found
  std::span<const Reg> limits;   // registers that it is judged by
  std::string_view next;         // what to check, or which setting
};

namespace advice {
inline constexpr std::array kOverTempMeasured{ kInPv };
inline constexpr std::array kOverTempLimits{ kRegTMax };
inline constexpr std::array kUnderTempMeasured{ kInPv };
inline constexpr std::array kUnderTempLimits{ kRegTMin };
inline constexpr std::array kSensorFaultMeasured{ kInRawH, kInRawL };
inline constexpr std::array kSensorFaultLimits{ kRegBadMax };
inline constexpr std::array kSensorFrameMeasured{ kInRawH, kInRawL };
inline constexpr std::array kSensorFrameLimits{ kRegBadMax };
inline constexpr std::array kSensorStaleMeasured{ kInPv };
inline constexpr std::array kSensorStaleLimits{ kRegSampleTimeout, kRegLbaTime };
inline constexpr std::array kRateMeasured{ kInPv, kInPvSlope };
inline constexpr std::array kRateLimits{ kRegDtdtMax, kRegBadMax };
inline constexpr std::array kNotHeatingMeasured{ kInPv, kInSpWork };
inline constexpr std::array kNotHeatingLimits{ kRegLbaRise, kRegLbaTime };
inline constexpr std::array kHoldPowerMeasured{ kInPv, kInDuty };
inline constexpr std::array kHoldPowerLimits{ kRegHoldMult, kRegKff, kRegHoldAdd, kRegHoldTime, kRegLbaRise, kRegLbaTime };
inline constexpr std::array kExcursionMeasured{ kInPv, kInSpWork };
inline constexpr std::array kExcursionLimits{ kRegExcLimit, kRegExcTime };
inline constexpr std::array kZeroRiseMeasured{ kInPv };
inline constexpr std::array kZeroRiseLimits{ kRegZeroRise, kRegZeroWait };
inline constexpr std::array kHeaterFbLimits{ kRegFbTime };
inline constexpr std::array kHostWatchdogLimits{ kRegHostWd };
}  // namespace advice

// By bit of FAULT.
inline constexpr std::array<FaultAdvice, kFaultCount> kFaultAdvice{ {
    { advice::kOverTempMeasured, advice::kOverTempLimits,
     "Check that the sensor is seated and the switch opens; then lower SETPOINT or raise T_MAX above the overshoot."},
    { advice::kUnderTempMeasured, advice::kUnderTempLimits,
     "Check the sensor and its polarity; in a cold room lower T_MIN."},
    { advice::kSensorFaultMeasured, advice::kSensorFaultLimits,
     "Check the sensor's wires for a break, a short and contact to the head."},
    { advice::kSensorFrameMeasured, advice::kSensorFrameLimits,
     "Check the SPI lines to the sensor and that SENS_TYPE names the part that is fitted."},
    { advice::kSensorStaleMeasured, advice::kSensorStaleLimits,
     "Check that the sensor is powered and answers; raise SAMPLE_TIMEOUT only for a slower sensor."},
    { advice::kRateMeasured, advice::kRateLimits,
     "Check the sensor's contacts and shielding; raise DTDT_MAX only for a head that truly is so fast."},
    { advice::kNotHeatingMeasured, advice::kNotHeatingLimits,
     "Check the heater element, its supply, and that the sensor sits in the head; raise LBA_TIME only for a slower head, lower HEAT_RATE of CTRL likewise."},
    { advice::kHoldPowerMeasured, advice::kHoldPowerLimits,
     "The duty was lowered and the reading did not follow: check that the sensor sits in the head; raise LBA_TIME only for a slower head."},
    { advice::kExcursionMeasured, advice::kExcursionLimits,
     "Check that the switch opens and the gains fit the head (chip tune); then raise EXC_LIMIT."},
    { advice::kZeroRiseMeasured, advice::kZeroRiseLimits,
     "Take the supply off and check the switch for a short; raise ZERO_WAIT only for a head that lags longer."},
    { {}, advice::kHeaterFbLimits,
     "Check the switch, its driver and the feedback wire; without such a wire clear CTRL.FB_EN."},
    { {}, advice::kHostWatchdogLimits,
     "Check the serial line and that the host polls more often than HOST_WD."},
    { {}, {},
     "Reset the chip and write its registers again; if it comes back, check the supply."},
    { {}, {},
     "Reset the chip; if it comes back, check the supply and the clock."},
    { {}, {},
     "Release the emergency stop or mend its loop, then clear the fault."},
} };

}  // namespace meltstage::chip::spec
