// SPDX-License-Identifier: Apache-2.0
// SENSC, the sensor interface: an SPI master that reads one frame as a description in parameters says and turns its
// temperature field into 1/64 degC.
//
// Contract
// - start_i while idle begins a read; done_o pulses once at its end and reading_o holds till the next one. A start
//   while busy_o is ignored. The description must be stable while busy_o (it is: parameters change at control ticks);
//   frame length, SPI mode and chip select stay sound even if it is not.
// - Half a period of SCLK is spi_div_i + 1 clocks, 3 at least. Chip select falls half a period before the first edge,
//   rises half a period after the last, and is high for 4 half periods before every frame; SCLK changes its idle level
//   only there.
// - miso_i is the pin two clocks ago: it is taken in the last clock of the half period after the sampling edge.
// - The set-up word goes out as a 16-bit frame of its own before the read: the first one after reset, after reconfig_i,
//   and after any bad frame.
// - pv = sat((floor(field x scale / 256) + offset + trim)): rounding is toward minus infinity.

`include "tc_assert.svh"

module tc_sensc (
  input  logic             clk_i,
  input  logic             rst_ni,
  input  logic             start_i,
  input  logic             reconfig_i,
  input  logic [2:0]       type_i,          // sensor preset, 0 = custom_i
  input  tc_pkg::sensor_t  custom_i,
  input  logic [7:0]       spi_div_i,
  input  logic [15:0]      trim_i,          // 1/64 degC, signed
  input  logic             miso_i,
  output logic             sclk_o,
  output logic             cs_no,
  output logic             mosi_o,
  output logic             busy_o,
  output logic             done_o,
`ifndef SYNTHESIS
  output logic [14:0]      clocks_o,        // since the read began, 0: none; for assertions
`endif
  output tc_types_pkg::reading_t reading_o
);

  // Distance 2: any other code is an upset and falls to Idle.
  typedef enum logic [3:0] {
    StIdle  = 4'b0000,
    StGap   = 4'b0011,   // chip select high before a frame
    StLead  = 4'b0101,   // chip select low, before the first edge
    StShift = 4'b0110,   // between the edges and after the last
    StJudge = 4'b1001    // frame complete
  } state_e;

  // chip-select high time of the slowest part in the presets, MAX31855 at 5 MHz
  localparam logic [6:0] GapHalves = 7'd4;
  localparam logic [6:0] SetupEdges = 7'd32;  // 16-bit set-up word

  state_e      state_q;
  logic [1:0]  mode_q;            // SPI mode {CPOL, CPHA} of the frame
  logic        setup_q;           // the frame is the set-up word
  logic        setup_due_q;       // the next read sends it first
  logic [7:0]  half_q;            // clock in the half period
  logic [6:0]  left_q;            // half periods (Gap) or edges (Lead, Shift) left
  logic        sclk_q, cs_nq;     // the pins
  logic [16:0] tx_q;              // bit 16 is on the MOSI pin
  logic [31:0] rx_q;              // bits received, the last one lowest
  logic        zero_seen_q;       // the frame held a 0
  logic        all_zero_q;        // the last frame was all zeros
  logic signed [32:0] acc_q;      // field x scale, 1/16384 degC
  // The result, until the next one.
  logic [15:0] pv_q;
  logic [31:0] raw_q;
  logic        done_q, dev_fault_q, frame_bad_q;

  // ---- description
  tc_pkg::sensor_t sens;
  logic [5:0] stated_length, length;
  logic [4:0] stated_width, width;
  logic [1:0] spi_mode;               // CPOL, CPHA
  logic [7:0] first_sent;
  logic [5:0] field_low, field_end;   // the field is bits field_end-1 .. field_low
  logic [7:0] half_last;

  assign sens = (type_i == 3'd0) ? custom_i : tc_pkg::sensor_preset(type_i);
  assign stated_length = sens.frame[tc_pkg::SensFrameLength +: tc_pkg::SensFrameLengthWidth];
  assign stated_width = sens.data[tc_pkg::SensDataBits +: tc_pkg::SensDataBitsWidth];
  assign spi_mode = sens.frame[tc_pkg::SensFrameSpiMode +: tc_pkg::SensFrameSpiModeWidth];
  assign first_sent = sens.data[tc_pkg::SensDataFirstSent +: tc_pkg::SensDataFirstSentWidth];
  assign length = (stated_length == 6'd0 || stated_length > 6'd32) ? 6'd32 : stated_length;
  assign width = (stated_width == 5'd0 || stated_width > 5'd16) ? 5'd16 : stated_width;
  assign field_low = {1'b0, sens.frame[tc_pkg::SensFrameLow +: tc_pkg::SensFrameLowWidth]};
  assign field_end = field_low + {1'b0, width};
  assign half_last = (spi_div_i < 8'd2) ? 8'd2 : spi_div_i;

  logic unused_sens;
  assign unused_sens = ^{sens.frame, sens.data};  // bits between the fields

  // ---- bit timing
  logic half_end, sampling, edge_now;
  logic [6:0] left_next;

  assign half_end = half_q >= half_last;
  assign left_next = left_q - 7'd1;
  // An odd number of edges left: the last one was a leading edge.
  assign sampling = (state_q == StShift) && half_end && (left_q[0] != mode_q[0]);
  assign edge_now = (state_q == StLead || (state_q == StShift && left_q != 7'd0)) && half_end;

  // ---- the arriving bit in the field
  logic [5:0] bit_place;               // 0 is the last bit of the frame
  logic       in_field, sign_bit;
  logic signed [32:0] acc_twice, scale;
  assign bit_place = left_q[6:1];
  assign in_field = bit_place >= field_low && bit_place < field_end;
  assign sign_bit = sens.frame[tc_pkg::SensFrameSigned] && (bit_place + 6'd1 == field_end);
  assign acc_twice = {acc_q[31:0], 1'b0};
  assign scale = $signed({17'd0, sens.scale});

  // ---- the complete frame
  logic mismatch, all_zero, frame_bad, dev_fault;
  logic signed [39:0] pv_sum;
  assign mismatch = ((rx_q ^ sens.check_value) & sens.check_mask) != 32'd0;
  assign all_zero = rx_q == 32'd0;
  assign frame_bad = mismatch || !zero_seen_q || (all_zero && all_zero_q);
  assign dev_fault = (rx_q[15:0] & sens.fault_mask) != 16'd0;
  assign pv_sum = 40'($signed(acc_q[32:8])) + 40'($signed(sens.offset)) + 40'($signed(trim_i));

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      state_q <= StIdle;
      mode_q <= 2'd0;
      setup_q <= 1'b0;
      setup_due_q <= 1'b1;
      half_q <= 8'd0;
      left_q <= 7'd0;
      sclk_q <= 1'b0;
      cs_nq <= 1'b1;
      tx_q <= 17'd0;
      rx_q <= 32'd0;
      zero_seen_q <= 1'b0;
      all_zero_q <= 1'b0;
      acc_q <= 33'sd0;
      pv_q <= 16'd0;
      raw_q <= 32'd0;
      done_q <= 1'b0;
      dev_fault_q <= 1'b0;
      frame_bad_q <= 1'b0;
    end else begin
      done_q <= 1'b0;
      half_q <= half_end ? 8'd0 : half_q + 8'd1;
      if (reconfig_i) setup_due_q <= 1'b1;

      if (sampling) begin
        rx_q <= {rx_q[30:0], miso_i};
        if (!miso_i) zero_seen_q <= 1'b1;
        if (in_field) acc_q <= !miso_i ? acc_twice : sign_bit ? acc_twice - scale : acc_twice + scale;
      end

      if (edge_now) begin
        left_q <= left_next;
        sclk_q <= mode_q[1] ^ left_next[0];
        if (left_next[0] == mode_q[0]) tx_q <= {tx_q[15:0], 1'b0};
      end

      unique case (state_q)
        StIdle: begin
          half_q <= 8'd0;
          mode_q <= spi_mode;
          sclk_q <= spi_mode[1];
          if (start_i) begin
            state_q <= StGap;
            left_q <= GapHalves;
            setup_q <= setup_due_q && sens.setup != 16'd0;
            setup_due_q <= reconfig_i;
          end
        end

        StGap: begin
          if (half_end) begin
            left_q <= left_next;
            if (left_q <= 7'd1) begin
              state_q <= StLead;
              cs_nq <= 1'b0;
              left_q <= setup_q ? SetupEdges : {length, 1'b0};
              // Without CPHA the first bit is there before the first edge, with it only at that edge.
              if (setup_q) tx_q <= mode_q[0] ? {1'b0, sens.setup} : {sens.setup, 1'b0};
              else tx_q <= mode_q[0] ? {1'b0, first_sent, 8'd0} : {first_sent, 9'd0};
              rx_q <= 32'd0;
              zero_seen_q <= 1'b0;
              acc_q <= 33'sd0;
            end
          end
        end

        StLead: begin
          if (half_end) state_q <= StShift;
        end

        StShift: begin
          if (half_end && left_q == 7'd0) begin
            cs_nq <= 1'b1;
            tx_q <= 17'd0;
            setup_q <= 1'b0;
            left_q <= GapHalves;
            state_q <= setup_q ? StGap : StJudge;
          end
        end

        StJudge: begin
          state_q <= StIdle;
          done_q <= 1'b1;
          pv_q <= tc_math_pkg::sat_s16(pv_sum);
          raw_q <= rx_q;
          dev_fault_q <= dev_fault;
          frame_bad_q <= frame_bad;
          all_zero_q <= all_zero;
          if (dev_fault || frame_bad) setup_due_q <= 1'b1;
        end

        default: begin
          state_q <= StIdle;
          cs_nq <= 1'b1;
          sclk_q <= mode_q[1];
          tx_q <= 17'd0;
        end
      endcase
    end
  end

  assign sclk_o = sclk_q;
  assign cs_no = cs_nq;
  assign mosi_o = tx_q[16];
  assign busy_o = state_q != StIdle;
  assign done_o = done_q;
  always_comb begin
    reading_o.ok        = !dev_fault_q && !frame_bad_q;
    reading_o.dev_fault = dev_fault_q;
    reading_o.frame_bad = frame_bad_q;
    reading_o.pv        = pv_q;
    reading_o.raw       = raw_q;
  end

  `TC_ASSERT_SETUP
  `TC_ASSERT_IF(SenscDeselectedClockIdles_A, cs_nq, sclk_q == mode_q[1])
  `TC_ASSERT_IF(SenscDeselectedSendsNothing_A, cs_nq, !mosi_o)
  `TC_ASSERT_IF(SenscDoneIsIdle_A, done_q, !busy_o)
  // P5: a frame is judged in the clock after chip select has risen, and its sample handed over in the next.
  `TC_ASSERT_NEXT(P05_SampleIsPrompt_A, state_q == StJudge, done_q)
`ifndef SYNTHESIS
  // P15: a read ends within 106 half periods of 256 clocks, the start and the judging.
  localparam logic [14:0] LongestRead = 15'd27138;
  logic [14:0] read_clocks;                       // clocks since the read began
  logic        resumed_q;                         // set by a bench that loads flops
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      resumed_q   <= 1'b0;
      read_clocks <= 15'd0;
    end else begin
      resumed_q   <= 1'b0;
      read_clocks <= start_i && state_q == StIdle ? 15'd1
                   : done_q || resumed_q || read_clocks == 15'd0 ? 15'd0 : read_clocks + 15'(read_clocks != 15'h7FFF);
    end
  end
  assign clocks_o = read_clocks;
  `TC_ASSERT_IF(P15_ReadEnds_A, read_clocks != 15'd0, read_clocks <= LongestRead)
`endif
  `TC_COVER(SenscSetUp_C, setup_q && state_q == StShift)
  `TC_COVER(SenscBadFrame_C, done_q && frame_bad_q)

`ifdef FORMAL
  // What holds in every clock; together the induction hypothesis of the proofs in tests/proofs/formal/sensc.
  // The clocks that a read still takes at most: it falls in every clock, so every read ends.
  logic [7:0]  halves_left;
  logic [14:0] clocks_left, clocks_left_q;
  logic        busy_past_q, sclk_past_q;
  always_comb begin
    unique case (state_q)
      StGap: halves_left = {1'b0, left_q} + (setup_q ? 8'd102 : 8'd65);
      StLead, StShift: halves_left = {1'b0, left_q} + (setup_q ? 8'd70 : 8'd1);
      default: halves_left = 8'd0;
    endcase
    clocks_left = (state_q == StIdle) ? 15'd0 :
                  (state_q == StJudge) ? 15'd1 : {halves_left[6:0], 8'd0} - {7'd0, half_q} + 15'd1;
  end
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      clocks_left_q <= 15'd0;
      busy_past_q <= 1'b0;
      sclk_past_q <= 1'b0;
    end else begin
      clocks_left_q <= clocks_left;
      busy_past_q <= busy_o;
      sclk_past_q <= sclk_q;
    end
  end

  `TC_ASSERT(SenscStateLegal_A, state_q == StIdle || state_q == StGap || state_q == StLead || state_q == StShift ||
             state_q == StJudge)
  `TC_ASSERT(SenscReading_A, (read_clocks == 15'd0) == (state_q == StIdle && !done_q) &&
             {1'b0, read_clocks} + {1'b0, clocks_left} <= {1'b0, LongestRead})
  `TC_ASSERT_IF(SenscReadEnds_A, busy_past_q, clocks_left < clocks_left_q)
  `TC_ASSERT_NEXT(SenscClockMovesAtHalfPeriods_A, state_q != StIdle && !half_end, sclk_q == sclk_past_q)
  `TC_ASSERT(SenscReadBounded_A, clocks_left < LongestRead)
  `TC_ASSERT(SenscSelect_A, cs_nq == (state_q != StLead && state_q != StShift))
  `TC_ASSERT_IF(SenscLeadIdles_A, state_q == StLead, sclk_q == mode_q[1] && left_q != 7'd0 && !left_q[0])
  `TC_ASSERT_IF(SenscClockPhase_A, state_q == StShift, sclk_q == (mode_q[1] ^ left_q[0]))
  `TC_ASSERT_IF(SenscGapCounts_A, state_q == StGap, left_q >= 7'd1 && left_q <= GapHalves)
  `TC_ASSERT(SenscEdgesBounded_A, left_q <= 7'd64 && (!setup_q || left_q <= SetupEdges))
  `TC_ASSERT_IF(SenscNoSetUpLeft_A, state_q == StJudge || state_q == StIdle, !setup_q)
  `TC_ASSERT_IF(SenscDeselectedTxClear_A, cs_nq, tx_q == 17'd0)
`endif

endmodule
