// SPDX-License-Identifier: Apache-2.0
// Safety properties P1-P18 of the chip that lie between its blocks, as assertions on the wires of tc_top; those of one
// block stand in that block. The names say which: P05_... is part of P5. docs/verify/properties.md lists all of them
// with their proofs. Alive in every simulation, absent in synthesis. Nothing here looks into a block, so a block may
// change inside.
//
// A bench may load the chip's flops at any time; it then clears past_ok_q and sets resumed_q, and what is remembered
// here starts anew at a value from which nothing is claimed that would need the past.
`include "tc_assert.svh"

`ifndef SYNTHESIS
module tc_properties (
  input logic               clk_i,
  input logic               rst_ni,
  // Pins.
  input logic               heater_pin_i,
  input logic               inhibit_pin_i,
  input logic               safe_en_i,
  // GUARD.
  input tc_pkg::params_t    params_i,
  input logic               tenth_i,
  input logic               sens_done_i,
  input logic               sens_ok_i,
  input logic signed [15:0] sens_pv_i,
  input logic               accept_i,
  input logic [16:0]        duty_i,
  input logic               run_cmd_i,
  input logic               cmd_stop_i,
  input logic               uart_stop_i,
  input logic               tune_stop_i,
  input logic               clear_i,
  input logic               good_frame_i,
  input logic               mem_bad_i,
  input logic               illegal_i,
  input logic               overrun_i,
  input logic               inhibit_i,
  input logic               pwm_i,
  input logic               heater_i,
  input logic               run_i,
  input logic               sensor_ok_i,
  input logic               pv_valid_i,
  input logic signed [15:0] pv_i,
  input logic [14:0]        cause_i,
  input logic [14:0]        fault_i,
  input logic [3:0]         first_fault_i,
  // Commands.
  input logic               cmd_valid_i,
  input logic               cmd_broadcast_i,
  input logic               rsp_busy_i,
  input logic               de_i,
  input logic               write_i,
  input logic               store_i,
  input logic [5:0]         index_i,
  input logic [15:0]        value_i,
  input logic               discard_i,
  input logic               discarding_i,
  input logic               tune_i,
  input logic               tune_wr_i,
  // The control tick.
  input logic [4:0]         state_i,
  input logic               tick_i,
  input logic               commit_i,
  input logic               sens_start_i,
  input logic               sens_busy_i,
  input logic [14:0]        reading_i,
  input logic               algor_start_i,
  input logic [4:0]         computing_i
);

  `TC_ASSERT_SETUP

  function automatic logic [15:0] count_up(input logic [15:0] x, input logic tick);
    count_up = tick && x != 16'hFFFF ? x + 16'd1 : x;
  endfunction
  // a in 1/64 degC is at or above b in 0.1 degC.
  function automatic logic reaches(input logic signed [16:0] a, input logic signed [16:0] b);
    reaches = 24'(a) * 24'sd5 >= 24'(b) * 24'sd32;
  endfunction

  // ---- What happens in this clock -----------------------------------------------------------------------------------

  logic too_hot, hot, sound_hot, rows_hot, state_bad, stale, host_lost, off_duty, zero_due, zero_rose, orders;
  logic [14:0] latching;
  assign too_hot   = reaches(17'(sens_pv_i), 17'($signed(params_i.t_max)));
  assign hot       = accept_i && too_hot;
  assign sound_hot = sens_done_i && sens_ok_i && too_hot;
  assign rows_hot  = sound_hot && {1'b0, hot_row} + 5'd1 >= {1'b0, params_i.bad_max[3:0]};
  assign latching  = cause_i & ~(run_i ? 15'd0 : tc_pkg::FaultRunOnly);
  assign state_bad = illegal_i || (run_i && state_i == tc_pkg::StIdle);
  assign orders    = run_cmd_i || cmd_stop_i || clear_i || discard_i || tune_i;

  // ---- What happened before -----------------------------------------------------------------------------------------

  logic        resumed_q;                         // set by a bench alone
  logic        ran, was_hot, run_1, write_1, staged, tuned;
  logic [3:0]  hot_row;                           // sound samples in a row that were too hot, accepted or not
  // one and two clocks ago
  logic [1:0]  well_past, hot_past, hot_row_past, stale_past, host_lost_past, broken_past, rose_past;
  logic [15:0] silent, alone, cold, value_1;     // 0.1 s since a sample, since a frame, without heat
  logic [5:0]  index_1;
  logic signed [15:0] base;                      // lowest temperature since the time without heat was over
  logic [14:0] fault_1, latching_1;
  logic [3:0]  first_1;
  logic [14:0] ticked;                           // clocks of the tick in work

  assign stale     = silent >= params_i.sample_timeout;
  assign host_lost = run_i && params_i.host_wd != 16'd0 && alone >= params_i.host_wd;
  assign off_duty  = duty_i == 17'd0 || !run_i;
  assign zero_due  = off_duty && cold >= params_i.zero_wait;
  assign zero_rose = zero_due && params_i.zero_rise != 16'd0 &&
                     reaches(17'(pv_i) - 17'(base), $signed({1'b0, params_i.zero_rise}));

  logic well, in_tick;
  assign well    = sensor_ok_i && !mem_bad_i && !was_hot;
  assign in_tick = state_i == tc_pkg::StReadTemp || state_i == tc_pkg::StTempDisplay || state_i == tc_pkg::StInitAlgor;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      resumed_q       <= 1'b0;
      ran            <= 1'b0;
      was_hot        <= 1'b0;
      run_1          <= 1'b0;
      write_1        <= 1'b0;
      index_1        <= 6'd0;
      value_1        <= 16'd0;
      staged         <= 1'b0;
      tuned          <= 1'b0;
      well_past      <= 2'b11;
      hot_row        <= 4'd0;
      hot_past       <= 2'b00;
      hot_row_past   <= 2'b00;
      stale_past     <= 2'b00;
      host_lost_past <= 2'b00;
      broken_past    <= 2'b00;
      rose_past      <= 2'b00;
      silent         <= 16'd0;
      alone          <= 16'd0;
      cold           <= 16'd0;
      base           <= 16'sd0;
      fault_1        <= 15'd0;
      latching_1     <= 15'd0;
      first_1        <= 4'd0;
      ticked         <= 15'd0;
    end else begin
      resumed_q       <= 1'b0;
      ran            <= (resumed_q ? run_i : ran) || run_cmd_i;
      was_hot        <= accept_i ? hot : was_hot && !resumed_q;
      run_1          <= run_i;
      write_1        <= write_i;
      index_1        <= index_i;
      value_1        <= value_i;
      staged         <= (write_i && index_i != tc_pkg::RegCmd) || tune_wr_i || (!commit_i && (staged || resumed_q));
      tuned          <= tune_i || tuned || resumed_q;
      well_past      <= {well_past[0] || resumed_q, well || resumed_q};
      hot_row        <= resumed_q || (sens_done_i && !sound_hot) ? 4'd0 : hot_row + 4'(sound_hot && hot_row != 4'hF);
      hot_past       <= {hot_past[0] && !resumed_q, hot};
      hot_row_past   <= {hot_row_past[0] && !resumed_q, rows_hot && !resumed_q};
      stale_past     <= {stale_past[0] && !resumed_q, stale && !resumed_q};
      host_lost_past <= {host_lost_past[0] && !resumed_q, host_lost && !resumed_q};
      broken_past    <= {broken_past[0] && !resumed_q, mem_bad_i || state_bad || overrun_i || inhibit_i};
      rose_past      <= {rose_past[0] && !resumed_q, zero_rose && !resumed_q};
      silent         <= accept_i || resumed_q ? 16'd0 : count_up(silent, tenth_i);
      alone          <= !run_i || good_frame_i || resumed_q ? 16'd0 : count_up(alone, tenth_i);
      cold           <= !off_duty || resumed_q ? 16'd0 : zero_due ? cold : count_up(cold, tenth_i);
      base           <= accept_i && !pv_valid_i ? sens_pv_i : resumed_q ? 16'sh7FFF : zero_due &&
          pv_i >= base ? base : pv_i;
      fault_1        <= fault_i;
      latching_1     <= latching;
      first_1        <= first_fault_i;
      ticked         <= !in_tick || resumed_q ? 15'd0 : ticked + 15'(ticked != 15'h7FFF);
    end
  end

  // ---- P1: reset
  // While reset is asserted the heater is off and the second switch is open.
  `TC_ASSERT_RESET(P01_ResetIsOff_A, !heater_pin_i && !safe_en_i)
  // After reset both stay so till the first Run command.
  `TC_ASSERT_IF(P01_OffTillRun_A, !ran, !heater_pin_i && !safe_en_i)

  // ---- P2: faults
  // A fault, or a cause that becomes one, has the heater off and heating forbidden in the next clock,
  `TC_ASSERT_NEXT(P02_FaultIsOff_A, fault_i != 15'd0 || latching != 15'd0, !heater_i && !run_i)
  // and each such cause is a fault then.
  `TC_ASSERT_NEXT(P02_CauseIsFault_A, latching != 15'd0, (latching_1 & ~fault_i) == 15'd0)
  // A broken parameter, an illegal state, a late tick and the inhibit pin are causes: off in two clocks.
  `TC_ASSERT_IF(P02_BrokenIsOff_A, broken_past[1], !heater_i && !run_i && fault_i != 15'd0)
  // The inhibit pin needs no clock at all.
  `TC_ASSERT_IF(P02_InhibitIsOff_A, inhibit_pin_i, !heater_pin_i)
  // No fault goes away without a clear.
  `TC_ASSERT_NEXT(P02_FaultStays_A, fault_i != 15'd0 && !clear_i, (fault_1 & ~fault_i) == 15'd0)
  // A clear is a written command word with its key.
  `TC_ASSERT_IF(P02_ClearIsKeyed_A, clear_i, write_1 && index_1 == tc_pkg::RegCmd && value_1 == tc_pkg::CmdClearFault)
  // Once off, only a Run command without any fault or cause heats again.
  `TC_ASSERT_NEXT(P02_RunNeedsCommand_A, !run_i && !(run_cmd_i && fault_i == 15'd0 && cause_i == 15'd0 &&
      pv_valid_i), !run_i)

  // ---- P3: permission
  // The heater is on only while RUN, without a fault, and if two clocks ago the sensor and the parameters were sound
  // and the last accepted sample was below T_MAX.
  `TC_ASSERT_IF(P03_HeatsOnlyWhenWell_A, heater_i, run_i && fault_i == 15'd0 && pv_valid_i && well_past[1])

  // ---- P4: no sample
  // No accepted sample for SAMPLE_TIMEOUT: off in two clocks,
  `TC_ASSERT_IF(P04_StaleIsOff_A, stale_past[1], !heater_i)
  // and a fault, if it was heating.
  `TC_ASSERT_IF(P04_StaleIsFault_A, stale_past[1] && run_1, fault_i[tc_pkg::FaultSensorStale])

  // ---- P5: too hot
  // An accepted sample at or above T_MAX: off and a fault in two clocks, unfiltered, running or not.
  `TC_ASSERT_IF(P05_HotIsOff_A, hot_past[1], !heater_i && !run_i && fault_i[tc_pkg::FaultOverTemp])
  // BAD_MAX sound frames in a row at or above T_MAX do so too, even if GUARD took each for a jump.
  `TC_ASSERT_IF(P05_HotRowIsOff_A, hot_row_past[1], !heater_i && !run_i && fault_i[tc_pkg::FaultOverTemp])

  // ---- P6: host
  // No good frame for HOST_WD while running: off in two clocks.
  `TC_ASSERT_IF(P06_HostLostIsOff_A, host_lost_past[1], !heater_i && !run_i)

  // ---- P7: duty (that the pulse keeps to the duty stands in tc_pwmc, that the duty keeps to DUTY_MAX in tc_algor)
  // The heater is on only in the clock after one of the pulse.
  `TC_ASSERT_NEXT(P07_HeaterIsPulse_A, !pwm_i, !heater_i)

  // ---- P9: STOP (that every STOP frame raises uart_stop stands in tc_uart_frame)
  // Off in the clock after STOP, whatever the state and the lock.
  `TC_ASSERT_NEXT(P09_StopIsOff_A, cmd_stop_i || uart_stop_i || tune_stop_i, !heater_i && !run_i && !safe_en_i)

  // ---- P10: only frames write (which frames: tc_uart_frame)
  // A command comes from an accepted frame.
  `TC_ASSERT_NEXT(P10_CommandNeedsFrame_A, !cmd_valid_i, !cmd_valid_i || good_frame_i)
  // Words are written, and commands carried out, only for a command in hand.
  `TC_ASSERT_IF(P10_WriteNeedsCommand_A, write_i, cmd_valid_i)
  // Run, Stop, ClearFault, Discard and Tune come from a written command word.
  `TC_ASSERT_IF(P10_OrderNeedsWrite_A, orders, write_1 && index_1 == tc_pkg::RegCmd)
  // Self-tuning writes its gains only once it has been ordered.
  `TC_ASSERT_IF(P10_TuneWritesWhenOrdered_A, tune_wr_i, tuned)
  // A set becomes active only if a word of it has been written.
  `TC_ASSERT_IF(P10_CommitNeedsWrite_A, commit_i, staged)

  // While a Discard takes the staged set back word by word nobody writes to it, and it does not become active.
  `TC_ASSERT_IF(TopDiscardIsWhole_A, discarding_i, !(write_i && store_i) && !tune_wr_i && !commit_i)

  // ---- P11: one parameter set a tick
  // A set becomes active in the first clock of a tick only, while neither the sensor is read nor the duty computed.
  `TC_ASSERT_IF(P11_CommitAtTick_A, commit_i, tick_i && !sens_busy_i && !algor_start_i && computing_i == 5'd0)

  // ---- P13: broadcasts (any other answer: tc_uartc)
  // A broadcast in hand leaves the line alone, in the clock after its end too.
  `TC_ASSERT_NEXT(P13_BroadcastIsSilent_A, cmd_valid_i && cmd_broadcast_i, !rsp_busy_i && !de_i)

  // ---- P15: liveness. The main state machine comes back to where it takes commands and ticks, whatever comes on UART 
  // command ends stands in tc_paramc).

  // A tick ends in CfgPwm within the longest read, 27138 clocks of SPI at its slowest with a set-up word before
  // (P15_ReadEnds_A in tc_sensc), the computation and 4 clocks.
  localparam logic [14:0] LongestRead = 15'd27138;
  `TC_ASSERT_IF(P15_TickEnds_A, ticked != 15'd0, ticked <= LongestRead + 15'd23)
`ifdef FORMAL
  // What leads there: the clocks of each state since the tick began.
  `TC_ASSERT_IF(P15_Displaying_A, state_i == tc_pkg::StTempDisplay, ticked <= LongestRead + 15'd2)
  `TC_ASSERT_IF(P15_Computing_A, state_i == tc_pkg::StInitAlgor,
                computing_i != 5'd0 ? ticked <= LongestRead + 15'd3 + {10'd0, computing_i}
                                  : algor_start_i && ticked <= LongestRead + 15'd3)
  `TC_ASSERT_IF(P15_Reading_A, state_i == tc_pkg::StReadTemp,
                reading_i != 15'd0 ? ticked == reading_i + 15'd1
                                 : tick_i != sens_start_i && ticked == {14'd0, sens_start_i})
  `TC_ASSERT_IF(P15_ReadsInReadTemp_A, reading_i != 15'd0 || sens_start_i || tick_i, state_i == tc_pkg::StReadTemp)
  `TC_ASSERT_IF(P15_ComputesInInitAlgor_A, computing_i != 5'd0 || algor_start_i, state_i == tc_pkg::StInitAlgor)
`endif

  // ---- P16: illegal state. Off in two clocks: P02_BrokenIsOff_A; that it falls to Idle in one clock stands in tc_sysc

  // ---- P17: first fault
  // The first fault since the clear is not overwritten,
  `TC_ASSERT_NEXT(P17_FirstFaultKept_A, fault_i != 15'd0 && !clear_i, first_fault_i == first_1)
  // and is one of those that came first.
  `TC_ASSERT_IF(P17_FirstFaultIsOne_A, fault_i != 15'd0 && fault_1 == 15'd0,
                first_fault_i != 4'd0 && ({fault_i, 1'b0} >> first_fault_i) % 2 == 16'd1)

  // ---- P18: shorted switch
  // Without heat for ZERO_WAIT and then risen by ZERO_RISE above the lowest since: in two clocks a fault, and the
  // second switch is opened
  `TC_ASSERT_IF(P18_RiseStopsToggling_A, rose_past[1], !safe_en_i && fault_i[tc_pkg::FaultZeroRise])
  // for as long as the fault stays.
  `TC_ASSERT_IF(P18_FaultStopsToggling_A, fault_i != 15'd0, !safe_en_i)

  logic unused;
  assign unused = ^{params_i, sens_start_i, reading_i, computing_i};   // some for proofs alone

endmodule
`endif
