// SPDX-License-Identifier: Apache-2.0
// UARTC with all inputs free. The receiver is replaced (Yosys option in flags) by one that says anything at any time: what is proved
// for it holds for the real one, and a whole frame takes a few clocks instead of thousands. rx.sv proves the real one.
// Proved here besides the assertions inside the blocks:
//   the line is silent but for the answer to a command that was addressed to this slave alone (P13, P14). The lead of an answer: lead.sv.
// prove: Uart* P09_* P10_* P14_Answer* P14_Command* Silent* NoCommand* GoodRaises*
`include "tc_assert.svh"

module uartc (
  input logic        clk_i,
  input logic        rx_i,
  input logic [7:0]  cfg_address_i,
  input logic [2:0]  strap_i,
  input logic [12:0] cfg_baud_i,
  input logic [1:0]  cfg_format_i,
  input logic        cfg_pause_i,
  input logic [3:0]  cmd_word_index_i,
  input logic        cmd_done_i,
  input logic [2:0]  rsp_kind_i,
  input logic [7:0]  rsp_exc_i,
  input logic        rd_wait_i,
  input logic [15:0] rd_data_i,
  input logic        tlm_start_i
);

  logic rst_ni;
  initial rst_ni = 1'b0;
  always @(posedge clk_i) rst_ni <= 1'b1;

  tc_types_pkg::command_t cmd;
  logic tx, de, tlm_tx, cmd_valid, stop, good, rsp_busy, tlm_busy;

  // A read waits once for a commit and once for a gain that ATUNE writes: the next one takes a division.
  logic       rd_rsp, rd_wait;
  logic [1:0] waits_q;
  assign rd_wait = rd_wait_i && waits_q != 2'd2;
  always @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) waits_q <= 2'd0;
    else if (rd_rsp) waits_q <= rd_wait ? waits_q + 2'd1 : 2'd0;
  end

  tc_uartc dut (
    .clk_i, .rst_ni, .rx_i,
    .tx_o(tx), .de_o(de), .tlm_tx_o(tlm_tx),
    .cfg_address_i, .strap_i, .cfg_baud_i, .cfg_format_i, .cfg_pause_i,
    .cmd_valid_o(cmd_valid), .cmd_o(cmd),
    .cmd_word_index_i, .stop_o(stop), .good_o(good),
    .cmd_done_i, .rsp_kind_i, .rsp_exc_i, .rsp_busy_o(rsp_busy),
    .rd_rsp_o(rd_rsp), .rd_wait_i(rd_wait), .rd_data_i, .tlm_start_i, .tlm_busy_o(tlm_busy)
  );

  // An answer is due from cmd_done_i of a command to this slave alone, with a kind that is an answer, until it has been sent.
  logic due_q, tlm_due_q;
  always @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      due_q     <= 1'b0;
      tlm_due_q <= 1'b0;
    end else begin
      due_q     <= (cmd_done_i && cmd_valid && !cmd.broadcast && rsp_kind_i != 3'd0 && rsp_kind_i != 3'd7) ||
                   (due_q && rsp_busy);
      tlm_due_q <= tlm_start_i || (tlm_due_q && tlm_busy);
    end
  end

  `TC_ASSERT_SETUP
  `TC_ASSERT_IF(SilentButForAnAnswer_A, !tx || de || rsp_busy, due_q)
  `TC_ASSERT_IF(SilentButForTelemetry_A, !tlm_tx || tlm_busy, tlm_due_q)
  `TC_ASSERT_IF(NoCommandWhileAnswering_A, rsp_busy, !cmd_valid)
  `TC_ASSERT_IF(GoodRaisesACommand_A, good, cmd_valid)

endmodule

module tc_uart_rx (
  input  logic        clk_i,
  input  logic        rst_ni,
  input  logic [12:0] baud_i,
  input  logic [1:0]  format_i,
  input  logic        pause_i,
  input  logic        rx_i,
  output logic        valid_o,
  output logic [7:0]  data_o,
  output logic        error_o,
  output logic        gap_o,
  output logic        give_up_o,
  output logic        idle_o
);
  (* anyseq *) logic [12:0] any;
  assign {valid_o, data_o, error_o, gap_o, give_up_o, idle_o} = any;
endmodule
