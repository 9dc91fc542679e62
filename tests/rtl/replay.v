// SPDX-License-Identifier: Apache-2.0
// A recording of the model's pins (.mvec) on the netlist. An x or z on an output is a mismatch.
`timescale 1ns / 1ns
module replay;
  reg clk = 0;
  `include "replay_pins.vh"

  reg reset_before = 1;
  integer file, at, next, clocks, mismatches;
  reg [8*1024-1:0] path;
  reg [8*1024-1:0] word;

  // The clocks from `at` on with the pins as they stand, up to the one before `next`.
  task run_to_next;
    while (at < next) begin
      #1;
      // A reset that falls acts at once here, and a cycle later in the recording.
      if (reset_before <= rst_ni && outputs !== recorded) begin
        mismatches = mismatches + 1;
        if (mismatches <= 10) $display("clock %0d: netlist %b, model %b", at, outputs, recorded);
      end
      reset_before = rst_ni;
      clk = 1;
      #1 clk = 0;
      clocks = clocks + 1;
      at = at + 1;
    end
  endtask

  initial begin
    at = 0;
    clocks = 0;
    mismatches = 0;
    if (!$value$plusargs("recording=%s", path)) begin
      $display("replay: expected +recording=FILE");
      $finish;
    end
    file = $fopen(path, "r");
    // The first change is that of cycle 0, behind the pins.
    word = 0;
    while ($fscanf(file, "%s", word) == 1 && word != "0");
    #1;
    while ($fscanf(file, "%s", word) == 1 && word != "end") begin
      if (word[15:8] == "=") take(word >> 16, word[7:0]);
      else if (word[31:8] == "=0x") take(word >> 32, word[7:0]);
      else if ($sscanf(word, "%d", next) == 1) run_to_next;
    end
    if ($fscanf(file, "%d", next) == 1) begin
      next = next + 1;
      run_to_next;
    end
    if (clocks == 0) $display("replay: nothing was compared");
    else $display("%0d clocks, %0d mismatches", clocks, mismatches);
    $finish;
  end
endmodule
