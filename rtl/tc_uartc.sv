// SPDX-License-Identifier: Apache-2.0
// UARTC: serial port of the host. Modbus RTU slave on rx_i/tx_o (de_o drives an RS-485 transceiver), telemetry on
// tlm_tx_o.
//
// It frames, checks and answers; what a register means is PARAMC's. A valid frame to this slave raises cmd_valid_o
// until cmd_done_i, whose answer descriptor starts the answer at once: with its lead the 3.5 characters of silence are
// over by then. Broadcasts are never answered, whatever the descriptor says. Register words are read through
// rd_addr_o/rd_data_i, the answer before telemetry. Address, baud rate and format are taken over only while nothing is
// received, waiting or sent.
`include "tc_assert.svh"

module tc_uartc (
  input  logic        clk_i,
  input  logic        rst_ni,
  // Lines; rx_i and strap_i have passed their synchronisers.
  input  logic        rx_i,
  output logic        tx_o,
  output logic        de_o,
  output logic        tlm_tx_o,
  // Parameters.
  input  logic [7:0]  cfg_address_i,     // 0: 1 + strap_i
  input  logic [2:0]  strap_i,
  input  logic [12:0] cfg_baud_i,        // baud rate / 100
  input  logic [1:0]  cfg_format_i,
  input  logic        cfg_pause_i,       // the host may pause inside a frame
  // Received command.
  output logic        cmd_valid_o,
  output tc_types_pkg::command_t cmd_o,
  input  logic [3:0]  cmd_word_index_i,
  output logic [15:0] cmd_word_o,        // read port: follows cmd_word_index_i in the same clock
  output logic        stop_o,            // STOP received
  output logic        good_o,            // a frame accepted
  // Answer.
  input  logic        cmd_done_i,
  input  logic [2:0]  rsp_kind_i,
  input  logic [7:0]  rsp_exc_i,         // exception code; with RspServerId the run indicator, FF on, 00 off
  output logic        rsp_busy_o,
  // Register read port: rd_data_i follows rd_addr_o in the same clock; a holding register's only in a clock of rd_rsp_o
  // without rd_wait_i.
  output logic [15:0] rd_addr_o,
  output logic        rd_rsp_o,          // an answer reads; telemetry reads no holding registers
  input  logic        rd_wait_i,
  input  logic [15:0] rd_data_i,
  // Telemetry.
  input  logic        tlm_start_i,
  output logic        tlm_busy_o,
  output tc_types_pkg::line_counters_t counters_o
);

  localparam logic [7:0] Conformity    = 8'h81;    // basic identification, stream and single objects
  localparam logic [1:0] LastObject    = 2'(tc_pkg::IdentObjects - 1);

  // Places of bytes in the answers.
  localparam logic [7:0] FirstData  = 8'd3;        // first register byte
  localparam logic [7:0] ServerText = 8'd5;
  localparam logic [7:0] ObjectId   = 8'd8;
  localparam logic [7:0] ObjectText = 8'd10;

  localparam logic [7:0] TelemetryBytes = {1'b0, tc_pkg::TelemetryWords, 1'b0};
  localparam logic [5:0] TelemetryLast  = FirstData[5:0] + TelemetryBytes[5:0] - 6'd1;

  // What the lines go by; taken over from the parameters while nothing moves.
  logic [12:0] baud_q;
  logic [1:0]  format_q;
  logic        pause_q;
  logic [7:0]  address_q;

  // The answer.
  logic        rsp_active_q;    // bytes of it are still to be handed to the transmitter
  logic [2:0]  rsp_kind_q;      // tc_pkg::Rsp*
  logic [7:0]  rsp_exc_q;
  logic [7:0]  rsp_place_q;     // byte that comes next; counts from ObjectId again for each object
  logic [1:0]  rsp_object_q;
  logic        rsp_have_q;      // rsp_word_q holds the register that comes next
  logic [15:0] rsp_word_q;

  // The telemetry frame, likewise.
  logic        tlm_active_q;
  logic [5:0]  tlm_place_q;
  logic        tlm_have_q;
  logic [15:0] tlm_word_q;

  logic [15:0] rd_addr_q;       // register being read
  logic        rd_rsp_q;        // rd_addr_q stands for the answer
  logic        rd_tlm_q;        // ... for telemetry

  // ---- Receiver and framing -----------------------------------------------------------------------------------------

  logic       rx_valid, rx_error, rx_gap, rx_give_up, rx_idle, frame_open;
  logic [7:0] rx_data;

  tc_uart_rx u_rx (
    .clk_i, .rst_ni,
    .baud_i     (baud_q),
    .format_i   (format_q),
    .pause_i    (pause_q),
    .rx_i,
    .valid_o    (rx_valid),
    .data_o     (rx_data),
    .error_o    (rx_error),
    .gap_o      (rx_gap),
    .give_up_o  (rx_give_up),
    .idle_o     (rx_idle)
  );

  tc_uart_frame u_frame (
    .clk_i, .rst_ni,
    .address_i  (address_q),
    .valid_i    (rx_valid),
    .data_i     (rx_data),
    .error_i    (rx_error),
    .gap_i      (rx_gap),
    .give_up_i  (rx_give_up),
    .busy_i     (rsp_busy_o),
    .cmd_done_i,
    .open_o     (frame_open),
    .cmd_valid_o, .cmd_o,
    .cmd_word_index_i, .cmd_word_o,
    .stop_o, .good_o,
    .counters_o
  );

  // ---- Configuration ------------------------------------------------------------------------------------------------

  logic idle;
  assign idle = rx_idle && !frame_open && !cmd_valid_o && !rsp_busy_o && !tlm_busy_o;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      baud_q    <= 13'(tc_pkg::reg_reset(tc_pkg::RegBaud));
      format_q  <= 2'(tc_pkg::reg_reset(tc_pkg::RegFormat));
      pause_q   <= 1'b0;
      address_q <= 8'd1;
    end else if (idle) begin
      baud_q    <= cfg_baud_i;
      format_q  <= cfg_format_i;
      pause_q   <= cfg_pause_i;
      address_q <= cfg_address_i != 8'd0 ? cfg_address_i : 8'd1 + {5'd0, strap_i};
    end
  end

  // ---- Answer -------------------------------------------------------------------------------------------------------

  logic       rsp_ident, rsp_reading, rsp_ready, rsp_last, rsp_object_end, rsp_take, rsp_sending;
  logic [7:0] rsp_byte;
  logic [7:0] read_bytes, object_text, object_end;
  assign rsp_ident   = rsp_kind_q == tc_pkg::RspIdStream || rsp_kind_q == tc_pkg::RspIdObject;
  assign rsp_reading = rsp_kind_q == tc_pkg::RspRead && rsp_place_q >= FirstData;
  assign rsp_ready   = rsp_active_q && (!rsp_reading || rsp_have_q);
  assign read_bytes  = {1'b0, cmd_o.b[5:0], 1'b0};
  assign object_end  = ObjectText - 8'd1 + tc_pkg::ident_length(rsp_object_q);
  assign object_text = tc_pkg::ident_byte(tc_pkg::ident_start(rsp_object_q) + rsp_place_q - ObjectText);
  assign rsp_object_end = rsp_ident && rsp_place_q == object_end;

  always_comb begin
    unique case (rsp_kind_q)
      tc_pkg::RspException: rsp_last = rsp_place_q == 8'd2;
      tc_pkg::RspRead:      rsp_last = rsp_place_q == FirstData - 8'd1 + read_bytes;
      tc_pkg::RspEcho:      rsp_last = rsp_place_q == 8'd5;
      tc_pkg::RspServerId:  rsp_last = rsp_place_q == ServerText - 8'd1 + tc_pkg::IdentServerLength;
      tc_pkg::RspIdStream:  rsp_last = rsp_object_end && rsp_object_q == LastObject;
      default:              rsp_last = rsp_object_end;
    endcase
  end

  always_comb begin
    rsp_byte = 8'd0;
    if (rsp_place_q == 8'd0) rsp_byte = address_q;
    else if (rsp_place_q == 8'd1) begin
      rsp_byte = rsp_kind_q == tc_pkg::RspException ? cmd_o.fc | tc_pkg::ExceptionFlag : cmd_o.fc;
    end else begin
      unique case (rsp_kind_q)
        tc_pkg::RspException: rsp_byte = rsp_exc_q;
        tc_pkg::RspRead: begin
          if (!rsp_reading) rsp_byte = read_bytes;
          else rsp_byte = rsp_place_q[0] ? rsp_word_q[15:8] : rsp_word_q[7:0];
        end
        tc_pkg::RspEcho: begin
          unique case (rsp_place_q[1:0])
            2'd2:    rsp_byte = cmd_o.a[15:8];
            2'd3:    rsp_byte = cmd_o.a[7:0];
            2'd0:    rsp_byte = cmd_o.b[15:8];
            default: rsp_byte = cmd_o.b[7:0];
          endcase
        end
        tc_pkg::RspServerId: begin
          unique case (rsp_place_q)
            8'd2:    rsp_byte = tc_pkg::IdentServerLength + 8'd2;
            8'd3:    rsp_byte = tc_pkg::DeviceId[15:8];
            8'd4:    rsp_byte = rsp_exc_q;
            default: rsp_byte = tc_pkg::ident_byte(tc_pkg::IdentServerStart + rsp_place_q - ServerText);
          endcase
        end
        default: begin
          unique case (rsp_place_q)
            8'd2:    rsp_byte = cmd_o.a[15:8];  // MEI type
            8'd3:    rsp_byte = cmd_o.a[7:0];   // code of the request
            8'd4:    rsp_byte = Conformity;
            8'd5:    rsp_byte = 8'd0;           // nothing follows
            8'd6:    rsp_byte = 8'd0;           // so no next object
            8'd7:    rsp_byte = rsp_kind_q == tc_pkg::RspIdStream ? 8'(tc_pkg::IdentObjects) : 8'd1;
            8'd8:    rsp_byte = {6'd0, rsp_object_q};
            8'd9:    rsp_byte = tc_pkg::ident_length(rsp_object_q);
            default: rsp_byte = object_text;
          endcase
        end
      endcase
    end
  end

  logic answered;
  assign answered = cmd_done_i && cmd_valid_o && !cmd_o.broadcast && rsp_kind_i >= tc_pkg::RspException &&
                    rsp_kind_i <= tc_pkg::RspIdObject;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      rsp_active_q <= 1'b0;
      rsp_kind_q   <= tc_pkg::RspNone;
      rsp_exc_q    <= 8'd0;
      rsp_place_q  <= 8'd0;
      rsp_object_q <= 2'd0;
      rsp_have_q   <= 1'b0;
      rsp_word_q   <= 16'd0;
    end else if (answered) begin
      rsp_active_q <= 1'b1;
      rsp_kind_q   <= rsp_kind_i;
      rsp_exc_q    <= rsp_exc_i;
      rsp_place_q  <= 8'd0;
      rsp_object_q <= rsp_kind_i == tc_pkg::RspIdObject ? cmd_o.b[9:8] : 2'd0;
      rsp_have_q   <= 1'b0;
    end else if (rd_rsp_q) begin
      if (!rd_wait_i) begin
        rsp_word_q <= rd_data_i;
        rsp_have_q <= 1'b1;
      end
    end else if (rsp_take) begin
      rsp_place_q <= rsp_place_q + 8'd1;
      if (rsp_last) begin
        rsp_active_q <= 1'b0;
      end else if (rsp_object_end) begin
        rsp_object_q <= rsp_object_q + 2'd1;
        rsp_place_q  <= ObjectId;
      end
      if (!rsp_place_q[0]) rsp_have_q <= 1'b0;
    end
  end

  tc_uart_tx u_tx (
    .clk_i, .rst_ni,
    .baud_i   (baud_q),
    .format_i (format_q),
    .valid_i  (rsp_ready),
    .data_i   (rsp_byte),
    .last_i   (rsp_last),
    .take_o   (rsp_take),
    .busy_o   (rsp_sending),
    .tx_o
  );
  assign de_o       = rsp_sending;
  assign rsp_busy_o = rsp_active_q || rsp_sending;

  // ---- Telemetry ----------------------------------------------------------------------------------------------------

  logic       tlm_reading, tlm_ready, tlm_last, tlm_take, tlm_sending;
  logic [7:0] tlm_byte;
  assign tlm_reading = tlm_place_q >= FirstData[5:0];
  assign tlm_ready   = tlm_active_q && (!tlm_reading || tlm_have_q);
  assign tlm_last    = tlm_place_q == TelemetryLast;

  always_comb begin
    unique case (tlm_place_q)
      6'd0:    tlm_byte = address_q;
      6'd1:    tlm_byte = tc_pkg::FcReadInput;
      6'd2:    tlm_byte = TelemetryBytes;
      default: tlm_byte = tlm_place_q[0] ? tlm_word_q[15:8] : tlm_word_q[7:0];
    endcase
  end

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      tlm_active_q <= 1'b0;
      tlm_place_q  <= 6'd0;
      tlm_have_q   <= 1'b0;
      tlm_word_q   <= 16'd0;
    end else if (tlm_start_i && !tlm_busy_o) begin
      tlm_active_q <= 1'b1;
      tlm_place_q  <= 6'd0;
      tlm_have_q   <= 1'b0;
    end else if (rd_tlm_q) begin
      tlm_word_q <= rd_data_i;
      tlm_have_q <= 1'b1;
    end else if (tlm_take) begin
      tlm_place_q <= tlm_place_q + 6'd1;
      if (tlm_last) tlm_active_q <= 1'b0;
      if (!tlm_place_q[0]) tlm_have_q <= 1'b0;
    end
  end

  tc_uart_tx u_tlm (
    .clk_i, .rst_ni,
    .baud_i   (baud_q),
    .format_i (format_q),
    .valid_i  (tlm_ready),
    .data_i   (tlm_byte),
    .last_i   (tlm_last),
    .take_o   (tlm_take),
    .busy_o   (tlm_sending),
    .tx_o     (tlm_tx_o)
  );
  assign tlm_busy_o = tlm_active_q || tlm_sending;

  // ---- Register read port -------------------------------------------------------------------------------------------

  logic rsp_wants, tlm_wants;
  assign rsp_wants = rsp_active_q && rsp_reading && !rsp_have_q && !rd_rsp_q;
  assign tlm_wants = tlm_active_q && tlm_reading && !tlm_have_q && !rd_tlm_q;

  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      rd_addr_q <= 16'd0;
      rd_rsp_q  <= 1'b0;
      rd_tlm_q  <= 1'b0;
    end else begin
      rd_rsp_q <= rsp_wants;
      rd_tlm_q <= tlm_wants && !rsp_wants;
      if (rsp_wants) rd_addr_q <= cmd_o.a + {9'd0, 7'((rsp_place_q - FirstData) >> 1)};
      else if (tlm_wants) rd_addr_q <= {11'd0, 5'((tlm_place_q - FirstData[5:0]) >> 1)};
    end
  end
  assign rd_addr_o = rd_addr_q;
  assign rd_rsp_o  = rd_rsp_q;

  `TC_ASSERT_SETUP
  `TC_ASSERT(UartcDriverEnabled_A, tx_o || de_o)
  `TC_ASSERT_IF(UartcAnswerKindLegal_A, rsp_active_q,
                rsp_kind_q >= tc_pkg::RspException && rsp_kind_q <= tc_pkg::RspIdObject)
  `TC_ASSERT_NEXT(UartcConfigKept_A, !rx_idle || frame_open || cmd_valid_o || rsp_busy_o || tlm_busy_o,
                  baud_q == $past(baud_q) && format_q == $past(format_q) && pause_q == $past(pause_q) &&
                      address_q == $past(address_q))
  `TC_ASSERT_NEXT(UartcConfigTaken_A, idle,
                  baud_q == $past(cfg_baud_i) && format_q == $past(cfg_format_i) && pause_q == $past(cfg_pause_i))

`ifndef SYNTHESIS
  // P14: a character of the frame in hand, and no gap since.
  logic resumed_q, heard;                   // resumed_q is set by a bench that loads flops
  always_ff @(posedge clk_i or negedge rst_ni) begin
    if (!rst_ni) begin
      resumed_q <= 1'b0;
      heard     <= 1'b0;
    end else begin
      resumed_q <= 1'b0;
      if (rx_valid && !cmd_valid_o && !rsp_busy_o) heard <= 1'b1;
      else if (rx_gap || resumed_q) heard <= 1'b0;
    end
  end
  // P14: from the first to the last clock of an answer a gap lies behind the frame that is answered; the answer's lead
  // follows (P14_LeadIsThreeBits_A in tc_uart_tx).
  `TC_ASSERT_IF(P14_AnswerAfterGap_A, rsp_busy_o, !heard)
`ifdef FORMAL
  `TC_ASSERT_IF(P14_CommandAfterGap_A, cmd_valid_o, !heard)
`endif
`endif

`ifdef FORMAL
  // No answer runs past its last byte.
  logic [7:0] final_place;
  always_comb begin
    unique case (rsp_kind_q)
      tc_pkg::RspException: final_place = 8'd2;
      tc_pkg::RspRead:      final_place = FirstData - 8'd1 + read_bytes;
      tc_pkg::RspEcho:      final_place = 8'd5;
      tc_pkg::RspServerId:  final_place = ServerText - 8'd1 + tc_pkg::IdentServerLength;
      default:              final_place = object_end;
    endcase
  end
  `TC_ASSERT_IF(UartcAnswerEnds_A, rsp_active_q, rsp_place_q <= final_place)
  `TC_ASSERT_IF(UartcTelemetryEnds_A, tlm_active_q, tlm_place_q <= TelemetryLast)
`endif

endmodule
