// SPDX-License-Identifier: Apache-2.0
// Generated from spec/*.toml by spec/generate.py; edit those.
// Constants of the chip: registers, states, fault and command codes, sensor presets. Twin of rtl/tc_pkg.sv.
// clang-format off
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string_view>

namespace meltstage::chip::spec {

inline constexpr std::uint32_t kClkHz = 12000000;
inline constexpr std::uint16_t kDeviceId = 0x7C01;
inline constexpr std::uint16_t kVersion = 0x0001;
inline constexpr std::uint16_t kMapCrc = 0xA3C3;
inline constexpr unsigned kScanChains = 8;
inline constexpr unsigned kTestSpeedup = 100;
inline constexpr std::uint16_t kTelemetryWords = 16;  // input registers of a telemetry frame, from the first on
inline constexpr unsigned kWriteWords = 16;  // of one write
inline constexpr std::uint16_t kSetpointMargin = 50;  // 0.1 degC

inline constexpr unsigned kInputCount = 34;
inline constexpr unsigned kHoldingCount = 61;
inline constexpr std::uint16_t kHoldingBase = 0x0100;

// Input registers; the value is the Modbus PDU address.
enum In : std::uint16_t {
  kInStatus = 0,
  kInPv = 1,
  kInSpWork = 2,
  kInDuty = 3,
  kInFault = 4,
  kInFirstFault = 5,
  kInPvFine = 6,
  kInPvSlope = 7,
  kInTermP = 8,
  kInTermI = 9,
  kInTermD = 10,
  kInRawH = 11,
  kInRawL = 12,
  kInSamples = 13,
  kInWdLeft = 14,
  kInCause = 15,
  kInCrcErrors = 16,
  kInCharErrors = 17,
  kInMessages = 18,
  kInSensorErrors = 19,
  kInMemCorrected = 20,
  kInDeviceId = 21,
  kInVersion = 22,
  kInMapCrc = 23,
  kInOvershoot = 24,
  kInBandTime = 25,
  kInBandError = 26,
  kInPeak = 27,
  kInOnTimeH = 28,
  kInOnTimeL = 29,
  kInAtState = 30,
  kInAtKu = 31,
  kInAtTu = 32,
  kInAtDuty = 33,
};

// Holding registers; the Modbus PDU address is kHoldingBase + value.
enum Reg : std::uint16_t {
  kRegCmd = 0,
  kRegSetpoint = 1,
  kRegRampUp = 2,
  kRegRampDown = 3,
  kRegMode = 4,
  kRegManualDuty = 5,
  kRegFfExt = 6,
  kRegHostWd = 7,
  kRegTlmPeriod = 8,
  kRegAtWindow = 9,
  kRegAtDwell = 10,
  kRegLock = 11,
  kRegCtrl = 12,
  kRegKp = 13,
  kRegKiApproach = 14,
  kRegKiHold = 15,
  kRegKd = 16,
  kRegDFilter = 17,
  kRegKff = 18,
  kRegTAmb = 19,
  kRegBandFull = 20,
  kRegBandOff = 21,
  kRegDutyMax = 22,
  kRegSlew = 23,
  kRegTs = 24,
  kRegTMax = 25,
  kRegTMin = 26,
  kRegExcLimit = 27,
  kRegExcTime = 28,
  kRegLbaTime = 29,
  kRegLbaRise = 30,
  kRegHoldMult = 31,
  kRegHoldAdd = 32,
  kRegHoldTime = 33,
  kRegDtdtMax = 34,
  kRegZeroRise = 35,
  kRegZeroWait = 36,
  kRegBadMax = 37,
  kRegSampleTimeout = 38,
  kRegFbTime = 39,
  kRegSensType = 40,
  kRegSensFrame = 41,
  kRegSensData = 42,
  kRegSensScale = 43,
  kRegSensOffset = 44,
  kRegSensFaultMask = 45,
  kRegSensCheckMaskH = 46,
  kRegSensCheckMaskL = 47,
  kRegSensCheckValueH = 48,
  kRegSensCheckValueL = 49,
  kRegSensSetup = 50,
  kRegSensTrim = 51,
  kRegSpiDiv = 52,
  kRegPwmPrescale = 53,
  kRegPwmPeriod = 54,
  kRegPwmMinOn = 55,
  kRegAddress = 56,
  kRegBaud = 57,
  kRegFormat = 58,
  kRegPreset = 59,
  kRegFfDrop = 60,
};

struct RegisterInfo {
  std::string_view name;
  std::string_view unit;
  double scale;  // value of one LSB in the unit
  bool is_signed;
  bool readable;
  std::int32_t min;
  std::int32_t max;
  std::int32_t reset;
  std::uint32_t stored;  // bits of its word in MEM that differ within min..max, check bits above data
  bool corrected;        // MEM shows it corrected already before its pass
};

inline constexpr std::array<RegisterInfo, kHoldingCount> kHolding{ {
    {"CMD", "", 1.0, false, false, 0, 65535, 0, 0x000000, false },
    {"SETPOINT", "degC", 0.1, true, true, 0, 5000, 0, 0x011FFF, false },
    {"RAMP_UP", "degC/s", 0.01, false, true, 0, 1562, 0, 0x0107FF, false },
    {"RAMP_DOWN", "degC/s", 0.01, false, true, 0, 1562, 0, 0x0107FF, false },
    {"MODE", "", 1.0, false, true, 0, 1, 0, 0x010001, false },
    {"MANUAL_DUTY", "%", 0.01, false, true, 0, 10000, 0, 0x013FFF, false },
    {"FF_EXT", "%", 0.01, false, true, 0, 10000, 0, 0x013FFF, false },
    {"HOST_WD", "s", 0.1, false, true, 0, 65535, 100, 0x01FFFF, false },
    {"TLM_PERIOD", "s", 0.1, false, true, 0, 65535, 0, 0x01FFFF, false },
    {"AT_WINDOW", "degC", 0.1, false, true, 0, 1000, 10, 0x0103FF, false },
    {"AT_DWELL", "s", 0.1, false, true, 0, 65535, 50, 0x01FFFF, false },
    {"LOCK", "", 1.0, false, true, 0, 65535, 0, 0x01FFFF, false },
    {"CTRL", "", 1.0, false, true, 0, 65535, 55, 0x01FFFF, false },
    {"KP", "1/K", 1.52587890625e-05, false, true, 0, 65535, 5131, 0x01FFFF, false },
    {"KI_APPROACH", "", 6.103515625e-05, false, true, 0, 65535, 1229, 0x01FFFF, false },
    {"KI_HOLD", "", 6.103515625e-05, false, true, 0, 65535, 1602, 0x01FFFF, false },
    {"KD", "", 0.125, false, true, 0, 65535, 17409, 0x01FFFF, false },
    {"D_FILTER", "", 1.0, false, true, 0, 6, 4, 0x010007, false },
    {"KFF", "1/K", 2.384185791015625e-07, false, true, 0, 65535, 18874, 0x01FFFF, false },
    {"T_AMB", "degC", 0.1, true, true, -400, 1000, 250, 0x01FFFF, false },
    {"BAND_FULL", "degC", 0.1, false, true, 0, 5000, 180, 0x011FFF, false },
    {"BAND_OFF", "degC", 0.1, false, true, 0, 5000, 5000, 0x011FFF, false },
    {"DUTY_MAX", "%", 0.01, false, true, 0, 10000, 10000, 0x013FFF, false },
    {"SLEW", "%", 0.01, false, true, 0, 10000, 0, 0x013FFF, false },
    {"TS", "ms", 1.0, false, true, 10, 2000, 100, 0x3F07FF, true },
    {"T_MAX", "degC", 0.1, true, true, 0, 5000, 1500, 0x011FFF, false },
    {"T_MIN", "degC", 0.1, true, true, -400, 1000, 0, 0x01FFFF, false },
    {"EXC_LIMIT", "degC", 0.1, false, true, 10, 5000, 150, 0x011FFF, false },
    {"EXC_TIME", "s", 0.1, false, true, 0, 65535, 50, 0x01FFFF, false },
    {"LBA_TIME", "s", 0.1, false, true, 0, 65535, 360, 0x01FFFF, false },
    {"LBA_RISE", "degC", 0.1, false, true, 1, 1000, 20, 0x0103FF, false },
    {"HOLD_MULT", "", 0.00390625, false, true, 0, 65535, 333, 0x01FFFF, false },
    {"HOLD_ADD", "%", 0.01, false, true, 0, 10000, 500, 0x013FFF, false },
    {"HOLD_TIME", "s", 0.1, false, true, 0, 65535, 300, 0x01FFFF, false },
    {"DTDT_MAX", "degC", 0.1, false, true, 0, 5000, 50, 0x011FFF, false },
    {"ZERO_RISE", "degC", 0.1, false, true, 0, 5000, 80, 0x011FFF, false },
    {"ZERO_WAIT", "s", 0.1, false, true, 0, 65535, 300, 0x01FFFF, false },
    {"BAD_MAX", "", 1.0, false, true, 1, 15, 3, 0x01000F, false },
    {"SAMPLE_TIMEOUT", "s", 0.1, false, true, 1, 65535, 20, 0x01FFFF, false },
    {"FB_TIME", "us", 1.3333333333333333, false, true, 1, 65535, 48, 0x01FFFF, false },
    {"SENS_TYPE", "", 1.0, false, true, 0, 6, 1, 0x010007, false },
    {"SENS_FRAME", "", 1.0, false, true, 0, 16383, 12832, 0x013FFF, false },
    {"SENS_DATA", "", 1.0, false, true, 0, 65311, 14, 0x01FFFF, false },
    {"SENS_SCALE", "", 0.00390625, false, true, 0, 65535, 4096, 0x01FFFF, false },
    {"SENS_OFFSET", "degC", 0.015625, true, true, -32768, 32767, 0, 0x01FFFF, false },
    {"SENS_FAULT_MASK", "", 1.0, false, true, 0, 65535, 7, 0x01FFFF, false },
    {"SENS_CHECK_MASK_H", "", 1.0, false, true, 0, 65535, 3, 0x01FFFF, false },
    {"SENS_CHECK_MASK_L", "", 1.0, false, true, 0, 65535, 8, 0x01FFFF, false },
    {"SENS_CHECK_VALUE_H", "", 1.0, false, true, 0, 65535, 0, 0x01FFFF, false },
    {"SENS_CHECK_VALUE_L", "", 1.0, false, true, 0, 65535, 0, 0x01FFFF, false },
    {"SENS_SETUP", "", 1.0, false, true, 0, 65535, 0, 0x01FFFF, false },
    {"SENS_TRIM", "degC", 0.015625, true, true, -2048, 2047, 0, 0x01FFFF, false },
    {"SPI_DIV", "", 1.0, false, true, 2, 255, 5, 0x0100FF, false },
    {"PWM_PRESCALE", "", 1.0, false, true, 0, 65535, 0, 0x3FFFFF, true },
    {"PWM_PERIOD", "", 1.0, false, true, 2, 65535, 12000, 0x3FFFFF, true },
    {"PWM_MIN_ON", "", 1.0, false, true, 0, 32767, 0, 0x017FFF, false },
    {"ADDRESS", "", 1.0, false, true, 0, 247, 0, 0x0100FF, false },
    {"BAUD", "Bd", 100.0, false, true, 12, 5000, 1152, 0x011FFF, false },
    {"FORMAT", "", 1.0, false, true, 0, 7, 0, 0x010007, false },
    {"PRESET", "", 0.00390625, false, true, 0, 256, 50, 0x0101FF, false },
    {"FF_DROP", "", 9.5367431640625e-07, false, true, 0, 65535, 0, 0x01FFFF, false },
} };
inline constexpr unsigned kMemColumns = kHoldingCount;  // MEM's row behind the words, which makes the columns even
inline constexpr unsigned kMemRows = kMemColumns + 1;
inline constexpr std::uint32_t kColumnsStored = 0x3FFFFF;  // bits of MEM's columns

struct InputInfo {
  std::string_view name;
  std::string_view unit;
  double scale;
  bool is_signed;
};

inline constexpr std::array<InputInfo, kInputCount> kInput{ {
    {"STATUS", "", 1.0, false },
    {"PV", "degC", 0.1, true },
    {"SP_WORK", "degC", 0.1, true },
    {"DUTY", "%", 0.01, false },
    {"FAULT", "", 1.0, false },
    {"FIRST_FAULT", "", 1.0, false },
    {"PV_FINE", "degC", 0.015625, true },
    {"PV_SLOPE", "degC", 0.015625, true },
    {"TERM_P", "%", 0.01, true },
    {"TERM_I", "%", 0.01, true },
    {"TERM_D", "%", 0.01, true },
    {"RAW_H", "", 1.0, false },
    {"RAW_L", "", 1.0, false },
    {"SAMPLES", "", 1.0, false },
    {"WD_LEFT", "s", 0.1, false },
    {"CAUSE", "", 1.0, false },
    {"CRC_ERRORS", "", 1.0, false },
    {"CHAR_ERRORS", "", 1.0, false },
    {"MESSAGES", "", 1.0, false },
    {"SENSOR_ERRORS", "", 1.0, false },
    {"MEM_CORRECTED", "", 1.0, false },
    {"DEVICE_ID", "", 1.0, false },
    {"VERSION", "", 1.0, false },
    {"MAP_CRC", "", 1.0, false },
    {"OVERSHOOT", "degC", 0.015625, false },
    {"BAND_TIME", "s", 0.1, false },
    {"BAND_ERROR", "degC", 0.015625, false },
    {"PEAK", "degC", 0.015625, true },
    {"ON_TIME_H", "s", 6553.6, false },
    {"ON_TIME_L", "s", 0.1, false },
    {"AT_STATE", "", 1.0, false },
    {"AT_KU", "1/K", 1.52587890625e-05, false },
    {"AT_TU", "TS", 0.25, false },
    {"AT_DUTY", "%", 0.01, false },
} };

// Bit numbers of STATUS, and their names.
enum StatusBit : std::uint8_t {
  kStatusRun = 0,
  kStatusAtTemperature = 1,
  kStatusFullSegment = 2,
  kStatusPidSegment = 3,
  kStatusOffSegment = 4,
  kStatusRampActive = 5,
  kStatusDutyNearItsLimit = 6,
  kStatusWritesPending = 7,
  kStatusHold = 8,
  kStatusLocked = 9,
  kStatusSensorOk = 10,
  kStatusIntegralHeld = 11,
  kStatusWatchdogArmed = 12,
  kStatusSampleHeld = 13,
  kStatusSafeEnActive = 14,
  kStatusFault = 15,
};
inline constexpr std::array<std::string_view, 16> kStatusBits{ {
    "run",
    "at temperature",
    "full segment",
    "PID segment",
    "off segment",
    "ramp active",
    "duty near its limit",
    "writes pending",
    "hold",
    "locked",
    "sensor ok",
    "integral held",
    "watchdog armed",
    "sample held",
    "safe_en active",
    "fault",
} };

// Bit numbers of the fields of registers; a wider field has a mask of its bits.
enum FirstFaultBit : std::uint8_t {
  kFirstFaultState = 0,
  kFirstFaultCode = 8,
};
inline constexpr std::uint16_t kFirstFaultStateMask = 0x00FF;
inline constexpr std::uint16_t kFirstFaultCodeMask = 0xFF00;
enum AtStateBit : std::uint8_t {
  kAtStateEnd = 0,
  kAtStateCycles = 8,
};
inline constexpr std::uint16_t kAtStateEndMask = 0x00FF;
inline constexpr std::uint16_t kAtStateCyclesMask = 0xFF00;
enum ModeBit : std::uint8_t {
  kModeManual = 0,
};
enum CtrlBit : std::uint8_t {
  kCtrlSegModel = 0,
  kCtrlDOnPv = 1,
  kCtrlFfEn = 2,
  kCtrlErrInteger = 3,
  kCtrlDither = 4,
  kCtrlFbEn = 5,
  kCtrlIZero = 6,
  kCtrlHeatRate = 7,
};
inline constexpr std::uint16_t kCtrlHeatRateMask = 0xFF80;
enum SensFrameBit : std::uint8_t {
  kSensFrameLength = 0,
  kSensFrameSpiMode = 6,
  kSensFrameLow = 8,
  kSensFrameSigned = 13,
};
inline constexpr std::uint16_t kSensFrameLengthMask = 0x003F;
inline constexpr std::uint16_t kSensFrameSpiModeMask = 0x00C0;
inline constexpr std::uint16_t kSensFrameLowMask = 0x1F00;
enum SensDataBit : std::uint8_t {
  kSensDataBits = 0,
  kSensDataFirstSent = 8,
};
inline constexpr std::uint16_t kSensDataBitsMask = 0x001F;
inline constexpr std::uint16_t kSensDataFirstSentMask = 0xFF00;
enum FormatBit : std::uint8_t {
  kFormatCharacter = 0,
  kFormatPause = 2,
};
inline constexpr std::uint16_t kFormatCharacterMask = 0x0003;

// The field of a word that has this mask.
constexpr unsigned field_of(std::uint16_t word, std::uint16_t mask) {
  return static_cast<unsigned>(word & mask) >> std::countr_zero(mask);
}
// A word with these bits set.
template <class Bit>
constexpr std::uint16_t word_of(std::initializer_list<Bit> set) {
  unsigned word = 0;
  for (const Bit bit : set) word |= 1U << bit;
  return static_cast<std::uint16_t>(word);
}

// Values that stand for no value.
inline constexpr std::uint16_t kPvNone = 0x8000;

// Number formats: bits behind the point.
inline constexpr unsigned kTempFraction = 6;
inline constexpr unsigned kDutyFraction = 16;
inline constexpr unsigned kKpFraction = 6;
inline constexpr unsigned kKiFraction = 14;
inline constexpr unsigned kKdFraction = 3;
inline constexpr unsigned kKffFraction = 12;
inline constexpr unsigned kIntegFraction = 14;

// Main state machine.
enum State : std::uint8_t {
  kStIdle = 0b00000,
  kStCmdDecode = 0b00011,
  kStExtrParam = 0b00101,
  kStWrParam = 0b00110,
  kStCmdReady = 0b01001,
  kStReadTemp = 0b01010,
  kStTempDisplay = 0b01100,
  kStInitAlgor = 0b01111,
  kStCfgPwm = 0b10001,
};

struct StateInfo {
  State code;
  std::string_view name;
};

inline constexpr std::array<StateInfo, 9> kStates{ {
    {kStIdle, "Idle"},
    {kStCmdDecode, "CmdDecode"},
    {kStExtrParam, "ExtrParam"},
    {kStWrParam, "WrParam"},
    {kStCmdReady, "CmdReady"},
    {kStReadTemp, "ReadTemp"},
    {kStTempDisplay, "TempDisplay"},
    {kStInitAlgor, "InitAlgor"},
    {kStCfgPwm, "CfgPwm"},
} };

struct StateArc {
  State from;
  State to;
};

inline constexpr std::array kStateArcs{
    StateArc{kStIdle, kStCmdDecode },
    StateArc{kStCmdDecode, kStExtrParam },
    StateArc{kStCmdDecode, kStCmdReady },
    StateArc{kStExtrParam, kStWrParam },
    StateArc{kStWrParam, kStExtrParam },
    StateArc{kStWrParam, kStCmdReady },
    StateArc{kStCmdReady, kStCmdDecode },
    StateArc{kStCmdReady, kStReadTemp },
    StateArc{kStReadTemp, kStTempDisplay },
    StateArc{kStTempDisplay, kStInitAlgor },
    StateArc{kStInitAlgor, kStCfgPwm },
    StateArc{kStCfgPwm, kStCmdDecode },
    StateArc{kStCfgPwm, kStReadTemp },
};

// Name of a state code, "illegal" for any other.
constexpr std::string_view state_name(std::uint8_t code) {
  for (const StateInfo& s : kStates) {
    if (s.code == code) return s.name;
  }
  return "illegal";
}

constexpr bool state_legal(std::uint8_t code) { return state_name(code) != "illegal"; }

// Fault causes, bit numbers of FAULT and CAUSE.
enum Fault : std::uint8_t {
  kFaultOverTemp = 0,
  kFaultUnderTemp = 1,
  kFaultSensorFault = 2,
  kFaultSensorFrame = 3,
  kFaultSensorStale = 4,
  kFaultRate = 5,
  kFaultNotHeating = 6,
  kFaultHoldPower = 7,
  kFaultExcursion = 8,
  kFaultZeroRise = 9,
  kFaultHeaterFb = 10,
  kFaultHostWatchdog = 11,
  kFaultParam = 12,
  kFaultState = 13,
  kFaultInhibit = 14,
};
inline constexpr unsigned kFaultCount = 15;
// Causes that latch only while heating is on.
inline constexpr std::uint16_t kFaultRunOnly = 0b000100111111110;

struct FaultInfo {
  std::string_view name;
  std::string_view doc;
};
inline constexpr std::array<FaultInfo, kFaultCount> kFaults{ {
    {"OverTemp", "An accepted sample reached T_MAX."},
    {"UnderTemp", "An accepted sample fell below T_MIN."},
    {"SensorFault", "The sensor reported open or short for BAD_MAX samples in a row."},
    {"SensorFrame", "Frames failed the reserved-bit or stuck-line check for BAD_MAX samples in a row."},
    {"SensorStale", "No accepted sample for SAMPLE_TIMEOUT, or a frozen one: zero duty for LBA_TIME, 20 degC above T_AMB, and no sample moved."},
    {"Rate", "Temperature moved by more than DTDT_MAX within 1 s, or by half of it at once, and BAD_MAX samples in a row say so."},
    {"NotHeating", "Duty within 1/16 of its limit for LBA_TIME and the temperature rose by less than LBA_RISE (loop break); or the temperature is far below where the heat of the duty leads (heat balance)."},
    {"HoldPower", "Mean duty above HOLD_MULT x KFF (T - T_AMB) + HOLD_ADD for HOLD_TIME inside the control band, no rise by LBA_RISE, and then, at no more than half of that duty, no fall by LBA_RISE within twice LBA_TIME."},
    {"Excursion", "Temperature above the set-point by EXC_LIMIT for EXC_TIME."},
    {"ZeroRise", "Temperature rose by ZERO_RISE although the duty had been zero for ZERO_WAIT (shorted switch); or it is far above where the heat of the duty leads (heat balance)."},
    {"HeaterFb", "heater_fb_i differed from heater_o for FB_TIME (checked while CTRL.FB_EN)."},
    {"HostWatchdog", "No valid frame to this address or broadcast for HOST_WD."},
    {"Param", "A parameter set held flips that MEM can not correct."},
    {"State", "Illegal code or broken order in the main state machine, a control tick that was not finished before the next, or an upset flop that decides over the heater."},
    {"Inhibit", "inhibit_i was high."},
} };

// The fault of register FIRST_FAULT, whose code is one more than the fault's bit.
constexpr std::optional<Fault> first_fault(std::uint16_t word) {
  const unsigned code = field_of(word, kFirstFaultCodeMask);
  if (code == 0 || code > kFaultCount) return std::nullopt;
  return static_cast<Fault>(code - 1);
}

enum Cmd : std::uint16_t {
  kCmdStop = 0x0000,
  kCmdRun = 0xA501,
  kCmdClearFault = 0xA5F0,
  kCmdHold = 0xA5B0,
  kCmdCommit = 0xA5C0,
  kCmdDiscard = 0xA5D0,
  kCmdTune = 0xA5A7,
};
inline constexpr std::array<Cmd, 7> kCommands{
    kCmdStop,
    kCmdRun,
    kCmdClearFault,
    kCmdHold,
    kCmdCommit,
    kCmdDiscard,
    kCmdTune,
};

// Modbus: function codes, exception codes, and the kinds of answer from PARAMC to UARTC.
inline constexpr std::uint16_t kMaxRead = 32;  // registers of one read
inline constexpr std::uint8_t kBroadcastAddress = 0;
inline constexpr std::uint8_t kExceptionFlag = 0x80;  // set in the function code of a refusal
inline constexpr std::uint8_t kMeiType = 14;  // of kFcEncapsulated: read device identification
inline constexpr std::uint8_t kIdentificationObject = 4;  // its read code for one object

enum Function : std::uint8_t {
  kFcReadHolding = 3,
  kFcReadInput = 4,
  kFcWriteSingle = 6,
  kFcDiagnostics = 8,
  kFcWriteMultiple = 16,
  kFcReportServerId = 17,
  kFcEncapsulated = 43,
};
inline constexpr std::array kFunctions{ kFcReadHolding, kFcReadInput, kFcWriteSingle, kFcDiagnostics, kFcWriteMultiple, kFcReportServerId, kFcEncapsulated };

enum Exception : std::uint8_t {
  kExcNone = 0,
  kExcFunction = 1,  // The function is not known.
  kExcAddress = 2,  // A register outside the map.
  kExcValue = 3,  // A value outside its range, or a frame of the wrong length.
  kExcDevice = 4,  // Not in this state.
  kExcBusy = 6,  // An earlier command is still in work.
};
inline constexpr std::array kExceptions{ kExcFunction, kExcAddress, kExcValue, kExcDevice, kExcBusy };  // those that a host is told

enum RspKind : std::uint8_t {
  kRspNone = 0,  // Nothing: the command was a broadcast.
  kRspException = 1,  // Function with its highest bit set, exception code.
  kRspRead = 2,  // Byte count and registers.
  kRspEcho = 3,  // The first bytes of the command again.
  kRspServerId = 4,  // Name of the chip and whether it heats.
  kRspIdStream = 5,  // Device identification, all objects.
  kRspIdObject = 6,  // Device identification, the object asked for.
};

// Character formats of the serial lines: field CHARACTER of register FORMAT.
enum CharacterFormat : std::uint8_t {
  kFormat8E1 = 0,
  kFormat8O1 = 1,
  kFormat8N2 = 2,
  kFormat8N1 = 3,
};
struct CharacterInfo {
  std::string_view name;
  char parity;  // 'E', 'O' or 'N'
  std::uint8_t stop_bits;
};
// Indexed by the field.
inline constexpr std::array<CharacterInfo, 4> kCharacters{ {
    {"8E1", 'E', 1 },
    {"8O1", 'O', 1 },
    {"8N2", 'N', 2 },
    {"8N1", 'N', 1 },
} };

// Field END of register AT_STATE.
enum TuningEnd : std::uint8_t {
  kTuningNeverRan = 0,  // No autotune since reset.
  kTuningRuns = 1,  // One is under way.
  kTuningFinished = 2,  // The gains are in place.
  kTuningStopped = 3,  // Ended by STOP or a fault.
  kTuningTimedOut = 4,  // The relay did not switch in time; heater off.
};
inline constexpr std::array kTuningEnds{ kTuningNeverRan, kTuningRuns, kTuningFinished, kTuningStopped, kTuningTimedOut };

// Segments of the control law.
enum Segment : std::uint8_t {
  kSegNone = 0,  // Not heating, by hand or in autotune.
  kSegFull = 1,  // Far below the set-point: DUTY_MAX.
  kSegPid = 2,  // Inside the band: PID.
  kSegOff = 3,  // Far above the set-point: zero.
};
inline constexpr std::array kSegments{ kSegNone, kSegFull, kSegPid, kSegOff };

// Autotune: relay and rule, factors of docs/chip/blocks/atune.md.
inline constexpr std::int32_t kTuneHysteresis = 32;  // 1/64 degC
inline constexpr unsigned kTuneAdaptCycles = 3;
inline constexpr unsigned kTuneCycles = 7;
inline constexpr unsigned kTuneLimit = 16383;  // 0.1 s
inline constexpr std::uint32_t kTuneKuFactor = 326;
inline constexpr std::uint32_t kTuneKpFactor = 110;
inline constexpr std::uint32_t kTuneKiApproachFactor = 542;
inline constexpr std::uint32_t kTuneKiHoldFactor = 706;
inline constexpr std::uint32_t kTuneKdDivisor = 667;

// Parity rows of the (22,16) Hsiao SECDED code: check bit r covers the data bits set in row r.
inline constexpr std::array<std::uint16_t, 6> kSecdedRows{ 0x2CB7, 0x555B, 0x9A6D, 0xE38E, 0x03F0, 0xFC00 };
// Six-bit syndrome of a flip in data bit i.
inline constexpr std::array<std::uint8_t, 16> kSecdedColumns{ 7, 11, 13, 14, 19, 21, 22, 25, 26, 28, 35, 37, 38, 41, 42, 44 };

struct SensorPreset {
  std::string_view name;
  std::uint16_t frame;
  std::uint16_t data;
  std::uint16_t scale;
  std::uint16_t offset;
  std::uint16_t fault_mask;
  std::uint32_t check_mask;
  std::uint32_t check_value;
  std::uint16_t setup;
  std::uint16_t min_ts_ms;  // shortest control period with a fresh conversion each time
  double highest_degc;      // up to where the part measures; no limit above it can trip
};

// Indexed by SENS_TYPE; entry 0 stands for the SENS_* registers.
inline constexpr std::array<SensorPreset, 7> kSensorPresets{ {
    {"custom", 0, 0, 0, 0, 0, 0, 0, 0, 0, std::numeric_limits<double>::infinity()},
    {"MAX31855", 0x3220, 0x000E, 4096, 0x0000, 0x0007, 0x00030008, 0x00000000, 0x0000, 100, 1350.0 },
    {"MAX6675", 0x0310, 0x000C, 4096, 0x0000, 0x0004, 0x00008002, 0x00000000, 0x0000, 220, 1023.75 },
    {"MAX31865", 0x0158, 0x010F, 512, 0xC000, 0x0001, 0x00000000, 0x00000000, 0x80C3, 20, 767.96875 },
    {"ADT7320", 0x20D8, 0x5010, 128, 0x0000, 0x0000, 0x00000000, 0x00000000, 0x0880, 240, 150.0 },
    {"ADT7310", 0x20D8, 0x5010, 128, 0x0000, 0x0000, 0x00000000, 0x00000000, 0x0880, 240, 150.0 },
    {"LM70", 0x2510, 0x000B, 4096, 0x0000, 0x0000, 0x0000001C, 0x0000001C, 0x0000, 210, 150.0 },
} };

struct IdentPart {
  std::uint8_t start;
  std::uint8_t length;
};
inline constexpr IdentPart kIdentServer{ 0, 13 };
inline constexpr std::array<IdentPart, 3> kIdentObjects{ { { 13, 9 }, { 22, 3 }, { 25, 3 } } };
inline constexpr std::string_view kIdentBytes = "Meltstage TC1MeltstageTC10.1";

}  // namespace meltstage::chip::spec
