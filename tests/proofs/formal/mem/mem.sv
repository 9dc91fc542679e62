// SPDX-License-Identifier: Apache-2.0
// Proof of tc_mem with free inputs and reset at any time. An upset flips one bit of any row in one of the sets, in any clock, and again
// only after a pass that began later has healed it; a discard comes when no flip stands.
// engine: cadical-induction

`include "tc_assert.svh"

module mem (
  input logic        clk_i,
  input logic        reset_i,
  input logic        wr_i,
  input logic [5:0]  wr_index_i,
  input logic [15:0] wr_data_i,
  input logic        commit_i,
  input logic        discard_i,
  input logic        rd_i,
  input logic [5:0]  rd_index_i,
  input logic        scrub_start_i,
  input logic        upset_i,
  input logic        upset_active_i,    // of the active set; else of the staged one
  input logic [5:0]  upset_row_i,
  input logic [4:0]  upset_bit_i,
  input logic [15:0] data_i,            // for the code alone
  input logic [4:0]  flip_a_i,
  input logic [4:0]  flip_b_i
);

  localparam int unsigned Words = tc_pkg::HoldingCount - 1;
  localparam int unsigned Rows = Words + 1;
  localparam logic [5:0] Columns = 6'(Rows);

  logic started_q = 1'b0;
  always_ff @(posedge clk_i) started_q <= 1'b1;
  logic rst_ni;
  assign rst_ni = started_q && !reset_i;

  function automatic logic [21:0] one_bit(input logic [4:0] place);
    one_bit = (place < 5'd22) ? 22'd1 << place : 22'd0;
  endfunction

  // ---- the memory
  logic        clean_q;               // no flip stands, as far as the passes tell
  logic        upset, wr, commit, discard, writes;
  logic [21:0] upset_mask;
  logic [15:0] rd_data, t_max_staged, corrected, wr_data;
  logic        busy, bad, discarding, rd_wait, scrub_staged, odd_rows, again, taking_back;
  logic [22*Rows-1:0] staged, active;
  logic [5:0]  index, odd_row;
  logic [21:0] syndrome;
  tc_pkg::params_t params;
  logic [16*tc_pkg::HoldingCount-1:0] params_bits;
  assign params_bits = params;

  // PARAMC lets nothing through that lies outside the register's range.
  function automatic logic in_range(input logic [5:0] word, input logic [15:0] x);
    in_range = tc_pkg::reg_signed(word) ? $signed(x) >= $signed(tc_pkg::reg_min(word)) && $signed(x) <= $signed(tc_pkg::reg_max(word))
                                        : x >= tc_pkg::reg_min(word) && x <= tc_pkg::reg_max(word);
  endfunction
  assign wr_data = in_range(wr_index_i, wr_data_i) ? wr_data_i : tc_pkg::reg_reset(wr_index_i);

  // Nobody writes during a discard, nor is there a commit after its first clock (TopDiscardIsWhole_A).
  logic discarding_q;
  assign discard = discard_i && clean_q;
  assign wr = wr_i && !discard && !discarding_q;
  assign commit = commit_i && !discarding_q;
  assign writes = wr && !commit && wr_index_i >= 6'd1 && wr_index_i < Columns;
  assign upset = upset_i && clean_q && !discard && !discarding_q && upset_row_i >= 6'd1 && upset_row_i <= Columns && upset_mask != 22'd0;
  assign upset_mask = one_bit(upset_bit_i) & tc_pkg::reg_stored(upset_row_i);

  tc_mem u_mem (
    .clk_i, .rst_ni, .scan_en_i(1'b0), .wr_i(wr), .wr_index_i, .wr_data_i(wr_data), .commit_i(commit), .discard_i(discard), .scrub_start_i,
    .discarding_o(discarding), .rd_i, .rd_index_i, .rd_data_o(rd_data), .rd_wait_o(rd_wait),
    .params_o(params), .t_max_staged_o(t_max_staged),
    .upset_index_i(upset_row_i), .upset_staged_i(upset && !upset_active_i ? upset_mask : 22'd0),
    .upset_active_i(upset && upset_active_i ? upset_mask : 22'd0),
    .upset_staged_o(staged), .upset_active_o(active), .upset_scrub_index_o(index), .upset_scrub_staged_o(scrub_staged), .upset_discarding_o(taking_back),
    .upset_syndrome_o(syndrome), .upset_odd_row_o(odd_row), .upset_odd_rows_o(odd_rows), .upset_again_o(again),
    .scrub_busy_o(busy), .bad_o(bad), .corrected_o(corrected)
  );

  // ---- the walk, as it should be
  logic step, judged, copied, anew;
  assign step = busy && !wr && !commit && !rd_i;
  assign judged = step && index > Columns;
  assign copied = step && index <= Columns && scrub_staged && discarding_q;
  assign anew = discard || (scrub_start_i && !busy) || wr || commit || judged;

  // ---- the flip: where it stands in each set. A write over it leaves it in the columns.
  logic [21:0] mask_q;
  logic        in_staged_q, in_active_q, seen_q, pass_q;
  logic [5:0]  row_staged_q, row_active_q;
  logic        stands;                 // in the set that the pass is at
  logic [5:0]  stands_at;
  assign stands = scrub_staged ? in_staged_q : in_active_q;
  assign stands_at = scrub_staged ? row_staged_q : row_active_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      mask_q <= 22'd0;
      in_staged_q <= 1'b0;
      in_active_q <= 1'b0;
      row_staged_q <= 6'd0;
      row_active_q <= 6'd0;
      seen_q <= 1'b0;
      clean_q <= 1'b1;
      pass_q <= 1'b0;
      discarding_q <= 1'b0;
    end else begin
      // A clock in which the memory takes a row is none in which that row is struck.
      if (upset) begin
        clean_q <= 1'b0;
        pass_q <= 1'b0;
        mask_q <= upset_mask;
        in_staged_q <= !upset_active_i && !(writes && (upset_row_i == wr_index_i || upset_row_i == Columns));
        in_active_q <= upset_active_i && !commit;
        row_staged_q <= upset_row_i;
        row_active_q <= upset_row_i;
      end else if (!clean_q) begin
        if (writes && in_staged_q && row_staged_q == wr_index_i) row_staged_q <= Columns;
        if (commit) begin
          in_active_q <= in_staged_q;
          row_active_q <= row_staged_q;
        end
        if (judged && seen_q && scrub_staged) in_staged_q <= 1'b0;
        if (judged && seen_q && !scrub_staged) in_active_q <= 1'b0;
        if (!busy && scrub_start_i) pass_q <= 1'b1;
        if (pass_q && !busy) clean_q <= 1'b1;
      end
      if (anew) seen_q <= 1'b0;
      else if (step && stands && stands_at == index) seen_q <= 1'b1;
      if (discard) discarding_q <= 1'b1;
      else if (judged && scrub_staged) discarding_q <= 1'b0;
    end
  end

  // ---- what the rows should hold, as what differs from their reset values
  logic [22*Rows-1:0] staged_ref, active_ref;
  logic [21:0] written, overwritten;
  assign written = tc_math_pkg::mem_row(tc_pkg::reg_corrected(wr_index_i), wr_data ^ tc_pkg::reg_reset(wr_index_i));
  logic [Rows:1] staged_holds, active_holds, even, shown, taken_back;
  for (genvar i = 1; i <= Rows; i++) begin : gen_row
    localparam logic [21:0] Stored = tc_pkg::reg_stored(6'(i));
    logic [21:0] staged_q, active_q, staged_row, active_row, flip_staged, flip_active;
    assign staged_row = staged_q & Stored;
    assign active_row = active_q & Stored;
    assign staged_ref[22*(i-1)+:22] = staged_row;
    assign active_ref[22*(i-1)+:22] = active_row;
    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) begin
        staged_q <= 22'd0;
        active_q <= 22'd0;
      end else begin
        if (copied && index == 6'(i)) staged_q <= active_row;
        else if (writes && i == Rows) staged_q <= staged_row ^ overwritten ^ written;
        else if (writes && wr_index_i == 6'(i)) staged_q <= written;
        if (commit) active_q <= staged_row;
      end
    end

    assign flip_staged = {22{in_staged_q && row_staged_q == 6'(i)}} & mask_q;
    assign flip_active = {22{in_active_q && row_active_q == 6'(i)}} & mask_q;
    assign staged_holds[i] = staged[22*(i-1)+:22] == (staged_row ^ flip_staged) && (flip_staged & ~Stored) == 22'd0;
    assign active_holds[i] = active[22*(i-1)+:22] == (active_row ^ flip_active) && (flip_active & ~Stored) == 22'd0;
    if (tc_pkg::reg_corrected(6'(i))) begin : gen_code
      assign even[i] = staged_row == tc_math_pkg::secded_encode(staged_row[15:0]) &&
                       active_row == tc_math_pkg::secded_encode(active_row[15:0]);
    end else begin : gen_parity
      assign even[i] = !(^staged_row) && !(^active_row);
    end
    assign shown[i] = i == Rows || (flip_active != 22'd0 && !tc_pkg::reg_corrected(6'(i))) ||
                      params_bits[16*(i%Rows)+:16] == (active_row[15:0] ^ tc_pkg::reg_reset(6'(i)));
    assign taken_back[i] = staged_row == active_row || index <= 6'(i);
  end
  always_comb begin
    overwritten = 22'd0;
    for (int unsigned i = 1; i <= Words; i++) if (wr_index_i == 6'(i)) overwritten |= staged_ref[22*(i-1)+:22];
  end

  `TC_ASSERT_SETUP

  // The rows hold what was written, committed or discarded into them, but for the flip; each is even. The blocks see the active words.
  // A discard has taken a row back as soon as its pass has gone by.
  `TC_ASSERT(MemProofStaged_A, &staged_holds)
  `TC_ASSERT(MemProofActive_A, &active_holds)
  `TC_ASSERT(MemProofRowsEven_A, &even)
  `TC_ASSERT(MemProofParams_A, &shown)
  // (No antecedent to cover: random inputs seldom leave a discard alone for so long; the tests see its end.)
  `TC_ASSERT(MemProofDiscarded_A, !(discarding_q && scrub_staged) || &taken_back)

  // The columns are even: of the staged set, but for a discard's mixture, and of the active one; and the syndrome is that of the rows that the
  // walk has behind it, with the flip that it has seen.
  logic [21:0] staged_columns, active_columns, staged_behind, active_behind, behind;
  always_comb begin
    staged_columns = 22'd0;
    active_columns = 22'd0;
    staged_behind = 22'd0;
    active_behind = 22'd0;
    for (int unsigned i = 1; i <= Rows; i++) begin
      staged_columns ^= staged_ref[22*(i-1)+:22];
      active_columns ^= active_ref[22*(i-1)+:22];
      if (index == 6'(i + 1)) begin
        staged_behind |= staged_columns;
        active_behind |= active_columns;
      end
    end
  end
  assign behind = scrub_staged && !discarding_q ? staged_behind : active_behind;
  `TC_ASSERT_IF(MemProofStagedColumns_A, !discarding_q, staged_columns == 22'd0)
  `TC_ASSERT(MemProofActiveColumns_A, active_columns == 22'd0)
  `TC_ASSERT(MemProofSyndrome_A, syndrome == (behind ^ (seen_q ? mask_q : 22'd0)))
  `TC_ASSERT(MemProofOddRow_A, odd_row == (seen_q ? stands_at : 6'd0) && !odd_rows && !again && (!seen_q || (stands && stands_at < index)))
  `TC_ASSERT(MemProofFlip_A, mask_q == 22'd0 ? !in_staged_q && !in_active_q : (mask_q & (mask_q - 22'd1)) == 22'd0)
  `TC_ASSERT(MemProofFlipPlace_A, (!in_staged_q || (row_staged_q >= 6'd1 && row_staged_q <= Columns)) &&
                                  (!in_active_q || (row_active_q >= 6'd1 && row_active_q <= Columns)))
  `TC_ASSERT(MemProofPlace_A, index >= 6'd1 && index <= Columns + 6'd1 && (busy || (index == 6'd1 && !scrub_staged)))
  // What is written in range loses nothing.
  `TC_ASSERT_IF(MemProofWhole_A, writes, (written & ~tc_pkg::reg_stored(wr_index_i)) == 22'd0)

  // A flip is never called bad, and a pass that began after it has healed it.
  `TC_ASSERT(MemProofNeverBad_A, !bad)
  `TC_ASSERT_IF(MemProofHealed_A, clean_q, !in_staged_q && !in_active_q)
  `TC_ASSERT_IF(MemProofPassHealsActive_A, pass_q && (!busy || scrub_staged), !in_active_q)
  `TC_ASSERT_IF(MemProofPassHealsStaged_A, pass_q && !busy, !in_staged_q)
  `TC_ASSERT_IF(MemProofPassSees_A, pass_q && busy && stands && index > stands_at, seen_q)
  `TC_COVER(MemProofHealing_C, judged && seen_q)

  `TC_ASSERT(MemProofDiscarding_A, discarding == (discard || discarding_q) && taking_back == discarding_q && (!discarding_q || busy))
  `TC_ASSERT_IF(MemProofDiscardIsClean_A, discarding_q, clean_q)

  // What the host reads.
  logic [15:0] read;
  always_comb begin
    read = 16'd0;
    for (int unsigned i = 1; i <= Words; i++) if (rd_index_i == 6'(i)) read |= staged_ref[22*(i-1)+:16] ^ tc_pkg::reg_reset(6'(i));
  end
  `TC_ASSERT_IF(MemProofReadPort_A, rd_i && !rd_wait && !(in_staged_q && row_staged_q == rd_index_i), rd_data == read)
  `TC_ASSERT(MemProofReadWaits_A, rd_wait == (wr || commit))

  // The code of the words that are corrected on the way out, alone: clean words are untouched, one flip is found, two are never "corrected".
  logic [21:0] code, flipped;
  assign code = tc_math_pkg::secded_encode(data_i);
  assign flipped = code ^ one_bit(flip_a_i) ^ one_bit(flip_b_i);
  `TC_ASSERT(MemProofCodeClean_A, tc_math_pkg::secded_flip(code) == 22'd0 && !(^code))
  `TC_ASSERT(MemProofCodeSingle_A, tc_math_pkg::secded_flip(code ^ one_bit(flip_a_i)) == one_bit(flip_a_i))
  `TC_ASSERT_IF(MemProofCodeDouble_A, flip_a_i != flip_b_i && flip_a_i < 5'd22 && flip_b_i < 5'd22,
                tc_math_pkg::secded_flip(flipped) == 22'd0)

endmodule
