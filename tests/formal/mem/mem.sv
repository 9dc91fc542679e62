// SPDX-License-Identifier: Apache-2.0
// Proof of tc_mem with free inputs and reset at any time, for one word of each set; words.sh proves it for each word. Upsets flip
// one bit of the word in either set or both, in any clock, and again only after a pass that began later has healed it.
// engine: abc-induction

`include "tc_assert.svh"

module mem #(
  parameter logic [5:0] Word = 6'd25   // the word that is looked at, T_MAX
) (
  input logic        clk_i,
  input logic        reset_i,
  input logic        wr_i,
  input logic [5:0]  wr_index_i,
  input logic [15:0] wr_data_i,
  input logic        commit_i,
  input logic        discard_i,
  input logic        rd_i,
  input logic        scrub_start_i,
  input logic        upset_i,
  input logic [4:0]  upset_staged_i,    // bit that flips; 22 and above: none
  input logic [4:0]  upset_active_i,
  input logic [15:0] data_i,            // for the code alone
  input logic [4:0]  flip_a_i,
  input logic [4:0]  flip_b_i
);

  logic started_q = 1'b0;
  always_ff @(posedge clk_i) started_q <= 1'b1;
  logic rst_ni;
  assign rst_ni = started_q && !reset_i;

  function automatic logic [21:0] one_bit(input logic [4:0] place);
    one_bit = (place < 5'd22) ? 22'd1 << place : 22'd0;
  endfunction

  function automatic logic at_most_one(input logic [21:0] bits);
    at_most_one = (bits & (bits - 22'd1)) == 22'd0;
  endfunction

  // ---- the memory, and what its word should hold
  logic        clean_q;             // the word holds no flip
  logic        upset;
  logic [15:0] rd_data, t_max_staged, corrected;
  logic        busy, bad;
  logic [21:0] staged, active;
  logic [5:0]  scrub_index;
  logic        scrub_active, discarding, rd_wait;
  tc_pkg::params_t params;
  assign upset = upset_i && clean_q;

  // PARAMC lets nothing through that lies outside the register's range.
  localparam logic [5:0] LastIndex = 6'(tc_pkg::HoldingCount - 1);
  function automatic logic in_range(input logic [15:0] x);
    in_range = tc_pkg::reg_signed(Word) ? $signed(x) >= $signed(tc_pkg::reg_min(Word)) && $signed(x) <= $signed(tc_pkg::reg_max(Word))
                                        : x >= tc_pkg::reg_min(Word) && x <= tc_pkg::reg_max(Word);
  endfunction
  logic [15:0] wr_data;
  assign wr_data = wr_index_i == Word && !in_range(wr_data_i) ? tc_pkg::reg_reset(Word) : wr_data_i;

  // Nobody writes during a discard, nor is there a commit after its first clock (TopDiscardIsWhole_A).
  logic wr, commit, discarding_q;
  assign wr = wr_i && !discard_i && !discarding_q;
  assign commit = commit_i && !discarding_q;

  tc_mem u_mem (
    .clk_i, .rst_ni, .scan_en_i(1'b0), .wr_i(wr), .wr_index_i, .wr_data_i(wr_data), .commit_i(commit), .discard_i, .scrub_start_i,
    .discarding_o(discarding), .rd_i, .rd_index_i(Word), .rd_data_o(rd_data), .rd_wait_o(rd_wait),
    .params_o(params), .t_max_staged_o(t_max_staged),
    .upset_index_i(Word), .upset_staged_i(upset ? one_bit(upset_staged_i) : 22'd0),
    .upset_active_i(upset ? one_bit(upset_active_i) : 22'd0),
    .upset_staged_o(staged), .upset_active_o(active), .upset_scrub_index_o(scrub_index), .upset_scrub_active_o(scrub_active),
    .scrub_busy_o(busy), .bad_o(bad), .corrected_o(corrected)
  );

  logic        fresh_q;             // no clock since reset: the words hold their reset values
  logic [15:0] staged_q, active_q, staged_ref, active_ref;
  assign staged_ref = fresh_q ? tc_pkg::reg_reset(Word) : staged_q;
  assign active_ref = fresh_q ? tc_pkg::reg_reset(Word) : active_q;
  logic        pass_q;              // a pass that began after the upset is running
  // A discard: the pass takes the staged word back when it goes by.
  logic       step, taken_back;
  logic [6:0] place, walked_q;        // words that the pass has gone by; the same counted here since the discard
  assign step = busy && !wr && !commit && !rd_i;
  assign taken_back = discarding_q && step && scrub_index == Word && !scrub_active;
  assign place = {scrub_index - 6'd1, scrub_active};
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      fresh_q <= 1'b1;
      staged_q <= 16'd0;
      active_q <= 16'd0;
      clean_q <= 1'b1;
      pass_q <= 1'b0;
      discarding_q <= 1'b0;
      walked_q <= 7'd0;
    end else begin
      fresh_q <= 1'b0;
      if (wr && wr_index_i == Word) staged_q <= wr_data;
      else if (taken_back) staged_q <= active_ref;
      else staged_q <= staged_ref;
      active_q <= commit ? staged_ref : active_ref;
      if (discard_i) discarding_q <= 1'b1;
      else if (step && scrub_active && scrub_index == LastIndex) discarding_q <= 1'b0;
      if (discard_i) walked_q <= 7'd0;
      else if (discarding_q && step) walked_q <= walked_q + 7'd1;

      if (upset) begin
        clean_q <= 1'b0;
        pass_q <= 1'b0;
      end else if (!clean_q) begin
        if (discard_i || (!busy && scrub_start_i)) pass_q <= 1'b1;
        if (pass_q && !busy) clean_q <= 1'b1;
      end
    end
  end

  `TC_ASSERT_SETUP

  // What stands in the word: the code of the written value, with one flip at most, and none after a pass.
  logic [21:0] wrong_staged, wrong_active;
  assign wrong_staged = staged ^ tc_math_pkg::secded_encode(staged_ref);
  assign wrong_active = active ^ tc_math_pkg::secded_encode(active_ref);
  `TC_ASSERT(MemProofInRange_A, in_range(staged_ref) && in_range(active_ref))
  `TC_ASSERT(MemProofOneFlip_A, at_most_one(wrong_staged) && at_most_one(wrong_active))
  `TC_ASSERT_IF(MemProofHealed_A, clean_q, wrong_staged == 22'd0 && wrong_active == 22'd0)
  `TC_ASSERT_IF(MemProofCorrectable_A, !clean_q, !tc_math_pkg::secded_bad(staged) && !tc_math_pkg::secded_bad(active))
  `TC_COVER(MemProofHealing_C, pass_q && !busy)

  // Inside the pass the word is healed as soon as the pass has gone by it.
  `TC_ASSERT_IF(MemProofPassHeals_A, pass_q && (!busy || scrub_index > Word),
                wrong_staged == 22'd0 && wrong_active == 22'd0)
  `TC_ASSERT_IF(MemProofPassHealsStaged_A, pass_q && scrub_index == Word && scrub_active, wrong_staged == 22'd0)
  `TC_ASSERT_IF(MemProofPassPlace_A, busy, scrub_index >= 6'd1 && scrub_index <= LastIndex)

  // A discard has taken the staged word back as soon as its pass has gone by, and it ends with the pass: a clock for each word of both
  // sets in which nothing else has the way.
  `TC_ASSERT(MemProofDiscarding_A, discarding == (discard_i || discarding_q) && (!discarding_q || busy))
  `TC_ASSERT_IF(MemProofDiscarded_A, discarding_q && place > {Word - 6'd1, 1'b0}, staged_ref == active_ref)
  `TC_ASSERT_IF(MemProofDiscardEnds_A, discarding_q, walked_q == place)

  // A clean word is seen at the ports; the active one changes only with a commit, an upset or its correction.
  `TC_ASSERT_IF(MemProofReadPort_A, clean_q && rd_i && !rd_wait, rd_data == staged_ref)
  `TC_ASSERT(MemProofReadWaits_A, rd_wait == (wr || commit))
  logic [21:0] active_past_q;
  logic        commit_past_q, touched_past_q;
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      active_past_q <= 22'd0;
      commit_past_q <= 1'b1;      // nothing to compare with yet
      touched_past_q <= 1'b0;
    end else begin
      active_past_q <= active;
      commit_past_q <= commit;
      touched_past_q <= upset || !clean_q;
    end
  end
  `TC_ASSERT_IF(MemProofActiveStays_A, !commit_past_q && !touched_past_q, active == active_past_q)

  // The code alone: clean words are untouched, one flip is found, two are bad and never "corrected".
  logic [21:0] code, flipped;
  assign code = tc_math_pkg::secded_encode(data_i);
  assign flipped = code ^ one_bit(flip_a_i) ^ one_bit(flip_b_i);
  `TC_ASSERT(MemProofCodeClean_A, tc_math_pkg::secded_flip(code) == 22'd0 && !tc_math_pkg::secded_bad(code))
  `TC_ASSERT(MemProofCodeSingle_A, tc_math_pkg::secded_flip(code ^ one_bit(flip_a_i)) == one_bit(flip_a_i))
  `TC_ASSERT_IF(MemProofCodeDouble_A, flip_a_i != flip_b_i && flip_a_i < 5'd22 && flip_b_i < 5'd22,
                tc_math_pkg::secded_bad(flipped) && tc_math_pkg::secded_flip(flipped) == 22'd0)

endmodule
