// SPDX-License-Identifier: Apache-2.0
// Proof of tc_quality with free inputs: what starts, moves and stops its figures.
`include "tc_assert.svh"
// engine: induction

module formal_quality (
  input logic               clk_i,
  input logic               reset_i,
  input logic               run_i,
  input logic               sample_i,
  input logic               tenth_i,
  input logic signed [15:0] pv_i,
  input logic signed [15:0] target_i,
  input logic [15:0]        window_i,
  input logic               at_temp_i,
  input logic               heater_i
);

  logic started_q = 1'b0;
  always_ff @(posedge clk_i) started_q <= 1'b1;
  logic rst_ni;
  assign rst_ni = started_q && !reset_i;

  tc_types_pkg::quality_t quality;
  logic [15:0] overshoot, band_error, peak, band_time;
  logic [31:0] on_time;
  assign overshoot  = quality.overshoot;
  assign band_error = quality.band_error;
  assign peak       = quality.peak;
  assign band_time  = quality.band_time;

  tc_quality #(.TenthClocks(3)) u_quality (
    .clk_i, .rst_ni, .run_i, .sample_i, .tenth_i, .pv_i, .target_i, .window_i, .at_temp_i, .heater_i, .quality_o(quality), .on_time_o(on_time)
  );

  `TC_ASSERT_SETUP

  // The run of one set-point, written down once more.
  logic               run_q, sample_q, same_q, restart;
  logic [15:0]        over_q, error_q, band_q;
  logic [31:0]        on_q;
  logic signed [15:0] pv_q, target_q, peak_q;
  assign restart = run_i && (!run_q || target_i != target_q);
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      run_q    <= 1'b0;
      sample_q <= 1'b0;
      same_q   <= 1'b0;
      over_q   <= 16'd0;
      error_q  <= 16'd0;
      band_q   <= 16'hFFFF;
      on_q     <= 32'd0;
      pv_q     <= 16'sd0;
      target_q <= 16'sd0;
      peak_q   <= 16'sd0;
    end else begin
      run_q    <= run_i;
      sample_q <= sample_i && run_i && !restart;
      same_q   <= run_i && !restart;
      over_q   <= overshoot;
      error_q  <= band_error;
      band_q   <= band_time;
      on_q     <= on_time;
      pv_q     <= pv_i;
      peak_q   <= peak;
      if (restart) target_q <= target_i;
    end
  end

  // A sample is never above the peak.
  `TC_ASSERT_IF(FormalQualityPeak_A, sample_q, pv_q <= $signed(peak))
  // Figures of one set-point only grow; without heating nothing moves.
  `TC_ASSERT_IF(FormalQualityGrows_A, same_q, overshoot >= over_q && band_error >= error_q && $signed(peak) >= peak_q &&
                (on_time == on_q || on_time == on_q + 32'd1))
  `TC_ASSERT_NEXT(FormalQualityStands_A, !run_i, overshoot == over_q && band_error == error_q && $signed(peak) == peak_q &&
                  on_time == on_q && band_time == band_q)
  `TC_COVER(FormalQualityCounts_C, on_time == 32'd2)
  `TC_COVER(FormalQualityErrs_C, band_error != 16'd0)

endmodule
