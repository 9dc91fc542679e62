// SPDX-License-Identifier: Apache-2.0
// MEM, the parameter memory: a staged and an active set of the holding registers, each set a product code that
// corrects one flip and finds two.
//
// Contract
// - Words 1 .. HoldingCount-1 are stored; index 0 (CMD) and indices beyond the map read 0 and swallow writes.
// - Each word is a row with an even number of ones, and behind the words stands a row that makes their columns even
//   too. One flip in a set is where an odd row and an odd column meet; two flips never look like one.
// - A word has the bits that differ within its register's range (tc_pkg::reg_stored), the others stand at their one
//   value; what is written lies in that range.
// - wr_i changes one staged word, commit_i copies the staged set to the active set in one clock, in which no write is
//   taken: tc_atune holds its own until the next one, tc_sysctrl asserts that there is no other.
// - scrub_start_i walks the active and then the staged set, a clock a row and one to judge: one flip is corrected; what
//   can't be corrected is walked once more, since it may be the walk that was struck, and then raises bad_o, which
//   falls at the end of a pass that found none. A start while busy is ignored. The pass stands still in a clock of rd_i
//   and begins anew with wr_i and commit_i.
// - discard_i begins a pass anew, in which the staged set takes the active one: until discarding_o falls there is no
//   wr_i, and after the clock of discard_i no commit_i (tc_top asserts it).
// - rd_data_o is the staged word at rd_index_i in a clock of rd_i, unless rd_wait_o says that wr_i or commit_i have the
//   way.
// - scan_en_i selects every row for writing and for reading at once, so that the supply current at rest shows defects
//   in all of them: low in operation, and no staged row takes what it brings, since the chains shift. Each active bit
//   takes the staged one before it then, as in a commit: a way that the chains use (asic/dft/scan/scan_ways.hpp), so
//   that it needs no multiplexer.
// - rd_data_o, params_o and t_max_staged_o show the stored data bits, uncorrected until the scrub has passed.
//
// Words are moved as what differs from their reset value: rows of even parity still, and 0 in most flops after reset
// (flops of a library often have no other reset), so that they cost no inverters; only what is written and what the
// host reads is put right.

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
`ifdef TC_MEM_UPSET                            // the proof of the scrubbing flips bits of one row and looks at all
  input  logic [5:0]       upset_index_i,
  input  logic [21:0]      upset_staged_i,
  input  logic [21:0]      upset_active_i,
  // row i at 22 (i - 1), as what differs from its reset value
  output logic [22*tc_pkg::HoldingCount-1:0] upset_staged_o,
  output logic [22*tc_pkg::HoldingCount-1:0] upset_active_o,
  output logic [5:0]       upset_scrub_index_o,
  output logic             upset_scrub_staged_o,
  output logic             upset_discarding_o,
  output logic [21:0]      upset_syndrome_o,
  output logic [5:0]       upset_odd_row_o,
  output logic             upset_odd_rows_o,
  output logic             upset_again_o,
`endif
  input  logic             scrub_start_i,
  output logic             scrub_busy_o,
  output logic             bad_o,
  output logic [15:0]      corrected_o
);

  localparam int unsigned LastWord = tc_pkg::HoldingCount - 1;
  localparam int unsigned Columns = LastWord + 1;  // the row that makes the columns even
  localparam logic [5:0] ColumnsIndex = 6'(Columns);
  localparam int unsigned BankRows = 8;
  localparam int unsigned Banks = (Columns + BankRows - 1) / BankRows;

  (* mem2reg *) logic [21:0] staged_q [1:Columns];
  (* mem2reg *) logic [21:0] active_q [1:Columns];
  logic        scrub_busy_q;
  logic [5:0]  scrub_index_q;   // the row that the pass stands on; beyond the columns it judges
  // the pass is at the staged set; the active one comes first, so that a discard takes what is corrected
  logic        scrub_staged_q;
  logic        discarding_q;
  logic        again_q;         // the set is walked the second time
  logic        scrub_bad_q;     // the running pass has found what can't be corrected
  logic        bad_q;
  logic [21:0] syndrome_q;      // odd columns of the rows that the pass has gone by in this set
  logic [5:0]  odd_row_q;       // the first odd one of these rows; 0: none
  logic        odd_rows_q;      // there are more
  logic [15:0] corrected_q;

  function automatic logic [21:0] reset_row(input logic [5:0] index);
    reset_row = tc_math_pkg::mem_row(tc_pkg::reg_corrected(index), tc_pkg::reg_reset(index));
  endfunction

  // These make parameters: no clock runs them.
  // verilator coverage_off
  function automatic logic [21:0] stored_row(input logic [5:0] index);
    stored_row = tc_pkg::reg_stored(index);
  endfunction

  function automatic logic [22*BankRows-1:0] stored_rows(input logic [5:0] first);
    for (int unsigned i = 0; i < BankRows; i++) stored_rows[22*i+:22] = stored_row(first + 6'(i));
  endfunction
  // verilator coverage_on

  // The row in hand: the one that is written or read, else the one under the pass.
  logic        wr, step, judge, show_staged, show_active;
  logic [5:0]  index;
  logic [15:0] reset_data;
  assign wr          = wr_i && !commit_i;
  assign step        = scrub_busy_q && !wr_i && !commit_i && !rd_i;
  assign judge       = scrub_index_q > ColumnsIndex;
  // none while MEM rests: neither gates nor a simulator have work then
  assign index       = wr_i ? wr_index_i : rd_i ? rd_index_i : !scrub_busy_q ? 6'd0 : judge ? odd_row_q : scrub_index_q;
  assign reset_data  = tc_pkg::reg_reset(index);
  assign show_staged = wr_i || rd_i || (scrub_staged_q && !discarding_q) || scan_en_i;
  assign show_active = (!wr_i && !rd_i && (!scrub_staged_q || discarding_q)) || scan_en_i;

  // Each row behind its own select, all in one OR: flatter than a choice of one after the other. A commit opens all of
  // the staged set, each for its own active row.
  logic [63:0] by_index;  // one-hot
  logic [Columns:1] in_hand;
  logic [22*Columns-1:0] staged_rows, active_rows, open_staged;  // row i at 22 (i - 1)
  (* mem2reg *) logic [21:0] bank_row [0:Banks-1];
  logic [21:0] row;
  assign by_index = 64'd1 << index;
  assign in_hand = {by_index[Columns] && !wr_i && !rd_i, by_index[Columns-1:1]} | {Columns{scan_en_i}};
  for (genvar i = 1; i <= Columns; i++) begin : gen_select
    assign staged_rows[22*(i-1)+:22] = staged_q[i] ^ reset_row(6'(i));
    assign active_rows[22*(i-1)+:22] = active_q[i] ^ reset_row(6'(i));
  end
  for (genvar b = 0; b < Banks; b++) begin : gen_bank
    localparam int unsigned First = BankRows * b;
    localparam int unsigned Rows = Columns - First < BankRows ? Columns - First : BankRows;
    localparam logic [22*BankRows-1:0] BankStored = stored_rows(6'(First + 1));
    tc_mem_bank #(.Rows(Rows), .Stored(BankStored[22*Rows-1:0])) u_bank (
      .in_hand_i(in_hand[First+1+:Rows]), .show_staged_i(show_staged), .show_active_i(show_active), .commit_i(commit_i),
      .staged_i(staged_rows[22*First+:22*Rows]), .active_i(active_rows[22*First+:22*Rows]),
      .open_staged_o(open_staged[22*First+:22*Rows]), .row_o(bank_row[b])
    );
  end
  always_comb begin
    row = 22'd0;
    for (int unsigned b = 0; b < Banks; b++) row |= bank_row[b];
  end

  // One flip stands where the only odd row meets the only odd column.
  logic one_column, sound, fix;
  assign one_column = syndrome_q != 22'd0 && (syndrome_q & (syndrome_q - 22'd1)) == 22'd0;
  assign sound      = syndrome_q == 22'd0 && odd_row_q == 6'd0;
  assign fix        = step && judge && odd_row_q != 6'd0 && !odd_rows_q && one_column;

  // What the row in hand takes: all rows share it, each with an enable of its own. The columns follow a write by what
  // it changes.
  logic [21:0] row_in, active_in, written;
  logic        writes;
  assign row_in = wr_i ? tc_math_pkg::mem_row(tc_pkg::reg_corrected(index), wr_data_i ^ reset_data)
                       : row ^ ({22{judge}} & syndrome_q);
  assign active_in = commit_i || scan_en_i ? 22'd0 : row_in;
  assign writes = wr && index != 6'd0 && index < ColumnsIndex;
  assign written = row ^ row_in;

  // Low: no row changes. An enable that all rows share: a simulator passes them by with one test.
  logic stir, copy;
  assign copy = step && !judge && scrub_staged_q && discarding_q;
`ifdef TC_MEM_UPSET
  assign stir = 1'b1;
`else
  assign stir = wr || commit_i || copy || fix || scan_en_i;
`endif

  for (genvar i = 1; i <= Columns; i++) begin : gen_row
    localparam logic [21:0] ResetRow = reset_row(6'(i));
    localparam logic [21:0] Stored = stored_row(6'(i));
    logic take_staged, take_active;
    logic [21:0] staged_in;
    assign take_active = in_hand[i] && ((fix && !scrub_staged_q) || scan_en_i);
    if (i == Columns) begin : gen_columns
      assign take_staged = writes || (in_hand[i] && (copy || (fix && scrub_staged_q) || scan_en_i));
      assign staged_in = wr_i ? staged_q[i] ^ written : row_in;
    end else begin : gen_word
      assign take_staged = in_hand[i] && (wr || copy || (fix && scrub_staged_q) || scan_en_i);
      assign staged_in = row_in;
    end

    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) staged_q[i] <= ResetRow;
      else if (stir) begin
        if (take_staged) staged_q[i] <= (staged_in & Stored) ^ ResetRow;
`ifdef TC_MEM_UPSET
        else if (upset_index_i == 6'(i)) staged_q[i] <= ((staged_q[i] ^ ResetRow ^ upset_staged_i) & Stored) ^ ResetRow;
`endif
      end
    end

    always_ff @(posedge clk_i or negedge rst_ni) begin
      if (!rst_ni) active_q[i] <= ResetRow;
      else if (stir) begin
        if (take_active || commit_i) active_q[i] <= ((active_in | open_staged[22*(i-1)+:22]) & Stored) ^ ResetRow;
`ifdef TC_MEM_UPSET
        else if (upset_index_i == 6'(i)) active_q[i] <= ((active_q[i] ^ ResetRow ^ upset_active_i) & Stored) ^ ResetRow;
`endif
      end
    end
  end

  // Sound or put right, or walked twice: on to the next set.
  logic starts, settled, bad_now;
  assign starts  = discard_i || (scrub_start_i && !scrub_busy_q);
  assign settled = sound || fix || again_q;
  assign bad_now = !sound && !fix && again_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      scrub_busy_q <= 1'b0;
      scrub_staged_q <= 1'b0;
      discarding_q <= 1'b0;
      again_q <= 1'b0;
      scrub_bad_q <= 1'b0;
      bad_q <= 1'b0;
      corrected_q <= 16'd0;
    end else begin
      if (step && judge) begin
        corrected_q <= corrected_q + 16'(fix);
        again_q <= !settled;
        if (bad_now) bad_q <= 1'b1;
        scrub_bad_q <= scrub_bad_q || bad_now;
        if (settled) scrub_staged_q <= !scrub_staged_q;
        if (settled && scrub_staged_q) begin
          scrub_busy_q <= 1'b0;
          discarding_q <= 1'b0;
          bad_q <= scrub_bad_q || bad_now;
        end
      end
      if (starts) begin
        scrub_busy_q <= 1'b1;
        discarding_q <= discard_i;
      end
      if (starts || wr_i || commit_i) begin
        scrub_staged_q <= 1'b0;
        again_q <= 1'b0;
        scrub_bad_q <= 1'b0;
      end
    end
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      scrub_index_q <= 6'd1;
      syndrome_q <= 22'd0;
      odd_row_q <= 6'd0;
      odd_rows_q <= 1'b0;
    end else if (starts || wr_i || commit_i || (step && judge)) begin
      scrub_index_q <= 6'd1;
      syndrome_q <= 22'd0;
      odd_row_q <= 6'd0;
      odd_rows_q <= 1'b0;
    end else if (step) begin
      scrub_index_q <= scrub_index_q + 6'd1;
      syndrome_q <= syndrome_q ^ row;
      if (^row && odd_row_q == 6'd0) odd_row_q <= scrub_index_q;
      if (^row && odd_row_q != 6'd0) odd_rows_q <= 1'b1;
    end
  end

  assign rd_data_o = row[15:0] ^ reset_data;
  assign rd_wait_o = wr_i || commit_i;
  assign discarding_o = discard_i || (scrub_busy_q && discarding_q);

  logic [16*tc_pkg::HoldingCount-1:0] params_bits;
  assign params_bits[15:0] = 16'd0;
  for (genvar i = 1; i <= LastWord; i++) begin : gen_params
    // A flip of these would outlast the pass that corrects it: in the control period, or in a PWM period begun with
    // it.
    if (tc_pkg::reg_corrected(6'(i))) begin : gen_corrected
      assign params_bits[16*i+:16] = 16'(active_q[i] ^ tc_math_pkg::secded_flip(active_q[i]));
    end else begin : gen_plain
      assign params_bits[16*i+:16] = active_q[i][15:0];
    end
  end
  assign params_o = params_bits;

`ifdef TC_MEM_UPSET
  for (genvar i = 1; i <= Columns; i++) begin : gen_shown
    assign upset_staged_o[22*(i-1)+:22] = staged_q[i] ^ reset_row(6'(i));
    assign upset_active_o[22*(i-1)+:22] = active_q[i] ^ reset_row(6'(i));
  end
  assign upset_scrub_index_o = scrub_index_q;
  assign upset_scrub_staged_o = scrub_staged_q;
  assign upset_discarding_o = scrub_busy_q && discarding_q;
  assign upset_syndrome_o = syndrome_q;
  assign upset_odd_row_o = odd_row_q;
  assign upset_odd_rows_o = odd_rows_q;
  assign upset_again_o = again_q || scrub_bad_q;
`endif

  assign t_max_staged_o = staged_q[tc_pkg::RegTMax][15:0];
  assign scrub_busy_o = scrub_busy_q;
  assign bad_o = bad_q;
  assign corrected_o = corrected_q;

endmodule
