// SPDX-License-Identifier: Apache-2.0
// ATUNE: self-tuning by a relay experiment on the running head (Astrom and Hagglund 1984).
//
// tune_i starts it. The relay drives the duty between duty_on_q and duty_off_q around the working set-point. After each
// of the first TuneAdaptCycles cycles the relay is centred on the mean duty of that cycle, which becomes the hold duty;
// the next cycles are measured as they are: ticks, ticks on, and the swing of the low-passed temperature. From their
// sums one serial multiplier-divider works out hold duty, ultimate gain, and the gains (rule and factors:
// spec/chip.toml, docs/chip/control.md), which go to MEM's staged set one by one and become active together at the next
// control tick.
//
// Ends: finished; run_i fell (STOP, a fault); or no switch of the relay for Limit, which asks GUARD for a stop.
`include "tc_assert.svh"

module tc_atune #(
  // Longest time between two switches of the relay, 0.1 s; a parameter so that proofs can shorten it.
  parameter logic [13:0] Limit = tc_pkg::TuneLimit
) (
  input  logic               clk_i,
  input  logic               rst_ni,

  input  logic               tune_i,           // pulse: start, in automatic mode while heating
  input  logic               run_i,
  input  logic               sample_i,         // pulse: control computation with a new sample
  input  logic               tenth_i,          // pulse each 0.1 s
  input  logic               commit_i,         // the staged set becomes active
  input  logic signed [15:0] pv_i,             // Q9.6, as the next three
  input  logic signed [15:0] sp_work_i,
  input  logic signed [15:0] amb_i,
  input  logic               ramping_i,
  input  logic [16:0]        duty_max_i,       // UQ1.16
  input  logic [15:0]        window_i,         // AT_WINDOW, 0.1 degC

  output logic               tuning_o,
  output logic [16:0]        duty_o,           // of the relay
  output logic [16:0]        hold_o,           // hold duty as known so far
  output logic               stop_o,           // pulse: ended by time, heater off
  output logic               parity_o,         // of what decides over the heater until the relay switches ...
  output logic               still_o,          // ... and whether the next clock leaves it as it is
  output logic               wr_o,             // a gain for MEM, until a clock without commit_i
  output logic [5:0]         wr_index_o,
  output logic [15:0]        wr_data_o,

  output tc_types_pkg::tuned_t tuned_o
);

  // A code beyond these can only be an upset's: GUARD sees that by parity_o, and its stop leads to Idle.
  typedef enum logic [2:0] {
    Idle     = 3'd0,
    Approach = 3'd1,   // to the set-point and past it
    Cycle    = 3'd2,
    Centre   = 3'd3,   // hold duty of the cycle just ended
    Results  = 3'd4,
    Commit   = 3'd5    // gains wait for the control tick
  } phase_e;

  // How the last experiment ended, as AT_STATE shows it.
  typedef enum logic [2:0] {
    EndNever    = 3'd0,
    EndRuns     = 3'd1,
    EndFinished = 3'd2,
    EndStopped  = 3'd3,
    EndTime     = 3'd4
  } end_e;

  // Results in their order; the last needs no arithmetic.
  typedef enum logic [2:0] {
    CalcHold       = 3'd0,
    CalcKu         = 3'd1,
    CalcKp         = 3'd2,
    CalcKiApproach = 3'd3,
    CalcKiHold     = 3'd4,
    CalcKd         = 3'd5,
    CalcKff        = 3'd6,
    CalcFilter     = 3'd7
  } calc_e;

  localparam logic [5:0] MdMultiply = 6'd18;   // steps of the multiplication, then of the division
  localparam logic [5:0] MdLast = 6'd54;

  phase_e             phase_q;
  end_e               end_q;
  logic [2:0]         cycles_q;                // cycles of the relay that have ended
  logic [2:0]         calc_q;                  // the result in work, a calc_e: counted up
  logic               on_q;                    // the relay is on
  logic               stop_q, wr_q;            // outputs of the same name
  logic [16:0]        duty_on_q, duty_off_q;   // levels of the relay, UQ1.16
  logic [16:0]        hold_q;                  // hold duty as known so far, UQ1.16
  logic signed [19:0] filt_q;                  // low-passed temperature, 1/1024 degC
  logic signed [15:0] max_q, min_q;            // of it in the running cycle, 1/64 degC
  logic [15:0]        ticks_q, on_ticks_q;     // of the running cycle
  logic [17:0]        sum_ticks_q, sum_on_q;   // of all measured cycles
  logic [17:0]        sum_swing_q;             // max_q - min_q of them
  logic [13:0]        limit_q;                 // 0.1 s since the relay switched
  logic [15:0]        ku_q, kp_q;              // results that others are made of or AT_KU shows
  logic [5:0]         wr_index_q;              // the gain on its way to MEM
  logic [15:0]        wr_data_q;
  logic [5:0]         md_q;                    // step of the multiplication and division
  logic [35:0]        acc_q;                   // factor and product, then product and quotient
  logic [17:0]        rem_q;                   // remainder

  // ---- Relay --------------------------------------------------------------------------------------------------------

  // It switches at half of AT_WINDOW, and at TuneHysteresis at least: a noisy sensor needs a wide window.
  localparam logic signed [20:0] LeastWidth = 21'sd5 * 21'(tc_pkg::TuneHysteresis);
  logic signed [16:0] above;                   // the set-point, 1/64 degC
  logic signed [20:0] above_fine, half_window, width;  // 1/320 degC
  logic               turns_off, turns_on, relay_on, searching;
  assign above       = 17'(pv_i) - 17'(sp_work_i);
  assign above_fine  = (21'(above) <<< 2) + 21'(above);
  assign half_window = $signed({1'b0, window_i, 4'd0});
  assign width       = half_window > LeastWidth ? half_window : LeastWidth;
  assign searching   = phase_q == Approach || phase_q == Cycle;
  assign turns_off   = on_q && above_fine >= width;
  assign turns_on    = !on_q && above_fine <= -width;
  assign relay_on    = turns_on || (on_q && !turns_off);

  logic signed [20:0] filt_gap;
  logic signed [19:0] filt_now;
  logic signed [15:0] filt_temp;
  assign filt_gap  = $signed({pv_i[15], pv_i, 4'd0}) - 21'(filt_q);
  assign filt_now  = filt_q + 20'(filt_gap >>> 3);
  assign filt_temp = filt_now[19:4];

  logic [15:0] swing;
  assign swing = $unsigned(max_q) - $unsigned(min_q);

  // ---- Multiply and divide: x k / y, saturated ----------------------------------------------------------------------

  logic [16:0]        delta;
  logic signed [16:0] rise;
  logic               warm;
  assign delta = duty_on_q - duty_off_q;
  assign rise  = 17'(sp_work_i) - 17'(amb_i);
  assign warm  = !rise[16] && rise != 17'sd0;               // a set-point at ambient holds without duty

  logic [17:0] x, k, y;
  always_comb begin
    x = {1'b0, delta};
    k = sum_on_q;
    y = sum_ticks_q;
    if (phase_q == Centre) begin
      k = {2'd0, on_ticks_q};
      y = {2'd0, ticks_q};
    end else begin
      unique case (calc_q)
        CalcKu:         begin k = tc_pkg::TuneKuFactor; y = sum_swing_q; end
        CalcKp:         begin k = tc_pkg::TuneKpFactor; y = sum_swing_q; end
        CalcKiApproach: begin x = {2'd0, kp_q}; k = tc_pkg::TuneKiApproachFactor; end
        CalcKiHold:     begin x = {2'd0, kp_q}; k = tc_pkg::TuneKiHoldFactor; end
        CalcKd:         begin x = {2'd0, kp_q}; k = sum_ticks_q; y = tc_pkg::TuneKdDivisor; end
        CalcKff:        begin x = {1'b0, hold_q}; k = warm ? 18'd4096 : 18'd0; y = warm ? {1'b0, rise} : 18'd1; end
        default: ;
      endcase
    end
  end

  logic [18:0] partial, rest, rest_less;
  logic        fits;
  assign partial   = {1'b0, acc_q[35:18]} + (acc_q[0] ? {1'b0, x} : 19'd0);
  assign rest      = {rem_q, acc_q[35]};
  assign fits      = rest >= {1'b0, y};
  assign rest_less = rest - {1'b0, y};

  logic [16:0] quotient17;
  logic [15:0] quotient16;
  assign quotient17 = acc_q[35:17] != 19'd0 ? 17'h1FFFF : acc_q[16:0];
  assign quotient16 = acc_q[35:16] != 20'd0 ? 16'hFFFF : acc_q[15:0];

  // Hold duty: mean duty of the relay. The relay is centred on it as far as 0 .. duty_max_i allow.
  logic [17:0] mean, twice, twice_less;
  logic        twice_over;                     // twice the hold duty is DUTY_MAX or more
  logic [16:0] hold_now;
  assign mean       = {1'b0, duty_off_q} + {1'b0, quotient17};
  assign hold_now   = mean > {1'b0, duty_max_i} ? duty_max_i : mean[16:0];
  assign twice      = {hold_now, 1'b0};
  assign twice_over = twice >= {1'b0, duty_max_i};
  assign twice_less = twice - {1'b0, duty_max_i};

  // Low-pass of the derivative, about TU / 50: 2^n control periods.
  function automatic logic [15:0] filter_of(input logic [17:0] quarters);
    filter_of = 16'd0;
    for (int unsigned i = 8; i < 18; i++) if (quarters[i]) filter_of = i < 13 ? 16'(i) - 16'd7 : 16'd6;
  endfunction

  logic [5:0] result_index;
  always_comb begin
    unique case (calc_q)
      CalcKp:         result_index = tc_pkg::RegKp;
      CalcKiApproach: result_index = tc_pkg::RegKiApproach;
      CalcKiHold:     result_index = tc_pkg::RegKiHold;
      CalcKd:         result_index = tc_pkg::RegKd;
      CalcKff:        result_index = tc_pkg::RegKff;
      default:        result_index = tc_pkg::RegDFilter;
    endcase
  end

  logic expired;
  assign expired = limit_q >= Limit;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      phase_q     <= Idle;
      end_q       <= EndNever;
      cycles_q    <= 3'd0;
      calc_q      <= CalcHold;
      on_q        <= 1'b0;
      stop_q      <= 1'b0;
      wr_q        <= 1'b0;
      duty_on_q   <= 17'd0;
      duty_off_q  <= 17'd0;
      hold_q      <= 17'd0;
      filt_q      <= 20'sd0;
      max_q       <= 16'sd0;
      min_q       <= 16'sd0;
      ticks_q     <= 16'd0;
      on_ticks_q  <= 16'd0;
      sum_ticks_q <= 18'd0;
      sum_on_q    <= 18'd0;
      sum_swing_q <= 18'd0;
      limit_q     <= 14'd0;
      ku_q        <= 16'd0;
      kp_q        <= 16'd0;
      wr_index_q  <= 6'd0;
      wr_data_q   <= 16'd0;
      md_q        <= 6'd0;
      acc_q       <= 36'd0;
      rem_q       <= 18'd0;
    end else begin
      stop_q <= 1'b0;
      wr_q   <= wr_q && commit_i;

      if (searching && tenth_i) limit_q <= limit_q + 14'd1;

      if (searching && sample_i) begin
        filt_q <= filt_now;
        on_q   <= relay_on;
        if (relay_on != on_q) limit_q <= 14'd0;
        if (max_q < filt_temp) max_q <= filt_temp;
        if (min_q > filt_temp) min_q <= filt_temp;
        ticks_q    <= ticks_q + 16'd1;
        on_ticks_q <= on_ticks_q + {15'd0, relay_on};
        if (turns_on) begin
          if (phase_q == Cycle) begin
            cycles_q <= cycles_q + 3'd1;
            phase_q  <= Centre;
            md_q     <= 6'd0;
          end else if (!ramping_i) begin
            phase_q <= Cycle;
          end
          if (phase_q == Approach) begin
            ticks_q    <= 16'd0;
            on_ticks_q <= 16'd0;
            max_q      <= filt_temp;
            min_q      <= filt_temp;
          end
        end
      end

      // One step of the multiplication or the division; none while a result is on its way.
      if (phase_q == Centre || (phase_q == Results && !wr_q)) begin
        md_q <= md_q + 6'd1;
        if (md_q == 6'd0) begin
          acc_q <= {18'd0, k};
          rem_q <= 18'd0;
        end else if (md_q <= MdMultiply) begin
          acc_q <= {partial, acc_q[17:1]};
        end else begin
          acc_q <= {acc_q[34:0], fits};
          rem_q <= fits ? rest_less[17:0] : rest[17:0];
        end
      end

      // A cycle has ended: centre the relay in the first ones, sum up the others.
      if (phase_q == Centre && md_q > MdLast) begin
        if (cycles_q <= tc_pkg::TuneAdaptCycles) begin
          hold_q     <= hold_now;
          duty_on_q  <= twice_over ? duty_max_i : twice[16:0];
          duty_off_q <= twice_over ? twice_less[16:0] : 17'd0;
        end else begin
          sum_ticks_q <= sum_ticks_q + {2'd0, ticks_q};
          sum_on_q    <= sum_on_q + {2'd0, on_ticks_q};
          sum_swing_q <= sum_swing_q + {2'd0, swing};
        end
        ticks_q    <= 16'd0;
        on_ticks_q <= 16'd0;
        max_q      <= filt_q[19:4];
        min_q      <= filt_q[19:4];
        phase_q    <= cycles_q == tc_pkg::TuneCycles ? Results : Cycle;
        calc_q     <= CalcHold;
        md_q       <= 6'd0;
      end

      if (phase_q == Results && !wr_q && (md_q > MdLast || calc_q == CalcFilter)) begin
        if (calc_q == CalcHold) hold_q <= hold_now;
        if (calc_q == CalcKu) ku_q <= quotient16;
        if (calc_q == CalcKp) kp_q <= quotient16;
        wr_q       <= calc_q != CalcHold && calc_q != CalcKu;
        wr_index_q <= result_index;
        wr_data_q  <= calc_q == CalcFilter ? filter_of(sum_ticks_q) : quotient16;
        md_q       <= 6'd0;
        calc_q     <= calc_q + 3'd1;
        if (calc_q == CalcFilter) phase_q <= Commit;
      end

      if (phase_q == Commit && commit_i && !wr_q) begin
        phase_q <= Idle;
        end_q   <= EndFinished;
      end

      if (searching && expired) begin
        phase_q <= Idle;
        end_q   <= EndTime;
        stop_q  <= 1'b1;
      end
      if (!run_i && phase_q != Idle) begin
        phase_q <= Idle;
        end_q   <= EndStopped;
        wr_q    <= 1'b0;
      end

      if (tune_i && run_i && phase_q == Idle) begin
        phase_q     <= Approach;
        end_q       <= EndRuns;
        cycles_q    <= 3'd0;
        on_q        <= 1'b1;
        duty_on_q   <= duty_max_i;
        duty_off_q  <= 17'd0;
        hold_q      <= 17'd0;
        filt_q      <= {pv_i, 4'd0};
        sum_ticks_q <= 18'd0;
        sum_on_q    <= 18'd0;
        sum_swing_q <= 18'd0;
        limit_q     <= 14'd0;
      end
    end
  end

  assign parity_o   = ^{phase_q, on_q, duty_on_q, duty_off_q, hold_q};
  assign still_o    = run_i && !tune_i && !sample_i && !commit_i && !(searching && expired) &&
                      !((phase_q == Centre || phase_q == Results) && (md_q > MdLast || calc_q == CalcFilter));
  assign tuning_o   = phase_q != Idle;
  assign duty_o     = phase_q == Results || phase_q == Commit ? hold_q : on_q ? duty_on_q : duty_off_q;
  assign hold_o     = hold_q;
  assign stop_o     = stop_q;
  assign wr_o       = wr_q;
  assign wr_index_o = wr_index_q;
  assign wr_data_o  = wr_data_q;
  always_comb begin
    tuned_o.state = {5'd0, cycles_q, 5'd0, end_q};
    tuned_o.ku    = ku_q;
    tuned_o.tu    = sum_ticks_q[17:16] != 2'd0 ? 16'hFFFF : sum_ticks_q[15:0];
  end

  logic unused;
  assign unused = ^{rest_less[18], twice_less[17]};

`ifndef SYNTHESIS
  `TC_ASSERT_SETUP
  // It cannot ask for more than full duty, and without run it asks for nothing.
  `TC_ASSERT_NEXT(AtuneStoppedEnds_A, !run_i, phase_q == Idle && !wr_q)
  // The relay's two levels in their order; the step count of the arithmetic never runs over.
  `TC_ASSERT(AtuneLevels_A, duty_off_q <= duty_on_q)
  `TC_ASSERT(AtuneArithmeticEnds_A, md_q <= MdLast + 6'd1)
  `TC_ASSERT(AtunePhaseLegal_A, phase_q <= Commit)
  `TC_ASSERT(AtuneWritesOnlyTuning_A, !wr_q || phase_q == Results || phase_q == Commit)
  // What it writes are gains, inside the registers' ranges.
  `TC_ASSERT_IF(AtuneWritesGains_A, wr_q, wr_index_q == tc_pkg::RegKp || wr_index_q == tc_pkg::RegKiApproach ||
                wr_index_q == tc_pkg::RegKiHold || wr_index_q == tc_pkg::RegKd || wr_index_q == tc_pkg::RegKff ||
                (wr_index_q == tc_pkg::RegDFilter && wr_data_q <= 16'd6))
  `TC_ASSERT_IF(AtuneTimeStops_A, stop_q, phase_q == Idle)
`endif

endmodule
