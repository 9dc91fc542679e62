// SPDX-License-Identifier: Apache-2.0
// The chip on its head (app/page/exports.cpp) as an object: text in, text and numbers out.
"use strict";

function bytesOf(base64) {
  return Uint8Array.from(atob(base64), c => c.charCodeAt(0));
}

async function unpacked(base64) {
  const stream = new Blob([bytesOf(base64)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

class Machine {
  static async load(bytes) {
    // What the C++ library asks of a system: no environment, no files.
    const none = 0, badFile = 8;
    const system = {
      environ_get: () => none,
      environ_sizes_get: (count, size) => {
        const memory = new DataView(machine.calls.memory.buffer);
        memory.setUint32(count, 0, true);
        memory.setUint32(size, 0, true);
        return none;
      },
      fd_close: () => badFile, fd_seek: () => badFile, fd_write: () => badFile,
      proc_exit: () => { throw new Error("the model has ended"); },
    };
    const machine = new Machine();
    const { instance } = await WebAssembly.instantiate(bytes, { wasi_snapshot_preview1: system });
    machine.calls = instance.exports;
    machine.calls._initialize();
    machine.about = machine.json("about");
    return machine;
  }

  put(text) {
    const bytes = new TextEncoder().encode(text);
    const at = this.calls.input(bytes.length);
    new Uint8Array(this.calls.memory.buffer).set(bytes, at);
  }
  text(call, ...values) {
    this.calls[call](...values);
    return this.answer();
  }
  answer() {
    return new TextDecoder().decode(new Uint8Array(this.calls.memory.buffer, this.calls.answer(), this.calls.answer_bytes()));
  }
  json(call, ...values) { return JSON.parse(this.text(call, ...values)); }

  // Both return why not; nothing when it is done.
  open(scenario) {
    this.put(scenario);
    return this.calls.open() ? "" : this.answer();
  }
  act(event) {
    this.put(event);
    return this.calls.act() ? "" : this.answer();
  }
  runUntil(seconds) { this.calls.run_until(seconds); }
  get now() { return this.calls.now(); }

  // A view of the rows as they lie; good until the next call.
  rows() {
    const width = this.calls.row_doubles();
    return { width, count: this.calls.row_count(),
             data: new Float64Array(this.calls.memory.buffer, this.calls.rows(), width * this.calls.row_count()) };
  }
}
