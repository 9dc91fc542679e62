// SPDX-License-Identifier: Apache-2.0
// QUALITY: how well the loop has done since the set-point last changed (or heating began): overshoot, settling time,
// largest error once at temperature, peak, and how long the heater was on. Everything stands still while heating is
// off, so that a finished job can be read out.
`include "tc_assert.svh"

module tc_quality #(
  // Clocks of 0.1 s; a parameter so that proofs can shorten it.
  parameter int unsigned TenthClocks = tc_pkg::ClkHz / 10
) (
  input  logic               clk_i,
  input  logic               rst_ni,

  input  logic               run_i,
  input  logic               sample_i,         // pulse: control computation with a new sample
  input  logic               tenth_i,          // pulse each 0.1 s
  input  logic signed [15:0] pv_i,             // Q9.6, as the next
  input  logic signed [15:0] target_i,
  input  logic [15:0]        window_i,         // AT_WINDOW, 0.1 degC
  input  logic               at_temp_i,
  input  logic               heater_i,

  output tc_types_pkg::quality_t quality_o,
  output logic [31:0]        on_time_o         // 0.1 s
);

  localparam logic [20:0] TenthLast = 21'(TenthClocks - 1);

  logic               run_q;                   // run_i one clock ago
  logic               up_q;                    // the set-point lay above the temperature when it changed
  logic               in_band_q;               // the last sample lay within AT_WINDOW
  logic               reached_q;               // has been at temperature since then
  logic signed [15:0] target_q;                // the set-point that these figures are of, Q9.6
  logic signed [15:0] peak_q;                  // highest temperature, Q9.6
  logic [15:0]        over_q, error_q;         // overshoot, largest error once at temperature; 1/64 degC
  logic [15:0]        since_q;                 // 0.1 s since the set-point changed; stops at its top
  logic [15:0]        band_q;                  // since_q when the band was entered for good, 65535 outside
  logic [20:0]        clocks_q;                // heater on, clocks of the present 0.1 s
  logic [31:0]        on_q;                    // heater on, 0.1 s

  logic               restart, in_window;
  logic signed [16:0] error, opposite, excess;
  logic [16:0]        size;
  logic [15:0]        size16;
  assign restart   = run_i && (!run_q || target_i != target_q);
  assign error     = 17'(pv_i) - 17'(target_i);
  assign opposite  = -error;
  assign excess    = up_q ? error : opposite;
  assign size      = error[16] ? opposite : error;
  assign size16    = size[16] ? 16'hFFFF : size[15:0];
  // 1/320 degC on both sides: 5 x 1/64 and 32 x 0.1.
  assign in_window = {window_i, 5'd0} >= {1'b0, {1'b0, size, 2'd0} + {3'd0, size}};

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      run_q     <= 1'b0;
      up_q      <= 1'b0;
      in_band_q <= 1'b0;
      reached_q <= 1'b0;
      target_q  <= 16'sd0;
      peak_q    <= 16'sd0;
      over_q    <= 16'd0;
      error_q   <= 16'd0;
      since_q   <= 16'd0;
      band_q    <= 16'hFFFF;
      clocks_q  <= 21'd0;
      on_q      <= 32'd0;
    end else begin
      run_q <= run_i;
      if (restart) begin
        target_q  <= target_i;
        up_q      <= error[16] || error == 17'sd0;
        in_band_q <= 1'b0;
        reached_q <= 1'b0;
        peak_q    <= pv_i;
        over_q    <= 16'd0;
        error_q   <= 16'd0;
        since_q   <= 16'd0;
        band_q    <= 16'hFFFF;
        clocks_q  <= 21'd0;
        on_q      <= 32'd0;
      end else if (run_i) begin
        if (tenth_i && since_q != 16'hFFFF) since_q <= since_q + 16'd1;
        if (at_temp_i) reached_q <= 1'b1;
        if (sample_i) begin
          if (peak_q < pv_i) peak_q <= pv_i;
          if ($signed({1'b0, over_q}) < excess) over_q <= excess[15:0];
          if (reached_q && error_q < size16) error_q <= size16;
          in_band_q <= in_window;
          if (!in_window) band_q <= 16'hFFFF;
          else if (!in_band_q) band_q <= since_q;
        end
        if (heater_i) begin
          clocks_q <= clocks_q == TenthLast ? 21'd0 : clocks_q + 21'd1;
          if (clocks_q == TenthLast) on_q <= on_q + 32'd1;
        end
      end
    end
  end

  always_comb begin
    quality_o.overshoot  = over_q;
    quality_o.band_error = error_q;
    quality_o.peak       = peak_q;
    quality_o.band_time  = band_q;
  end
  assign on_time_o = on_q;

`ifndef SYNTHESIS
  `TC_ASSERT_SETUP
  `TC_ASSERT(QualityOnClocksInRange_A, clocks_q <= TenthLast)
  `TC_ASSERT(QualityBandTimeMeansInBand_A, in_band_q || band_q == 16'hFFFF)
  `TC_ASSERT(QualityEntryIsPast_A, band_q == 16'hFFFF || band_q <= since_q)
  `TC_ASSERT_NEXT(QualityNewSetpointStartsAgain_A, restart, over_q == 16'd0 && error_q == 16'd0 && band_q == 16'hFFFF &&
                  on_q == 32'd0)
`endif

endmodule
