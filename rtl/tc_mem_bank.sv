// SPDX-License-Identifier: Apache-2.0
// Some rows of MEM behind their selects, in one OR. A module, so that a layout can keep the rows together: mapped with
// all of MEM, the OR of each bit gathers rows of its own choice, and they have to lie near those of every other choice.
//
// Contract
// - Rows come as what differs from their reset values; bits that aren't Stored count as 0.
// - open_staged_o: the staged rows that are shown or committed. row_o: the OR of these and of the active rows shown.

module tc_mem_bank #(
  parameter int unsigned Rows = 1,
  parameter logic [22*Rows-1:0] Stored = '1
) (
  input  logic [Rows-1:0]    in_hand_i,
  input  logic               show_staged_i,
  input  logic               show_active_i,
  input  logic               commit_i,
  input  logic [22*Rows-1:0] staged_i,
  input  logic [22*Rows-1:0] active_i,
  output logic [22*Rows-1:0] open_staged_o,
  output logic [21:0]        row_o
);

  always_comb begin
    row_o = 22'd0;
    open_staged_o = '0;
    if (in_hand_i != '0 || commit_i) begin  // a simulator passes the other banks by
      for (int unsigned i = 0; i < Rows; i++) begin
        open_staged_o[22*i+:22] = {22{(in_hand_i[i] && show_staged_i) || commit_i}} & staged_i[22*i+:22] &
            Stored[22*i+:22];
        row_o |= open_staged_o[22*i+:22] |
            ({22{in_hand_i[i] && show_active_i}} & active_i[22*i+:22] & Stored[22*i+:22]);
      end
    end
  end

endmodule
