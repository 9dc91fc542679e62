// SPDX-License-Identifier: Apache-2.0
// Generated from spec/*.toml by spec/generate.py; edit those.
// Constants of the chip: register indices, ranges and reset values, states, fault and command codes, sensor presets.

package tc_pkg;

  localparam int unsigned ClkHz = 12000000;
  localparam logic [15:0] DeviceId = 16'h7C01;
  localparam logic [15:0] Version = 16'h0001;
  localparam logic [15:0] MapCrc = 16'hA3C3;
  localparam int unsigned ScanChains = 8;
  localparam int unsigned TestSpeedup = 100;
  localparam logic [15:0] WriteWords = 16'd16;
  localparam logic [15:0] SetpointMargin = 16'd50;

  // Register spaces, Modbus PDU addresses.
  localparam int unsigned InputCount = 34;
  localparam int unsigned HoldingCount = 61;
  localparam logic [15:0] HoldingBase = 16'h0100;

  localparam logic [5:0] InStatus = 6'd0;
  localparam logic [5:0] InPv = 6'd1;
  localparam logic [5:0] InSpWork = 6'd2;
  localparam logic [5:0] InDuty = 6'd3;
  localparam logic [5:0] InFault = 6'd4;
  localparam logic [5:0] InFirstFault = 6'd5;
  localparam logic [5:0] InPvFine = 6'd6;
  localparam logic [5:0] InPvSlope = 6'd7;
  localparam logic [5:0] InTermP = 6'd8;
  localparam logic [5:0] InTermI = 6'd9;
  localparam logic [5:0] InTermD = 6'd10;
  localparam logic [5:0] InRawH = 6'd11;
  localparam logic [5:0] InRawL = 6'd12;
  localparam logic [5:0] InSamples = 6'd13;
  localparam logic [5:0] InWdLeft = 6'd14;
  localparam logic [5:0] InCause = 6'd15;
  localparam logic [5:0] InCrcErrors = 6'd16;
  localparam logic [5:0] InCharErrors = 6'd17;
  localparam logic [5:0] InMessages = 6'd18;
  localparam logic [5:0] InSensorErrors = 6'd19;
  localparam logic [5:0] InMemCorrected = 6'd20;
  localparam logic [5:0] InDeviceId = 6'd21;
  localparam logic [5:0] InVersion = 6'd22;
  localparam logic [5:0] InMapCrc = 6'd23;
  localparam logic [5:0] InOvershoot = 6'd24;
  localparam logic [5:0] InBandTime = 6'd25;
  localparam logic [5:0] InBandError = 6'd26;
  localparam logic [5:0] InPeak = 6'd27;
  localparam logic [5:0] InOnTimeH = 6'd28;
  localparam logic [5:0] InOnTimeL = 6'd29;
  localparam logic [5:0] InAtState = 6'd30;
  localparam logic [5:0] InAtKu = 6'd31;
  localparam logic [5:0] InAtTu = 6'd32;
  localparam logic [5:0] InAtDuty = 6'd33;

  localparam logic [5:0] RegCmd = 6'd0;
  localparam logic [5:0] RegSetpoint = 6'd1;
  localparam logic [5:0] RegRampUp = 6'd2;
  localparam logic [5:0] RegRampDown = 6'd3;
  localparam logic [5:0] RegMode = 6'd4;
  localparam logic [5:0] RegManualDuty = 6'd5;
  localparam logic [5:0] RegFfExt = 6'd6;
  localparam logic [5:0] RegHostWd = 6'd7;
  localparam logic [5:0] RegTlmPeriod = 6'd8;
  localparam logic [5:0] RegAtWindow = 6'd9;
  localparam logic [5:0] RegAtDwell = 6'd10;
  localparam logic [5:0] RegLock = 6'd11;
  localparam logic [5:0] RegCtrl = 6'd12;
  localparam logic [5:0] RegKp = 6'd13;
  localparam logic [5:0] RegKiApproach = 6'd14;
  localparam logic [5:0] RegKiHold = 6'd15;
  localparam logic [5:0] RegKd = 6'd16;
  localparam logic [5:0] RegDFilter = 6'd17;
  localparam logic [5:0] RegKff = 6'd18;
  localparam logic [5:0] RegTAmb = 6'd19;
  localparam logic [5:0] RegBandFull = 6'd20;
  localparam logic [5:0] RegBandOff = 6'd21;
  localparam logic [5:0] RegDutyMax = 6'd22;
  localparam logic [5:0] RegSlew = 6'd23;
  localparam logic [5:0] RegTs = 6'd24;
  localparam logic [5:0] RegTMax = 6'd25;
  localparam logic [5:0] RegTMin = 6'd26;
  localparam logic [5:0] RegExcLimit = 6'd27;
  localparam logic [5:0] RegExcTime = 6'd28;
  localparam logic [5:0] RegLbaTime = 6'd29;
  localparam logic [5:0] RegLbaRise = 6'd30;
  localparam logic [5:0] RegHoldMult = 6'd31;
  localparam logic [5:0] RegHoldAdd = 6'd32;
  localparam logic [5:0] RegHoldTime = 6'd33;
  localparam logic [5:0] RegDtdtMax = 6'd34;
  localparam logic [5:0] RegZeroRise = 6'd35;
  localparam logic [5:0] RegZeroWait = 6'd36;
  localparam logic [5:0] RegBadMax = 6'd37;
  localparam logic [5:0] RegSampleTimeout = 6'd38;
  localparam logic [5:0] RegFbTime = 6'd39;
  localparam logic [5:0] RegSensType = 6'd40;
  localparam logic [5:0] RegSensFrame = 6'd41;
  localparam logic [5:0] RegSensData = 6'd42;
  localparam logic [5:0] RegSensScale = 6'd43;
  localparam logic [5:0] RegSensOffset = 6'd44;
  localparam logic [5:0] RegSensFaultMask = 6'd45;
  localparam logic [5:0] RegSensCheckMaskH = 6'd46;
  localparam logic [5:0] RegSensCheckMaskL = 6'd47;
  localparam logic [5:0] RegSensCheckValueH = 6'd48;
  localparam logic [5:0] RegSensCheckValueL = 6'd49;
  localparam logic [5:0] RegSensSetup = 6'd50;
  localparam logic [5:0] RegSensTrim = 6'd51;
  localparam logic [5:0] RegSpiDiv = 6'd52;
  localparam logic [5:0] RegPwmPrescale = 6'd53;
  localparam logic [5:0] RegPwmPeriod = 6'd54;
  localparam logic [5:0] RegPwmMinOn = 6'd55;
  localparam logic [5:0] RegAddress = 6'd56;
  localparam logic [5:0] RegBaud = 6'd57;
  localparam logic [5:0] RegFormat = 6'd58;
  localparam logic [5:0] RegPreset = 6'd59;
  localparam logic [5:0] RegFfDrop = 6'd60;

  // STATUS, a bit each.
  typedef struct packed {
    logic fault;
    logic safe_en_active;
    logic sample_held;
    logic watchdog_armed;
    logic integral_held;
    logic sensor_ok;
    logic locked;
    logic hold;
    logic writes_pending;
    logic duty_near_its_limit;
    logic ramp_active;
    logic off_segment;
    logic pid_segment;
    logic full_segment;
    logic at_temperature;
    logic run;
  } status_t;

  // Lowest bits of the fields of registers, and the widths of wider ones.
  localparam int unsigned ModeManual = 0;
  localparam int unsigned CtrlSegModel = 0;
  localparam int unsigned CtrlDOnPv = 1;
  localparam int unsigned CtrlFfEn = 2;
  localparam int unsigned CtrlErrInteger = 3;
  localparam int unsigned CtrlDither = 4;
  localparam int unsigned CtrlFbEn = 5;
  localparam int unsigned CtrlIZero = 6;
  localparam int unsigned CtrlHeatRate = 7;
  localparam int unsigned CtrlHeatRateWidth = 9;
  localparam int unsigned SensFrameLength = 0;
  localparam int unsigned SensFrameLengthWidth = 6;
  localparam int unsigned SensFrameSpiMode = 6;
  localparam int unsigned SensFrameSpiModeWidth = 2;
  localparam int unsigned SensFrameLow = 8;
  localparam int unsigned SensFrameLowWidth = 5;
  localparam int unsigned SensFrameSigned = 13;
  localparam int unsigned SensDataBits = 0;
  localparam int unsigned SensDataBitsWidth = 5;
  localparam int unsigned SensDataFirstSent = 8;
  localparam int unsigned SensDataFirstSentWidth = 8;
  localparam int unsigned FormatCharacter = 0;
  localparam int unsigned FormatCharacterWidth = 2;
  localparam int unsigned FormatPause = 2;

  // Values that stand for no value.
  localparam logic [15:0] PvNone = 16'h8000;

  // The active parameter set. Holding register i stands at bits [16*i +: 16] (entry 0, CMD, is not stored).
  typedef struct packed {
    logic [15:0] ff_drop;
    logic [15:0] preset;
    logic [15:0] format;
    logic [15:0] baud;
    logic [15:0] address;
    logic [15:0] pwm_min_on;
    logic [15:0] pwm_period;
    logic [15:0] pwm_prescale;
    logic [15:0] spi_div;
    logic [15:0] sens_trim;
    logic [15:0] sens_setup;
    logic [15:0] sens_check_value_l;
    logic [15:0] sens_check_value_h;
    logic [15:0] sens_check_mask_l;
    logic [15:0] sens_check_mask_h;
    logic [15:0] sens_fault_mask;
    logic [15:0] sens_offset;
    logic [15:0] sens_scale;
    logic [15:0] sens_data;
    logic [15:0] sens_frame;
    logic [15:0] sens_type;
    logic [15:0] fb_time;
    logic [15:0] sample_timeout;
    logic [15:0] bad_max;
    logic [15:0] zero_wait;
    logic [15:0] zero_rise;
    logic [15:0] dtdt_max;
    logic [15:0] hold_time;
    logic [15:0] hold_add;
    logic [15:0] hold_mult;
    logic [15:0] lba_rise;
    logic [15:0] lba_time;
    logic [15:0] exc_time;
    logic [15:0] exc_limit;
    logic [15:0] t_min;
    logic [15:0] t_max;
    logic [15:0] ts;
    logic [15:0] slew;
    logic [15:0] duty_max;
    logic [15:0] band_off;
    logic [15:0] band_full;
    logic [15:0] t_amb;
    logic [15:0] kff;
    logic [15:0] d_filter;
    logic [15:0] kd;
    logic [15:0] ki_hold;
    logic [15:0] ki_approach;
    logic [15:0] kp;
    logic [15:0] ctrl;
    logic [15:0] lock;
    logic [15:0] at_dwell;
    logic [15:0] at_window;
    logic [15:0] tlm_period;
    logic [15:0] host_wd;
    logic [15:0] ff_ext;
    logic [15:0] manual_duty;
    logic [15:0] mode;
    logic [15:0] ramp_down;
    logic [15:0] ramp_up;
    logic [15:0] setpoint;
    logic [15:0] cmd;
  } params_t;

  function automatic logic [15:0] reg_reset(input logic [5:0] index);
    case (index)
      6'd0: reg_reset = 16'h0000;  // CMD
      6'd1: reg_reset = 16'h0000;  // SETPOINT
      6'd2: reg_reset = 16'h0000;  // RAMP_UP
      6'd3: reg_reset = 16'h0000;  // RAMP_DOWN
      6'd4: reg_reset = 16'h0000;  // MODE
      6'd5: reg_reset = 16'h0000;  // MANUAL_DUTY
      6'd6: reg_reset = 16'h0000;  // FF_EXT
      6'd7: reg_reset = 16'h0064;  // HOST_WD
      6'd8: reg_reset = 16'h0000;  // TLM_PERIOD
      6'd9: reg_reset = 16'h000A;  // AT_WINDOW
      6'd10: reg_reset = 16'h0032;  // AT_DWELL
      6'd11: reg_reset = 16'h0000;  // LOCK
      6'd12: reg_reset = 16'h0037;  // CTRL
      6'd13: reg_reset = 16'h140B;  // KP
      6'd14: reg_reset = 16'h04CD;  // KI_APPROACH
      6'd15: reg_reset = 16'h0642;  // KI_HOLD
      6'd16: reg_reset = 16'h4401;  // KD
      6'd17: reg_reset = 16'h0004;  // D_FILTER
      6'd18: reg_reset = 16'h49BA;  // KFF
      6'd19: reg_reset = 16'h00FA;  // T_AMB
      6'd20: reg_reset = 16'h00B4;  // BAND_FULL
      6'd21: reg_reset = 16'h1388;  // BAND_OFF
      6'd22: reg_reset = 16'h2710;  // DUTY_MAX
      6'd23: reg_reset = 16'h0000;  // SLEW
      6'd24: reg_reset = 16'h0064;  // TS
      6'd25: reg_reset = 16'h05DC;  // T_MAX
      6'd26: reg_reset = 16'h0000;  // T_MIN
      6'd27: reg_reset = 16'h0096;  // EXC_LIMIT
      6'd28: reg_reset = 16'h0032;  // EXC_TIME
      6'd29: reg_reset = 16'h0168;  // LBA_TIME
      6'd30: reg_reset = 16'h0014;  // LBA_RISE
      6'd31: reg_reset = 16'h014D;  // HOLD_MULT
      6'd32: reg_reset = 16'h01F4;  // HOLD_ADD
      6'd33: reg_reset = 16'h012C;  // HOLD_TIME
      6'd34: reg_reset = 16'h0032;  // DTDT_MAX
      6'd35: reg_reset = 16'h0050;  // ZERO_RISE
      6'd36: reg_reset = 16'h012C;  // ZERO_WAIT
      6'd37: reg_reset = 16'h0003;  // BAD_MAX
      6'd38: reg_reset = 16'h0014;  // SAMPLE_TIMEOUT
      6'd39: reg_reset = 16'h0030;  // FB_TIME
      6'd40: reg_reset = 16'h0001;  // SENS_TYPE
      6'd41: reg_reset = 16'h3220;  // SENS_FRAME
      6'd42: reg_reset = 16'h000E;  // SENS_DATA
      6'd43: reg_reset = 16'h1000;  // SENS_SCALE
      6'd44: reg_reset = 16'h0000;  // SENS_OFFSET
      6'd45: reg_reset = 16'h0007;  // SENS_FAULT_MASK
      6'd46: reg_reset = 16'h0003;  // SENS_CHECK_MASK_H
      6'd47: reg_reset = 16'h0008;  // SENS_CHECK_MASK_L
      6'd48: reg_reset = 16'h0000;  // SENS_CHECK_VALUE_H
      6'd49: reg_reset = 16'h0000;  // SENS_CHECK_VALUE_L
      6'd50: reg_reset = 16'h0000;  // SENS_SETUP
      6'd51: reg_reset = 16'h0000;  // SENS_TRIM
      6'd52: reg_reset = 16'h0005;  // SPI_DIV
      6'd53: reg_reset = 16'h0000;  // PWM_PRESCALE
      6'd54: reg_reset = 16'h2EE0;  // PWM_PERIOD
      6'd55: reg_reset = 16'h0000;  // PWM_MIN_ON
      6'd56: reg_reset = 16'h0000;  // ADDRESS
      6'd57: reg_reset = 16'h0480;  // BAUD
      6'd58: reg_reset = 16'h0000;  // FORMAT
      6'd59: reg_reset = 16'h0032;  // PRESET
      6'd60: reg_reset = 16'h0000;  // FF_DROP
      default: reg_reset = 16'h0000;
    endcase
  endfunction

  function automatic logic [15:0] reg_min(input logic [5:0] index);
    case (index)
      6'd19: reg_min = 16'hFE70;  // T_AMB
      6'd24: reg_min = 16'h000A;  // TS
      6'd26: reg_min = 16'hFE70;  // T_MIN
      6'd27: reg_min = 16'h000A;  // EXC_LIMIT
      6'd30: reg_min = 16'h0001;  // LBA_RISE
      6'd37: reg_min = 16'h0001;  // BAD_MAX
      6'd38: reg_min = 16'h0001;  // SAMPLE_TIMEOUT
      6'd39: reg_min = 16'h0001;  // FB_TIME
      6'd44: reg_min = 16'h8000;  // SENS_OFFSET
      6'd51: reg_min = 16'hF800;  // SENS_TRIM
      6'd52: reg_min = 16'h0002;  // SPI_DIV
      6'd54: reg_min = 16'h0002;  // PWM_PERIOD
      6'd57: reg_min = 16'h000C;  // BAUD
      default: reg_min = 16'h0000;
    endcase
  endfunction

  function automatic logic [15:0] reg_max(input logic [5:0] index);
    case (index)
      6'd1: reg_max = 16'h1388;  // SETPOINT
      6'd2: reg_max = 16'h061A;  // RAMP_UP
      6'd3: reg_max = 16'h061A;  // RAMP_DOWN
      6'd4: reg_max = 16'h0001;  // MODE
      6'd5: reg_max = 16'h2710;  // MANUAL_DUTY
      6'd6: reg_max = 16'h2710;  // FF_EXT
      6'd9: reg_max = 16'h03E8;  // AT_WINDOW
      6'd17: reg_max = 16'h0006;  // D_FILTER
      6'd19: reg_max = 16'h03E8;  // T_AMB
      6'd20: reg_max = 16'h1388;  // BAND_FULL
      6'd21: reg_max = 16'h1388;  // BAND_OFF
      6'd22: reg_max = 16'h2710;  // DUTY_MAX
      6'd23: reg_max = 16'h2710;  // SLEW
      6'd24: reg_max = 16'h07D0;  // TS
      6'd25: reg_max = 16'h1388;  // T_MAX
      6'd26: reg_max = 16'h03E8;  // T_MIN
      6'd27: reg_max = 16'h1388;  // EXC_LIMIT
      6'd30: reg_max = 16'h03E8;  // LBA_RISE
      6'd32: reg_max = 16'h2710;  // HOLD_ADD
      6'd34: reg_max = 16'h1388;  // DTDT_MAX
      6'd35: reg_max = 16'h1388;  // ZERO_RISE
      6'd37: reg_max = 16'h000F;  // BAD_MAX
      6'd40: reg_max = 16'h0006;  // SENS_TYPE
      6'd41: reg_max = 16'h3FFF;  // SENS_FRAME
      6'd42: reg_max = 16'hFF1F;  // SENS_DATA
      6'd44: reg_max = 16'h7FFF;  // SENS_OFFSET
      6'd51: reg_max = 16'h07FF;  // SENS_TRIM
      6'd52: reg_max = 16'h00FF;  // SPI_DIV
      6'd55: reg_max = 16'h7FFF;  // PWM_MIN_ON
      6'd56: reg_max = 16'h00F7;  // ADDRESS
      6'd57: reg_max = 16'h1388;  // BAUD
      6'd58: reg_max = 16'h0007;  // FORMAT
      6'd59: reg_max = 16'h0100;  // PRESET
      default: reg_max = 16'hFFFF;
    endcase
  endfunction

  // What MEM stores of a word, check bits above data: the others are 0 with every value in range. Behind the registers
  // its columns.
  function automatic logic [21:0] reg_stored(input logic [5:0] index);
    case (index)
      6'd0: reg_stored = 22'h000000;  // CMD
      6'd1: reg_stored = 22'h011FFF;  // SETPOINT
      6'd2: reg_stored = 22'h0107FF;  // RAMP_UP
      6'd3: reg_stored = 22'h0107FF;  // RAMP_DOWN
      6'd4: reg_stored = 22'h010001;  // MODE
      6'd5: reg_stored = 22'h013FFF;  // MANUAL_DUTY
      6'd6: reg_stored = 22'h013FFF;  // FF_EXT
      6'd7: reg_stored = 22'h01FFFF;  // HOST_WD
      6'd8: reg_stored = 22'h01FFFF;  // TLM_PERIOD
      6'd9: reg_stored = 22'h0103FF;  // AT_WINDOW
      6'd10: reg_stored = 22'h01FFFF;  // AT_DWELL
      6'd11: reg_stored = 22'h01FFFF;  // LOCK
      6'd12: reg_stored = 22'h01FFFF;  // CTRL
      6'd13: reg_stored = 22'h01FFFF;  // KP
      6'd14: reg_stored = 22'h01FFFF;  // KI_APPROACH
      6'd15: reg_stored = 22'h01FFFF;  // KI_HOLD
      6'd16: reg_stored = 22'h01FFFF;  // KD
      6'd17: reg_stored = 22'h010007;  // D_FILTER
      6'd18: reg_stored = 22'h01FFFF;  // KFF
      6'd19: reg_stored = 22'h01FFFF;  // T_AMB
      6'd20: reg_stored = 22'h011FFF;  // BAND_FULL
      6'd21: reg_stored = 22'h011FFF;  // BAND_OFF
      6'd22: reg_stored = 22'h013FFF;  // DUTY_MAX
      6'd23: reg_stored = 22'h013FFF;  // SLEW
      6'd24: reg_stored = 22'h3F07FF;  // TS
      6'd25: reg_stored = 22'h011FFF;  // T_MAX
      6'd26: reg_stored = 22'h01FFFF;  // T_MIN
      6'd27: reg_stored = 22'h011FFF;  // EXC_LIMIT
      6'd28: reg_stored = 22'h01FFFF;  // EXC_TIME
      6'd29: reg_stored = 22'h01FFFF;  // LBA_TIME
      6'd30: reg_stored = 22'h0103FF;  // LBA_RISE
      6'd31: reg_stored = 22'h01FFFF;  // HOLD_MULT
      6'd32: reg_stored = 22'h013FFF;  // HOLD_ADD
      6'd33: reg_stored = 22'h01FFFF;  // HOLD_TIME
      6'd34: reg_stored = 22'h011FFF;  // DTDT_MAX
      6'd35: reg_stored = 22'h011FFF;  // ZERO_RISE
      6'd36: reg_stored = 22'h01FFFF;  // ZERO_WAIT
      6'd37: reg_stored = 22'h01000F;  // BAD_MAX
      6'd38: reg_stored = 22'h01FFFF;  // SAMPLE_TIMEOUT
      6'd39: reg_stored = 22'h01FFFF;  // FB_TIME
      6'd40: reg_stored = 22'h010007;  // SENS_TYPE
      6'd41: reg_stored = 22'h013FFF;  // SENS_FRAME
      6'd42: reg_stored = 22'h01FFFF;  // SENS_DATA
      6'd43: reg_stored = 22'h01FFFF;  // SENS_SCALE
      6'd44: reg_stored = 22'h01FFFF;  // SENS_OFFSET
      6'd45: reg_stored = 22'h01FFFF;  // SENS_FAULT_MASK
      6'd46: reg_stored = 22'h01FFFF;  // SENS_CHECK_MASK_H
      6'd47: reg_stored = 22'h01FFFF;  // SENS_CHECK_MASK_L
      6'd48: reg_stored = 22'h01FFFF;  // SENS_CHECK_VALUE_H
      6'd49: reg_stored = 22'h01FFFF;  // SENS_CHECK_VALUE_L
      6'd50: reg_stored = 22'h01FFFF;  // SENS_SETUP
      6'd51: reg_stored = 22'h01FFFF;  // SENS_TRIM
      6'd52: reg_stored = 22'h0100FF;  // SPI_DIV
      6'd53: reg_stored = 22'h3FFFFF;  // PWM_PRESCALE
      6'd54: reg_stored = 22'h3FFFFF;  // PWM_PERIOD
      6'd55: reg_stored = 22'h017FFF;  // PWM_MIN_ON
      6'd56: reg_stored = 22'h0100FF;  // ADDRESS
      6'd57: reg_stored = 22'h011FFF;  // BAUD
      6'd58: reg_stored = 22'h010007;  // FORMAT
      6'd59: reg_stored = 22'h0101FF;  // PRESET
      6'd60: reg_stored = 22'h01FFFF;  // FF_DROP
      6'd61: reg_stored = 22'h3FFFFF;
      default: reg_stored = 22'h000000;
    endcase
  endfunction

  // Registers that MEM shows corrected already before its pass.
  function automatic logic reg_corrected(input logic [5:0] index);
    case (index)
6'd24, 6'd53, 6'd54: reg_corrected = 1'b1;
      default: reg_corrected = 1'b0;
    endcase
  endfunction

  // Two's complement registers.
  function automatic logic reg_signed(input logic [5:0] index);
    case (index)
6'd1, 6'd19, 6'd25, 6'd26, 6'd44, 6'd51: reg_signed = 1'b1;
      default: reg_signed = 1'b0;
    endcase
  endfunction

  // Main state machine; any two codes differ in at least two bits.
  typedef enum logic [4:0] {
    // After reset: waits for the host's first command.
    StIdle = 5'b00000,
    // Decodes the received command: function, length, address range, every value against its range.
    StCmdDecode = 5'b00011,
    // Extracts the next parameter from the command.
    StExtrParam = 5'b00101,
    // Writes it to the staged set of MEM, or carries out the command word.
    StWrParam = 5'b00110,
    // Parameters are in place; waits for the control tick or the next command.
    StCmdReady = 5'b01001,
    // SENSC reads the sensor.
    StReadTemp = 5'b01010,
    // Latches the input registers for the host and starts a telemetry frame when one is due.
    StTempDisplay = 5'b01100,
    // Hands temperature and parameters to ALGOR and waits for its result.
    StInitAlgor = 5'b01111,
    // Sets the PWM duty; then a new command if one came, else the next reading at the control tick.
    StCfgPwm = 5'b10001
  } state_e;

  function automatic logic state_legal(input logic [4:0] code);
    case (code)
5'b00000, 5'b00011, 5'b00101, 5'b00110, 5'b01001, 5'b01010, 5'b01100, 5'b01111, 5'b10001: state_legal = 1'b1;
      default: state_legal = 1'b0;
    endcase
  endfunction

  // Fault causes, bit numbers of FAULT and CAUSE.
  localparam int unsigned FaultCount = 15;
  localparam int unsigned FaultOverTemp = 0;
  localparam int unsigned FaultUnderTemp = 1;
  localparam int unsigned FaultSensorFault = 2;
  localparam int unsigned FaultSensorFrame = 3;
  localparam int unsigned FaultSensorStale = 4;
  localparam int unsigned FaultRate = 5;
  localparam int unsigned FaultNotHeating = 6;
  localparam int unsigned FaultHoldPower = 7;
  localparam int unsigned FaultExcursion = 8;
  localparam int unsigned FaultZeroRise = 9;
  localparam int unsigned FaultHeaterFb = 10;
  localparam int unsigned FaultHostWatchdog = 11;
  localparam int unsigned FaultParam = 12;
  localparam int unsigned FaultState = 13;
  localparam int unsigned FaultInhibit = 14;
  // Causes that latch only while heating is on.
  localparam logic [14:0] FaultRunOnly = 15'b000100111111110;

  localparam logic [15:0] CmdStop = 16'h0000;
  localparam logic [15:0] CmdRun = 16'hA501;
  localparam logic [15:0] CmdClearFault = 16'hA5F0;
  localparam logic [15:0] CmdHold = 16'hA5B0;
  localparam logic [15:0] CmdCommit = 16'hA5C0;
  localparam logic [15:0] CmdDiscard = 16'hA5D0;
  localparam logic [15:0] CmdTune = 16'hA5A7;

  // Modbus: most registers of one read, what a refusal sets in the function code, and words of FC 43/14.
  localparam logic [15:0] MaxRead = 16'd32;
  localparam logic [7:0] BroadcastAddress = 8'd0;
  localparam logic [7:0] ExceptionFlag = 8'h80;
  localparam logic [7:0] MeiType = 8'd14;
  localparam logic [7:0] IdentificationObject = 8'd4;
  // Input registers of a telemetry frame, from the first on.
  localparam logic [5:0] TelemetryWords = 6'd16;

  // Modbus function codes.
  localparam logic [7:0] FcReadHolding = 8'd3;
  localparam logic [7:0] FcReadInput = 8'd4;
  localparam logic [7:0] FcWriteSingle = 8'd6;
  localparam logic [7:0] FcDiagnostics = 8'd8;
  localparam logic [7:0] FcWriteMultiple = 8'd16;
  localparam logic [7:0] FcReportServerId = 8'd17;
  localparam logic [7:0] FcEncapsulated = 8'd43;

  // Modbus exception codes.
  localparam logic [7:0] ExcNone = 8'd0;
  localparam logic [7:0] ExcFunction = 8'd1;  // The function is not known.
  localparam logic [7:0] ExcAddress = 8'd2;  // A register outside the map.
  localparam logic [7:0] ExcValue = 8'd3;  // A value outside its range, or a frame of the wrong length.
  localparam logic [7:0] ExcDevice = 8'd4;  // Not in this state.
  localparam logic [7:0] ExcBusy = 8'd6;  // An earlier command is still in work.

  // Kinds of answer, from PARAMC to UARTC.
  localparam logic [2:0] RspNone = 3'd0;  // Nothing: the command was a broadcast.
  localparam logic [2:0] RspException = 3'd1;  // Function with its highest bit set, exception code.
  localparam logic [2:0] RspRead = 3'd2;  // Byte count and registers.
  localparam logic [2:0] RspEcho = 3'd3;  // The first bytes of the command again.
  localparam logic [2:0] RspServerId = 3'd4;  // Name of the chip and whether it heats.
  localparam logic [2:0] RspIdStream = 3'd5;  // Device identification, all objects.
  localparam logic [2:0] RspIdObject = 3'd6;  // Device identification, the object asked for.

  // Character formats of the serial lines: field CHARACTER of register FORMAT.
  localparam logic [1:0] Format8E1 = 2'd0;
  localparam logic [1:0] Format8O1 = 2'd1;
  localparam logic [1:0] Format8N2 = 2'd2;
  localparam logic [1:0] Format8N1 = 2'd3;

  // Segments of the control law.
  localparam logic [1:0] SegNone = 2'd0;  // Not heating, by hand or in autotune.
  localparam logic [1:0] SegFull = 2'd1;  // Far below the set-point: DUTY_MAX.
  localparam logic [1:0] SegPid = 2'd2;  // Inside the band: PID.
  localparam logic [1:0] SegOff = 2'd3;  // Far above the set-point: zero.

  // Autotune: relay and rule, factors of docs/chip/blocks/atune.md.
  localparam logic signed [16:0] TuneHysteresis = 17'sd32;
  localparam logic [2:0] TuneAdaptCycles = 3'd3;
  localparam logic [2:0] TuneCycles = 3'd7;
  localparam logic [13:0] TuneLimit = 14'd16383;
  localparam logic [17:0] TuneKuFactor = 18'd326;
  localparam logic [17:0] TuneKpFactor = 18'd110;
  localparam logic [17:0] TuneKiApproachFactor = 18'd542;
  localparam logic [17:0] TuneKiHoldFactor = 18'd706;
  localparam logic [17:0] TuneKdDivisor = 18'd667;

  // Parity rows of the (22,16) Hsiao SECDED code: check bit r covers the data bits set in row r.
  localparam logic [15:0] SecdedRow0 = 16'h2CB7;
  localparam logic [15:0] SecdedRow1 = 16'h555B;
  localparam logic [15:0] SecdedRow2 = 16'h9A6D;
  localparam logic [15:0] SecdedRow3 = 16'hE38E;
  localparam logic [15:0] SecdedRow4 = 16'h03F0;
  localparam logic [15:0] SecdedRow5 = 16'hFC00;

  // Sensor frame descriptions.
  typedef struct packed {
    logic [15:0] frame;
    logic [15:0] data;
    logic [15:0] scale;
    logic [15:0] offset;
    logic [15:0] fault_mask;
    logic [31:0] check_mask;
    logic [31:0] check_value;
    logic [15:0] setup;
  } sensor_t;

  function automatic sensor_t sensor_preset(input logic [2:0] code);
    case (code)
      3'd1:  // MAX31855
        sensor_preset = {16'h3220, 16'h000E, 16'h1000, 16'h0000,
                         16'h0007, 32'h00030008, 32'h00000000, 16'h0000};
      3'd2:  // MAX6675
        sensor_preset = {16'h0310, 16'h000C, 16'h1000, 16'h0000,
                         16'h0004, 32'h00008002, 32'h00000000, 16'h0000};
      3'd3:  // MAX31865
        sensor_preset = {16'h0158, 16'h010F, 16'h0200, 16'hC000,
                         16'h0001, 32'h00000000, 32'h00000000, 16'h80C3};
      3'd4:  // ADT7320
        sensor_preset = {16'h20D8, 16'h5010, 16'h0080, 16'h0000,
                         16'h0000, 32'h00000000, 32'h00000000, 16'h0880};
      3'd5:  // ADT7310
        sensor_preset = {16'h20D8, 16'h5010, 16'h0080, 16'h0000,
                         16'h0000, 32'h00000000, 32'h00000000, 16'h0880};
      3'd6:  // LM70
        sensor_preset = {16'h2510, 16'h000B, 16'h1000, 16'h0000,
                         16'h0000, 32'h0000001C, 32'h0000001C, 16'h0000};
      default: sensor_preset = 160'd0;
    endcase
  endfunction

  // Device identification (FC 17, FC 43/14).
  localparam logic [7:0] IdentServerStart = 8'd0;
  localparam logic [7:0] IdentServerLength = 8'd13;
  localparam int unsigned IdentObjects = 3;

  function automatic logic [7:0] ident_start(input logic [1:0] object);
    case (object)
      2'd0: ident_start = 8'd13;
      2'd1: ident_start = 8'd22;
      2'd2: ident_start = 8'd25;
      default: ident_start = 8'd0;
    endcase
  endfunction

  function automatic logic [7:0] ident_length(input logic [1:0] object);
    case (object)
      2'd0: ident_length = 8'd9;
      2'd1: ident_length = 8'd3;
      2'd2: ident_length = 8'd3;
      default: ident_length = 8'd0;
    endcase
  endfunction

  function automatic logic [7:0] ident_byte(input logic [7:0] place);
    case (place)
      8'd0: ident_byte = 8'h4D;
      8'd1: ident_byte = 8'h65;
      8'd2: ident_byte = 8'h6C;
      8'd3: ident_byte = 8'h74;
      8'd4: ident_byte = 8'h73;
      8'd5: ident_byte = 8'h74;
      8'd6: ident_byte = 8'h61;
      8'd7: ident_byte = 8'h67;
      8'd8: ident_byte = 8'h65;
      8'd9: ident_byte = 8'h20;
      8'd10: ident_byte = 8'h54;
      8'd11: ident_byte = 8'h43;
      8'd12: ident_byte = 8'h31;
      8'd13: ident_byte = 8'h4D;
      8'd14: ident_byte = 8'h65;
      8'd15: ident_byte = 8'h6C;
      8'd16: ident_byte = 8'h74;
      8'd17: ident_byte = 8'h73;
      8'd18: ident_byte = 8'h74;
      8'd19: ident_byte = 8'h61;
      8'd20: ident_byte = 8'h67;
      8'd21: ident_byte = 8'h65;
      8'd22: ident_byte = 8'h54;
      8'd23: ident_byte = 8'h43;
      8'd24: ident_byte = 8'h31;
      8'd25: ident_byte = 8'h30;
      8'd26: ident_byte = 8'h2E;
      8'd27: ident_byte = 8'h31;
      default: ident_byte = 8'h00;
    endcase
  endfunction

endpackage
