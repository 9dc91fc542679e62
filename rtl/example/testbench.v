// SPDX-License-Identifier: Apache-2.0
// Prints the temperature that the chip in system.v answers. Its first control tick follows the first request, so the first answer has
// none yet; the second comes 108 ms later.
module testbench #(parameter Answers = 2);
  reg clk = 0, rst_n = 0;
  wire heater, answer_valid;
  wire [7:0] answer;
  reg [47:0] last_six = 0;
  integer answers = 0, bytes = 0;
  system u_system (.clk(clk), .rst_n(rst_n), .heater(heater), .answer_valid(answer_valid), .answer(answer));

  always #1 clk = ~clk;
  initial begin
    repeat (10) @(posedge clk);
    rst_n = 1;
    repeat (1_400_000 * Answers) @(posedge clk);
    $display("no answer");
    $finish;
  end

  always @(posedge clk) begin
    if (rst_n && heater !== 1'b0) $display("the heater is not off");
    if (rst_n && answer_valid) begin
      last_six = {last_six[39:0], answer};
      bytes = bytes + 1;
      if (bytes == 7) begin                    // device, function, count, PV (two bytes), CRC (two bytes)
        if (last_six[31:16] == 16'h8000) $display("no sample yet");
        else $display("PV %0d.%0d degC", last_six[31:16] / 10, last_six[31:16] % 10);
        bytes = 0;
        answers = answers + 1;
        if (answers == Answers) $finish;
      end
    end
  end
endmodule
