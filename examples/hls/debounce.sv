// SPDX-License-Identifier: Apache-2.0
// The same as debounce.cpp, by hand.
module debounce (
  input  logic       clk_i,
  input  logic       rst_ni,
  input  logic       button_i,
  input  logic [3:0] hold_i,
  output logic       pressed_o
);

  logic       level_q, pressed_q;
  logic [3:0] steady_q, steady;

  assign steady = button_i != level_q ? 4'd0 : steady_q == 4'd15 ? 4'd15 : steady_q + 4'd1;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      level_q   <= 1'b0;
      steady_q  <= 4'd0;
      pressed_q <= 1'b0;
    end else begin
      level_q  <= button_i;
      steady_q <= steady;
      if (steady > hold_i) pressed_q <= button_i;
    end
  end

  assign pressed_o = pressed_q;

endmodule
