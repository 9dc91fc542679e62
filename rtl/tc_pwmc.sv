// SPDX-License-Identifier: Apache-2.0
// PWMC, pulse-width modulation of the heater: period, prescaler, duty with sigma-delta fraction, shortest pulse.
//
// Contract
// - A period has period_i counts of prescale_i + 1 clocks. Duty, period and prescaler in force change only where a
//   period starts, all three together; a period whose product duty x period is not ready yet (17 clocks) repeats the
//   old set.
// - Within a period pwm_o is high for its first `high` counts: at most one pulse, none when high = 0, no gap when
//   high = period. Pulses and gaps shorter than min_on_i counts (at most half a period) do not occur.
// - dither_i carries what rounding and min_on_i took away to the next period, so that the mean over periods is exact.
//   Duty 0 is strictly low. A new period length starts with nothing carried.
// - enable_i low: pwm_o is low at the next clock and the duty is forgotten. enable_i high: a period starts at once, or
//   as soon as the product is ready, with the duty loaded since.

`include "tc_assert.svh"

module tc_pwmc (
  input  logic        clk_i,
  input  logic        rst_ni,
  input  logic [15:0] prescale_i,       // clocks a count, less one
  input  logic [15:0] period_i,         // counts a period; 0 and 1 count as 2
  input  logic [15:0] min_on_i,         // counts
  input  logic        dither_i,
  input  logic        enable_i,
  input  logic [16:0] duty_i,           // UQ1.16; above 65536 counts as 65536
  input  logic        load_i,
  output logic        pwm_o,
  output logic        parity_o,         // of what lasts for a PWM period or a control tick ...
  output logic        still_o,          // ... and whether the next clock leaves it as it is
  output logic        period_start_o    // first clock of a period
);

  localparam logic [4:0] MulSteps = 5'd17;     // bits of the duty

  logic [16:0] duty_q;            // duty for the next period
  logic [4:0]  mul_left_q;        // steps of duty_q x mul_period_q still to do
  logic [31:0] mul_acc_q;         // their product when mul_left_q is 0, 16 fraction bits
  logic [15:0] mul_period_q;      // period_legal that the product is made with
  logic        running_q;         // periods follow each other
  logic [15:0] prescale_q, period_q;   // in force
  logic [31:0] product_q;         // duty x period in force, 16 fraction bits
  logic [15:0] high_q;            // high counts of this period
  logic [15:0] pre_q, count_q;    // clock in the count, count in the period
  logic signed [31:0] acc_q;      // carried to the next period, counts with 16 fraction bits
  logic        pwm_q, period_start_q;  // outputs of the same name

  // ---- Product: one duty bit a clock, least significant first; add above, shift down; the last bit has the weight 1 -

  logic        period_short;
  logic [15:0] period_legal;      // 2 at least
  logic        mul_stale, mul_fresh;
  logic        drop;              // a stopped output forgets its duty: it starts again with what is loaded then
  logic [31:0] duty_bits;
  logic        mul_bit;
  logic [16:0] mul_sum;

  assign period_short = period_i[15:1] == 15'd0;
  assign period_legal = {period_i[15:2], period_i[1] || period_short, period_i[0] && !period_short};
  assign drop = !enable_i && duty_q != 17'd0;
  assign mul_stale = load_i || drop || (period_legal != mul_period_q);
  assign mul_fresh = (mul_left_q == 5'd0) && (period_legal == mul_period_q);
  assign duty_bits = {15'd0, duty_q};
  assign mul_bit = duty_bits[MulSteps-mul_left_q];
  assign mul_sum = {1'b0, mul_acc_q[31:16]} + (mul_bit ? {1'b0, mul_period_q} : 17'd0);

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      duty_q <= 17'd0;
      mul_left_q <= 5'd0;
      mul_acc_q <= 32'd0;
      mul_period_q <= tc_pkg::reg_reset(tc_pkg::RegPwmPeriod);
    end else if (mul_stale) begin
      if (load_i) duty_q <= duty_i[16] ? 17'h10000 : duty_i;
      else if (drop) duty_q <= 17'd0;
      mul_left_q <= MulSteps;
      mul_acc_q <= 32'd0;
      mul_period_q <= period_legal;
    end else if (mul_left_q != 5'd0) begin
      mul_left_q <= mul_left_q - 5'd1;
      mul_acc_q <= (mul_left_q == 5'd1) ? {mul_sum[15:0], mul_acc_q[15:0]} : {mul_sum, mul_acc_q[15:1]};
    end
  end

  // ---- Where the next period would start: its length, its high counts, what it carries on ---------------------------

  logic        count_end, period_end, start;
  logic [16:0] count_next;
  logic [15:0] period_next, min_on, high_next;
  logic [31:0] product_next;
  logic signed [31:0] acc_used;
  logic signed [33:0] sum;
  logic signed [31:0] rest;
  logic signed [17:0] whole;

  assign count_end = pre_q >= prescale_q;
  assign count_next = {1'b0, count_q} + 17'd1;
  assign period_end = count_end && count_next >= {1'b0, period_q};
  assign start = enable_i && (running_q ? period_end : mul_fresh && !load_i);

  assign period_next = mul_fresh ? mul_period_q : period_q;
  assign product_next = mul_fresh ? mul_acc_q : product_q;
  assign min_on = {1'b0, period_next[15:1]} < min_on_i ? {1'b0, period_next[15:1]} : min_on_i;
  assign acc_used = (!mul_fresh || mul_period_q == period_q) ? acc_q : 32'sd0;
  assign sum = 34'(acc_used) + $signed({2'b00, product_next});
  assign whole = sum[33:16];

  logic        too_short, too_long;
  logic [15:0] longest;           // below the whole period
  logic signed [17:0] beyond;     // counts beyond the period
  assign longest   = period_next - min_on;
  assign too_short = whole < $signed({2'b00, min_on});
  assign too_long  = whole > $signed({2'b00, longest});
  assign beyond    = whole - $signed({2'b00, period_next});
  always_comb begin
    if (product_next == 32'd0 || too_short) high_next = 16'd0;
    else if (too_long) high_next = dither_i || !beyond[17] ? period_next : longest;   // never above the duty
    else high_next = whole[15:0];
  end
  // What dithering carries on: sum less high_next, below half a period, see the proof.
  always_comb begin
    if (product_next == 32'd0) rest = 32'sd0;
    else if (too_short) rest = sum[31:0];
    else if (too_long) rest = {beyond[15:0], sum[15:0]};
    else rest = {16'd0, sum[15:0]};
  end

  // ---- The period ---------------------------------------------------------------------------------------------------

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      running_q <= 1'b0;
      prescale_q <= tc_pkg::reg_reset(tc_pkg::RegPwmPrescale);
      period_q <= tc_pkg::reg_reset(tc_pkg::RegPwmPeriod);
      product_q <= 32'd0;
      high_q <= 16'd0;
      pre_q <= 16'd0;
      count_q <= 16'd0;
      acc_q <= 32'sd0;
      pwm_q <= 1'b0;
      period_start_q <= 1'b0;
    end else begin
      period_start_q <= start;
      if (!enable_i) begin
        running_q <= 1'b0;
        high_q <= 16'd0;
        pre_q <= 16'd0;
        count_q <= 16'd0;
        acc_q <= 32'sd0;
        pwm_q <= 1'b0;
      end else if (start) begin
        running_q <= 1'b1;
        if (mul_fresh) prescale_q <= prescale_i;
        period_q <= period_next;
        product_q <= product_next;
        high_q <= high_next;
        pre_q <= 16'd0;
        count_q <= 16'd0;
        acc_q <= dither_i ? rest : 32'sd0;
        pwm_q <= high_next != 16'd0;
      end else if (running_q) begin
        if (count_end) begin
          pre_q <= 16'd0;
          count_q <= count_next[15:0];
          pwm_q <= pwm_q && count_next[15:0] < high_q;   // never a second pulse
        end else begin
          pre_q <= pre_q + 16'd1;
        end
      end
    end
  end

  assign parity_o = ^{duty_q, mul_acc_q, mul_period_q, prescale_q, period_q, product_q, high_q, acc_q};
  assign still_o  = enable_i && running_q && !period_end && !load_i && mul_fresh;
  assign pwm_o = pwm_q;
  assign period_start_o = period_start_q;

  `TC_ASSERT_SETUP
  `TC_ASSERT_NEXT(PwmcDisabledIsLow_A, !enable_i, !pwm_q && !period_start_q)
  `TC_ASSERT_NEXT(PwmcRisesOnlyAtStart_A, !pwm_q, !pwm_q || period_start_q)

`ifndef SYNTHESIS
  // P7, P8: what the running period was made from.
  logic signed [31:0] owed;         // what earlier periods had left over
  logic [15:0] min_on_used;
  logic        dithered;
  logic [32:0] product_ref, addend; // duty x period in the long-hand way, and what its next bit adds
  logic        resumed_q;            // set by a bench that loads flops
  logic        known;               // the running period and the product in work began after that
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      owed        <= 32'sd0;
      min_on_used <= 16'd0;
      dithered    <= 1'b0;
      product_ref <= 33'd0;
      addend      <= 33'd0;
      resumed_q    <= 1'b0;
      known       <= 1'b1;
    end else begin
      resumed_q <= 1'b0;
      if (resumed_q) known <= 1'b0;
      else if (!enable_i && mul_stale) known <= 1'b1;
      if (!enable_i) begin
        owed        <= 32'sd0;
        min_on_used <= 16'd0;
      end else if (start) begin
        owed        <= acc_used;
        min_on_used <= min_on;
        dithered    <= dither_i;
      end
      if (mul_stale) begin
        product_ref <= 33'd0;
        addend      <= {17'd0, period_legal};
      end else if (mul_left_q != 5'd0) begin
        if (mul_bit) product_ref <= product_ref + addend;
        addend <= addend << 1;
      end
    end
  end
  // counts with 16 fraction bits: duty x period and what was owed; what the period gives
  logic signed [33:0] due, given;
  assign due   = 34'(owed) + $signed({2'b00, product_q});
  assign given = $signed({2'b00, high_q, 16'd0});
  // P7: the output is high in a period's first high_q counts and no others.
  `TC_ASSERT(P07_PulseIsHigh_A, pwm_q == (running_q && count_q < high_q))
  // P7: those are never more than duty x period and what earlier periods had left over, which is below half a period;
  // only with DITHER a gap shorter than PWM_MIN_ON is filled, and that is taken off the next periods.
  `TC_ASSERT_IF(P07_WithinDuty_A, known && running_q && high_q != 16'd0,
                given <= due || (dithered && given - due < $signed({2'b00, min_on_used, 16'd0})))
  `TC_ASSERT(P07_CarryIsBounded_A, acc_q < $signed({1'b0, period_q[15:1], 16'd0}) &&
                                   acc_q > -$signed({1'b0, period_q[15:1], 16'd0}))
  // P7: what is left over is the exact difference, or nothing.
  `TC_ASSERT_IF(P07_CarryIsExact_A, known && running_q && acc_q != 32'sd0, 34'(acc_q) == due - given && dithered)
  // P7: the product in force comes from the long-hand one; no duty above 1 enters it.
  `TC_ASSERT_IF(P07_ProductIsExact_A, known && mul_left_q == 5'd0,
                mul_acc_q == product_ref[31:0] && duty_q <= 17'h10000)
  // P8: the output is low before a period ends, unless duty x period with what was owed fills the period (100 %) or,
  // with DITHER, leaves a gap shorter than PWM_MIN_ON. So otherwise it is never high for as long as a period.
  `TC_ASSERT_IF(P08_LowBeforeEnd_A, known && running_q && count_q + 16'd1 == period_q && pwm_q,
                high_q == period_q &&
                (due >= given || (dithered && given - due < $signed({2'b00, min_on_used, 16'd0}))))
`ifdef FORMAL
  // While the product is in work it stands as many bits higher as are still to do.
  `TC_ASSERT_IF(P07_ProductInWork_A, mul_left_q != 5'd0,
                {17'd0, mul_acc_q} == {16'd0, product_ref} << (mul_left_q - 5'd1) &&
                addend == {17'd0, mul_period_q} << (5'd17 - mul_left_q) && product_ref < addend)
`endif
`endif
  logic unused;
  assign unused = beyond[16];

  `TC_COVER(PwmcSuppressed_C, running_q && high_q == 16'd0 && product_q != 32'd0)

`ifdef FORMAL
  // What holds in every clock; each part needs the others, so they are one assertion.
  logic [15:0] min_on_used_q;       // shortest pulse of the running period
  logic        loaded_q;            // a duty above 0 has been loaded since the output was last disabled
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      min_on_used_q <= 16'd0;
      loaded_q <= 1'b0;
    end else begin
      if (!enable_i) min_on_used_q <= 16'd0;
      else if (start) min_on_used_q <= min_on;
      loaded_q <= (loaded_q && enable_i) || (load_i && duty_i != 17'd0);
    end
  end

  logic signed [31:0] half_period;
  logic pulse_sound, legal, carry_bounded, product_sound;
  assign half_period = $signed({1'b0, period_q[15:1], 16'd0});

  // The pulse is the first high_q counts; pulse and gap are both long enough; zero duty gives none; nothing runs unless
  // enabled.
  assign pulse_sound = pwm_q == (running_q && count_q < high_q) && high_q <= period_q &&
      (high_q == 16'd0 || high_q == period_q || (high_q >= min_on_used_q && period_q - high_q >= min_on_used_q)) &&
      (product_q != 32'd0 || high_q == 16'd0) &&
      (running_q ? count_q < period_q && pre_q <= prescale_q
                 : pre_q == 16'd0 && count_q == 16'd0 && high_q == 16'd0 && acc_q == 32'sd0);
  assign legal = period_q >= 16'd2 && mul_period_q >= 16'd2 && duty_q <= 17'h10000 && mul_left_q <= MulSteps;
  // Less than half a period is carried, so the mean is off by less than that at any time.
  assign carry_bounded = acc_q < half_period && acc_q > -half_period;
  // A product never exceeds the period, is zero with a zero duty, and none runs that was loaded before the output was
  // disabled.
  assign product_sound = product_q <= {period_q, 16'd0} && (duty_q != 17'd0 || mul_acc_q == 32'd0) &&
      (duty_q[16] ? mul_acc_q == (mul_left_q != 5'd0 ? 32'd0 : {mul_period_q, 16'd0})
                  : mul_acc_q[31:16] < mul_period_q) &&
      (loaded_q || (duty_q == 17'd0 && (!running_q || product_q == 32'd0)));

  always_comb begin
    PwmcInvariant_A: assert (pulse_sound && legal && carry_bounded && product_sound);
  end
`endif

endmodule
