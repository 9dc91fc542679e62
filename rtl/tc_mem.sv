// SPDX-License-Identifier: Apache-2.0
// MEM, the parameter memory: a staged and an active set of the holding registers, each word with SECDED check bits.
//
// Contract
// - Words 1 .. HoldingCount-1 are stored; index 0 (CMD) and indices beyond the map read 0 and swallow writes.
// - A word has the bits that differ within its register's range (tc_pkg::reg_stored), the others stand at their one value; what is
//   written lies in that range.
// - wr_i changes one staged word, commit_i copies the staged set to the active set in one clock.
// - scrub_start_i walks all words, the staged and then the active one of each index, a clock each: a single flip is corrected, a
//   flip that can not be corrected raises bad_o at once; bad_o falls at the end of a pass that found none. A start while busy is
//   ignored. The pass stands still in a clock of wr_i, commit_i or rd_i, so that no correction meets a change of its word.
// - discard_i begins a pass anew, in which each staged word takes the active one, corrected: until discarding_o falls there is no wr_i, and
//   after the clock of discard_i no commit_i (tc_top asserts it).
// - rd_data_o is the staged word at rd_index_i in a clock of rd_i, unless rd_wait_o says that wr_i or commit_i have the way.
// - scan_en_i selects every word for writing and for reading at once, so that the supply current at rest shows defects in all of them: low in
//   operation, and no staged word takes what it brings, since the chains shift. Each active bit takes the staged one before it then, as in a
//   commit: a way that the chains use (asic/dft/scan_ways.hpp), so that it needs no multiplexer.
// - rd_data_o, params_o and t_max_staged_o show the stored data bits, uncorrected until the scrub has passed.
//
// Words are moved as what differs from their reset value: code words still, and 0 in most flops after reset (flops of a library often
// have no other reset), so that they cost no inverters; only what is written and what the host reads is put right.

module tc_mem (
  input  logic             clk_i,
  input  logic             rst_ni,
  input  logic             scan_en_i,
  input  logic             wr_i,
  input  logic [5:0]       wr_index_i,
  input  logic [15:0]      wr_data_i,
  input  logic             commit_i,
  input  logic             discard_i,
  output logic             discarding_o,    // from the clock of discard_i on
  input  logic             rd_i,            // memory-style read port of the staged set
  input  logic [5:0]       rd_index_i,
  output logic [15:0]      rd_data_o,
  output logic             rd_wait_o,
  output tc_pkg::params_t  params_o,
  output logic [15:0]      t_max_staged_o,
`ifdef TC_MEM_UPSET                            // the proof of the scrubbing flips bits of one word and looks at it
  input  logic [5:0]       upset_index_i,
  input  logic [21:0]      upset_staged_i,
  input  logic [21:0]      upset_active_i,
  output logic [21:0]      upset_staged_o,
  output logic [21:0]      upset_active_o,
  output logic [5:0]       upset_scrub_index_o,
  output logic             upset_scrub_active_o,
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
  logic        scrub_active_q;  // the pass stands on the active word of its index; the staged one comes first, for a commit between them
  logic        discarding_q;
  logic        scrub_bad_q;     // the running pass has found a flip that can not be corrected
  logic        bad_q;
  logic [15:0] corrected_q;

  function automatic logic [21:0] reset_word(input logic [5:0] index);
    reset_word = tc_math_pkg::secded_encode(tc_pkg::reg_reset(index));
  endfunction

  // The word in hand: the one that is written or read, else the one under the pass.
  logic       scrub_step, show_staged, show_active;
  logic [5:0] index;
  logic [15:0] reset_data;
  assign scrub_step  = scrub_busy_q && !wr_i && !commit_i && !rd_i;
  assign index       = wr_i ? wr_index_i : rd_i ? rd_index_i : scrub_index_q;
  assign reset_data  = tc_pkg::reg_reset(index);
  assign show_staged = rd_i || !(scrub_active_q || discarding_q) || scan_en_i;
  assign show_active = (!rd_i && (scrub_active_q || discarding_q)) || scan_en_i;

  // Each word behind its own select, all in one OR: flatter than a choice of one after the other. A commit opens all of the staged
  // set, each for its own active word.
  logic [LastWord:1] in_hand;
  (* mem2reg *) logic [21:0] open_staged [1:LastWord];
  logic [21:0] word;
  always_comb begin
    word = 22'd0;
    for (int unsigned i = 1; i <= LastWord; i++) begin
      in_hand[i] = index == 6'(i) || scan_en_i;
      open_staged[i] = {22{(in_hand[i] && show_staged) || commit_i}} & (staged_q[i] ^ reset_word(6'(i)));
      word |= open_staged[i] | ({22{in_hand[i] && show_active}} & (active_q[i] ^ reset_word(6'(i))));
    end
  end

  logic [21:0] flip;                                 // the wrong bit of the word in hand
  logic        one_flip, bad_now;
  assign flip = tc_math_pkg::secded_flip(word);
  assign one_flip = flip != 22'd0;
  assign bad_now = tc_math_pkg::secded_bad(word);

  // What the word in hand takes: all words share it, each with an enable of its own.
  logic [21:0] word_in, active_in;
  assign word_in = wr_i ? tc_math_pkg::secded_encode(wr_data_i ^ reset_data) : word ^ flip;
  assign active_in = commit_i || scan_en_i ? 22'd0 : word_in;

  // Low: no word changes. An enable that all words share: a simulator passes them by with one test.
  logic stir;
`ifdef TC_MEM_UPSET
  assign stir = 1'b1;
`else
  assign stir = wr_i || commit_i || scrub_busy_q || scan_en_i;
`endif

  for (genvar i = 1; i <= LastWord; i++) begin : gen_word
    localparam logic [21:0] ResetWord = reset_word(6'(i));
    localparam logic [21:0] Stored = tc_pkg::reg_stored(6'(i));
    logic take_staged, take_active;
    assign take_staged = in_hand[i] && (wr_i || (scrub_step && !scrub_active_q) || scan_en_i);
    assign take_active = in_hand[i] && ((scrub_step && (scrub_active_q || discarding_q)) || scan_en_i);

    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) staged_q[i] <= ResetWord;
      else if (stir) begin
        if (take_staged) staged_q[i] <= (word_in & Stored) ^ ResetWord;
`ifdef TC_MEM_UPSET
        else if (upset_index_i == 6'(i)) staged_q[i] <= ((staged_q[i] ^ ResetWord ^ upset_staged_i) & Stored) ^ ResetWord;
`endif
      end
    end

    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) active_q[i] <= ResetWord;
      else if (stir) begin
        if (take_active || commit_i) active_q[i] <= ((active_in | open_staged[i]) & Stored) ^ ResetWord;
`ifdef TC_MEM_UPSET
        else if (upset_index_i == 6'(i)) active_q[i] <= ((active_q[i] ^ ResetWord ^ upset_active_i) & Stored) ^ ResetWord;
`endif
      end
    end
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      scrub_busy_q <= 1'b0;
      scrub_index_q <= 6'd0;
      scrub_active_q <= 1'b0;
      discarding_q <= 1'b0;
      scrub_bad_q <= 1'b0;
      bad_q <= 1'b0;
      corrected_q <= 16'd0;
    end else begin
      if (scrub_step) begin
        corrected_q <= corrected_q + 16'(one_flip);
        scrub_bad_q <= scrub_bad_q || bad_now;
        scrub_active_q <= !scrub_active_q;
        if (bad_now) bad_q <= 1'b1;
        if (scrub_active_q) begin
          scrub_index_q <= scrub_index_q + 6'd1;
          if (scrub_index_q >= LastIndex) begin
            scrub_busy_q <= 1'b0;
            discarding_q <= 1'b0;
            bad_q <= scrub_bad_q || bad_now;
          end
        end
      end
      if (discard_i || (scrub_start_i && !scrub_busy_q)) begin
        scrub_busy_q <= 1'b1;
        scrub_index_q <= 6'd1;
        scrub_active_q <= 1'b0;
        discarding_q <= discard_i;
        scrub_bad_q <= 1'b0;
      end
    end
  end

  assign rd_data_o = word[15:0] ^ reset_data;
  assign rd_wait_o = wr_i || commit_i;
  assign discarding_o = discard_i || (scrub_busy_q && discarding_q);

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
  assign upset_scrub_active_o = scrub_active_q;
`endif

  assign t_max_staged_o = staged_q[tc_pkg::RegTMax][15:0];
  assign scrub_busy_o = scrub_busy_q;
  assign bad_o = bad_q;
  assign corrected_o = corrected_q;

endmodule
