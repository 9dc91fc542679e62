// SPDX-License-Identifier: Apache-2.0
// A small pulse generator: a synchronised reset, a state machine, a counter with a preset part.
module machine(input clk_i, input rst_ni, input start_i, input stop_i, input [3:0] width_i, output pulse_o, output busy_o,
               output reg parity_o);
  reg [1:0] rst_q;
  always @(posedge clk_i or negedge rst_ni)
    if (!rst_ni) rst_q <= 2'b00; else rst_q <= {rst_q[0], 1'b1};
  wire rst_n = rst_q[1];
  reg [1:0] state_q;
  reg [3:0] count_q;
  reg [2:0] idle_q;
  always @(posedge clk_i or negedge rst_n)
    if (!rst_n) begin
      state_q <= 2'b00;
      count_q <= 4'd0;
      idle_q <= 3'b111;
      parity_o <= 1'b0;
    end else begin
      parity_o <= ^{count_q, state_q, idle_q};
      case (state_q)
        2'b00: begin
          idle_q <= {idle_q[1:0], start_i};
          if (start_i) begin state_q <= 2'b01; count_q <= width_i; end
        end
        2'b01: begin
          if (stop_i) state_q <= 2'b10;
          else if (count_q == 4'd0) state_q <= 2'b10;
          else count_q <= count_q - 4'd1;
        end
        2'b10: state_q <= start_i ? 2'b10 : 2'b00;
        default: state_q <= 2'b00;
      endcase
    end
  assign pulse_o = state_q == 2'b01;
  assign busy_o = state_q != 2'b00;
endmodule
