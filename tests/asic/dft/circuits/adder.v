// SPDX-License-Identifier: Apache-2.0
module adder(input [3:0] a, input [3:0] b, input c, output [4:0] sum);
  assign sum = a + b + c;
endmodule
