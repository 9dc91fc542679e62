// SPDX-License-Identifier: Apache-2.0
// What one block hands to others in one piece. Parameters (params_t), STATUS and sensor descriptions are in tc_pkg, as
// the spec says them. At most 64 bits each, a machine word: Verilator is slow with what is longer.

package tc_types_pkg;

  // UARTC -> PARAMC: a Modbus request; its data words have a read port of their own.
  typedef struct packed {
    logic        broadcast;
    logic [7:0]  fc;                // function code
    logic [15:0] a;                 // bytes 2 and 3: of most functions the first register's address
    logic [15:0] b;                 // bytes 4 and 5: count or value
    logic [7:0]  count;             // byte 6
    logic [8:0]  len;               // bytes, address and CRC included
  } command_t;

  // SENSC -> GUARD, PARAMC: a sensor frame.
  typedef struct packed {
    logic               ok;         // neither of the next two
    logic               dev_fault;  // a fault bit of the frame is set
    logic               frame_bad;  // reserved bits wrong, or a stuck line
    logic signed [15:0] pv;         // Q9.6
    logic [31:0]        raw;        // as it was received
  } reading_t;

  // UARTC -> PARAMC: counters of its line, modulo 65536.
  typedef struct packed {
    logic [15:0] crc_errors;
    logic [15:0] char_errors;
    logic [15:0] messages;
  } line_counters_t;

  // QUALITY -> PARAMC.
  typedef struct packed {
    logic [15:0] overshoot;         // 1/64 degC, as the next
    logic [15:0] band_error;
    logic [15:0] peak;              // Q9.6
    logic [15:0] band_time;         // 0.1 s, 65535 outside
  } quality_t;

  // ATUNE -> PARAMC: AT_STATE, AT_KU, AT_TU.
  typedef struct packed {
    logic [15:0] state;
    logic [15:0] ku;
    logic [15:0] tu;
  } tuned_t;

endpackage
