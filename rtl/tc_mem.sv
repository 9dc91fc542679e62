// SPDX-License-Identifier: Apache-2.0
// MEM, the parameter memory: a staged and an active set of the holding registers, each word with SECDED check bits.
//
// Contract
// - Words 1 .. HoldingCount-1 are stored; index 0 (CMD) and indices beyond the map read 0 and swallow writes.
// - A word has the bits that differ within its register's range (tc_pkg::reg_stored), the others stand at their one value; what is
//   written lies in that range.
// - wr_i changes one staged word, commit_i copies the staged set to the active set in one clock, discard_i the active set to
//   the staged set (no effect together with commit_i; a write in the same clock wins for its word).
// - scrub_start_i walks all words, one index a clock, both sets side by side: a single flip is corrected, a flip that can
//   not be corrected raises bad_o at once; bad_o falls at the end of a pass that found none. A start while busy is ignored.
//   The pass stands still in a clock of wr_i, commit_i or discard_i, so that no correction meets a change of its word.
// - scan_en_i selects every word for writing and for reading at once, so that the supply current at rest shows defects in all of them: low in
//   operation, and no flop takes what it brings, since the chains shift.
// - rd_data_o, params_o and t_max_staged_o show the stored data bits, uncorrected until the scrub has passed.

module tc_mem (
  input  logic             clk_i,
  input  logic             rst_ni,
  input  logic             scan_en_i,
  input  logic             wr_i,
  input  logic [5:0]       wr_index_i,
  input  logic [15:0]      wr_data_i,
  input  logic             commit_i,
  input  logic             discard_i,
  input  logic [5:0]       rd_index_i,      // memory-style read port of the staged set
  output logic [15:0]      rd_data_o,
  output tc_pkg::params_t  params_o,
  output logic [15:0]      t_max_staged_o,
`ifdef TC_MEM_UPSET                            // the proof of the scrubbing flips bits of one word and looks at it
  input  logic [5:0]       upset_index_i,
  input  logic [21:0]      upset_staged_i,
  input  logic [21:0]      upset_active_i,
  output logic [21:0]      upset_staged_o,
  output logic [21:0]      upset_active_o,
  output logic [5:0]       upset_scrub_index_o,
`endif
  input  logic             scrub_start_i,
  output logic             scrub_busy_o,
  output logic             bad_o,
  output logic [15:0]      corrected_o
);

  localparam int unsigned LastWord = tc_pkg::HoldingCount - 1;
  localparam logic [5:0] LastIndex = 6'(LastWord);

  (* mem2reg *) logic [21:0] staged_q [1:LastWord];
  (* mem2reg *) logic [21:0] active_q [1:LastWord];
  logic        scrub_busy_q;
  logic [5:0]  scrub_index_q;
  logic        scrub_bad_q;     // the running pass has found a flip that can not be corrected
  logic        bad_q;
  logic [15:0] corrected_q;

  logic [21:0] scrub_staged, scrub_active;           // the words under the pass
  logic [21:0] flip_staged, flip_active;             // their wrong bit
  logic        one_staged, one_active, bad_now;
  logic        scrub_step;

  // Each word behind its own select, all in one OR: flatter than a choice of one after the other.
  logic [LastWord:1] under_pass;
  always_comb begin
    scrub_staged = 22'd0;
    scrub_active = 22'd0;
    for (int unsigned i = 1; i <= LastWord; i++) begin
      under_pass[i] = scrub_index_q == 6'(i) || scan_en_i;
      scrub_staged |= {22{under_pass[i]}} & staged_q[i];
      scrub_active |= {22{under_pass[i]}} & active_q[i];
    end
  end

  assign scrub_step = scrub_busy_q && !wr_i && !commit_i && !discard_i;
  assign flip_staged = tc_math_pkg::secded_flip(scrub_staged);
  assign flip_active = tc_math_pkg::secded_flip(scrub_active);
  assign one_staged = flip_staged != 22'd0;
  assign one_active = flip_active != 22'd0;
  assign bad_now = tc_math_pkg::secded_bad(scrub_staged) || tc_math_pkg::secded_bad(scrub_active);

  // What the one word that is written or under the pass takes: all words share it, each with an enable of its own.
  logic [21:0] staged_in, active_in;
  assign staged_in = wr_i ? tc_math_pkg::secded_encode(wr_data_i) : scrub_staged ^ flip_staged;
  assign active_in = scrub_active ^ flip_active;

  // Low: no word changes. An enable that all words share: a simulator passes them by with one test.
  logic stir;
`ifdef TC_MEM_UPSET
  assign stir = 1'b1;
`else
  assign stir = wr_i || commit_i || discard_i || scrub_busy_q || scan_en_i;
`endif

  for (genvar i = 1; i <= LastWord; i++) begin : gen_word
    localparam logic [21:0] ResetWord = tc_math_pkg::secded_encode(tc_pkg::reg_reset(6'(i)));
    localparam logic [21:0] Stored = tc_pkg::reg_stored(6'(i));
    localparam logic [21:0] Steady = ResetWord & ~Stored;
    logic hit;                                       // the pass stands on this word
    assign hit = (scrub_step || scan_en_i) && under_pass[i];

    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) staged_q[i] <= ResetWord;
      else if (stir) begin
        if (hit || (wr_i && wr_index_i == 6'(i))) staged_q[i] <= (staged_in & Stored) | Steady;
        else if (discard_i && !commit_i) staged_q[i] <= (active_q[i] & Stored) | Steady;
`ifdef TC_MEM_UPSET
        else if (upset_index_i == 6'(i)) staged_q[i] <= ((staged_q[i] ^ upset_staged_i) & Stored) | Steady;
`endif
      end
    end

    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) active_q[i] <= ResetWord;
      else if (stir) begin
        if (commit_i) active_q[i] <= (staged_q[i] & Stored) | Steady;
        else if (hit) active_q[i] <= (active_in & Stored) | Steady;
`ifdef TC_MEM_UPSET
        else if (upset_index_i == 6'(i)) active_q[i] <= ((active_q[i] ^ upset_active_i) & Stored) | Steady;
`endif
      end
    end
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      scrub_busy_q <= 1'b0;
      scrub_index_q <= 6'd0;
      scrub_bad_q <= 1'b0;
      bad_q <= 1'b0;
      corrected_q <= 16'd0;
    end else if (!scrub_busy_q) begin
      if (scrub_start_i) begin
        scrub_busy_q <= 1'b1;
        scrub_index_q <= 6'd1;
        scrub_bad_q <= 1'b0;
      end
    end else if (scrub_step) begin
      corrected_q <= corrected_q + 16'(one_staged) + 16'(one_active);
      scrub_bad_q <= scrub_bad_q || bad_now;
      if (bad_now) bad_q <= 1'b1;
      if (scrub_index_q >= LastIndex) begin
        scrub_busy_q <= 1'b0;
        scrub_index_q <= 6'd0;
        bad_q <= scrub_bad_q || bad_now;
      end else begin
        scrub_index_q <= scrub_index_q + 6'd1;
      end
    end
  end

  always_comb begin
    rd_data_o = 16'd0;
    for (int unsigned i = 1; i <= LastWord; i++) begin
      rd_data_o |= {16{rd_index_i == 6'(i) || scan_en_i}} & staged_q[i][15:0];
    end
  end

  logic [16*tc_pkg::HoldingCount-1:0] params_bits;
  always_comb begin
    params_bits = '0;
    for (int unsigned i = 1; i <= LastWord; i++) begin
      params_bits[16*i+:16] = active_q[i][15:0];
      // A flip of these would outlast the pass that corrects it: in the control period, or in a PWM period begun with it.
      if (6'(i) == tc_pkg::RegTs || 6'(i) == tc_pkg::RegPwmPrescale || 6'(i) == tc_pkg::RegPwmPeriod)
        params_bits[16*i+:16] = 16'(active_q[i] ^ tc_math_pkg::secded_flip(active_q[i]));
    end
  end
  assign params_o = params_bits;

`ifdef TC_MEM_UPSET
  always_comb begin
    upset_staged_o = 22'd0;
    upset_active_o = 22'd0;
    for (int unsigned i = 1; i <= LastWord; i++) begin
      if (upset_index_i == 6'(i)) begin
        upset_staged_o = staged_q[i];
        upset_active_o = active_q[i];
      end
    end
  end
  assign upset_scrub_index_o = scrub_index_q;
`endif

  assign t_max_staged_o = staged_q[tc_pkg::RegTMax][15:0];
  assign scrub_busy_o = scrub_busy_q;
  assign bad_o = bad_q;
  assign corrected_o = corrected_q;

endmodule
