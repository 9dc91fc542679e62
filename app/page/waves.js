// SPDX-License-Identifier: Apache-2.0
// Levels of the pins around a moment.
"use strict";

class Waves {
  constructor(canvas, pins) {
    this.canvas = canvas;
    this.pins = pins.map(([name, first, width]) => ({ name, first, width }));
    this.changes = [];
    this.begin = 0;
    this.width = 0.02;
  }

  level(levels, pin) { return Math.floor(levels / 2 ** pin.first) % 2 ** pin.width; }

  // `changes`: [clock, levels], the first one at or before `begin`.
  show(changes, clockHz, begin, width) {
    Object.assign(this, { changes: changes.map(([clock, levels]) => [clock / clockHz, levels]), begin, width });
    this.draw();
  }

  draw() {
    const scale = window.devicePixelRatio || 1, { canvas } = this;
    const wide = canvas.clientWidth, high = canvas.clientHeight;
    canvas.width = wide * scale;
    canvas.height = high * scale;
    const pen = canvas.getContext("2d");
    pen.scale(scale, scale);
    const color = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    const left = 104, below = 26, row = (high - below) / this.pins.length;
    const x = time => left + (time - this.begin) / this.width * (wide - left - 8);
    pen.font = "12px system-ui, sans-serif";
    pen.textBaseline = "middle";
    this.drawTime(pen, { x, left, wide, bottom: high - below, color });
    if (this.changes.length === 0) return;
    const known = Math.max(this.begin, this.changes[0][0]);
    this.pins.forEach((pin, i) => {
      const middle = row * (i + 0.5);
      pen.fillStyle = color("--text");
      pen.textAlign = "left";
      pen.fillText(pin.name, 0, middle);
      pen.strokeStyle = color(pin.name.endsWith("_i") || pin.name.endsWith("_ni") ? "--duty" : "--reading");
      pen.lineWidth = 1.2;
      const y = level => middle + row * 0.28 * (level ? -1 : 1);
      pen.beginPath();
      let level = this.level(this.changes[0][1], pin);
      pen.moveTo(x(known), y(level));
      for (const [time, levels] of this.changes) {
        const next = this.level(levels, pin);
        if (next === level || time < this.begin) { level = next; continue; }
        pen.lineTo(x(time), y(level));
        pen.lineTo(x(time), y(next));
        level = next;
      }
      pen.lineTo(x(Math.min(this.begin + this.width, this.known ?? Infinity)), y(level));
      pen.stroke();
    });
  }

  drawTime(pen, { x, left, wide, bottom, color }) {
    const rough = this.width / 8, power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map(f => f * power).find(s => s >= rough);
    const digits = Math.max(1, -Math.floor(Math.log10(step)));
    pen.strokeStyle = color("--grid");
    pen.fillStyle = color("--muted");
    pen.textAlign = "center";
    for (let i = Math.ceil(this.begin / step); i * step <= this.begin + this.width; ++i) {
      const at = x(i * step);
      pen.beginPath();
      pen.moveTo(at, 0);
      pen.lineTo(at, bottom);
      pen.stroke();
      if (at > left + 20 && at < wide - 30) pen.fillText(`${(i * step).toFixed(digits)} s`, at, bottom + 14);
    }
  }
}
