// SPDX-License-Identifier: Apache-2.0
// Temperatures and duty over time, of any stretch of the run.
"use strict";

const columns = { time: 0, setpoint: 1, reading: 2, block: 3, heater: 4, duty: 5, state: 6, faults: 7 };
const curves = [
  { name: "reading", column: columns.reading, color: "--reading", width: 2 },
  { name: "set-point", column: columns.setpoint, color: "--setpoint", width: 1.5, dash: [6, 4] },
  { name: "block", column: columns.block, color: "--path", width: 1.5 },
  { name: "heater", column: columns.heater, color: "--heater", width: 1.5 },
  { name: "duty", column: columns.duty, color: "--duty", width: 1, axis: "duty", fill: "--duty-fill" },
];
const longestFollowed_s = 600;
const mostPoints = 700;  // a curve, of which each holds the least and the largest value of its stretch

// Least and largest of a column in each of so many stretches of rows, and a gap in it, in the order of time.
function thinned(rows, first, last, column) {
  const points = [];
  const step = Math.max(1, Math.ceil((last - first) / mostPoints));
  for (let begin = first; begin < last; begin += step) {
    let low = begin, high = begin, gap = null;
    for (let i = begin; i < Math.min(last, begin + step); ++i) {
      const value = rows.data[i * rows.width + column];
      if (Number.isNaN(value)) gap = i;
      if (!(value >= rows.data[low * rows.width + column])) low = i;
      if (!(value <= rows.data[high * rows.width + column])) high = i;
    }
    const kept = new Set(gap === null ? [low, high] : [low, high, gap]);
    for (const i of Array.from(kept).sort((a, b) => a - b))
      points.push({ x: rows.data[i * rows.width], y: rows.data[i * rows.width + column] });
  }
  return points;
}

class TemperatureChart {
  // Of these `curves`; `picked` is called with the time of a click.
  constructor(canvas, curves, picked) {
    this.curves = curves;
    const color = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    const axis = (position, title, grid) => ({
      position, title: { display: true, text: title, color: color("--muted") }, ticks: { color: color("--muted") },
      grid: { color: color("--grid"), drawOnChartArea: grid } });
    this.follow = true;
    this.span = this.end = 60;
    this.chart = new Chart(canvas, {
      type: "line",
      data: { datasets: curves.map(c => ({
        label: c.name, data: [], borderColor: color(c.color), borderWidth: c.width, borderDash: c.dash || [], pointRadius: 0,
        yAxisID: c.axis || "temperature", fill: c.fill ? "origin" : false, backgroundColor: color(c.fill || c.color), stepped: c.name === "duty" })) },
      options: {
        animation: false, parsing: false, normalized: true, maintainAspectRatio: false, events: ["mousemove", "mouseout", "click"],
        interaction: { mode: "index", intersect: false, axis: "x" },
        plugins: { legend: { labels: { color: color("--text"), boxHeight: 1 } },
                   tooltip: { callbacks: { title: items => items.length ? `${items[0].parsed.x.toFixed(1)} s` : "" } } },
        scales: { x: { type: "linear", ...axis("bottom", "s", true) },
                  temperature: { ...axis("left", "°C", true), grace: "5%" },
                  duty: { ...axis("right", "duty, %", false), min: 0, max: 100 } },
      },
    });
    this.listen(canvas, picked);
  }

  listen(canvas, picked) {
    const timeAt = event => this.chart.scales.x.getValueForPixel(event.offsetX);
    let held = null, moved = false;
    canvas.addEventListener("wheel", event => {
      event.preventDefault();
      const at = timeAt(event), factor = Math.exp(event.deltaY * 0.002);
      this.show(at - (at - (this.end - this.span)) * factor, this.span * factor);
    }, { passive: false });
    canvas.addEventListener("pointerdown", event => { held = timeAt(event); moved = false; });
    canvas.addEventListener("pointermove", event => {
      if (held === null || event.buttons === 0) return;
      const by = held - timeAt(event);
      if (Math.abs(by) < this.span * 0.004) return;
      moved = true;
      this.show(this.end - this.span + by, this.span);
    });
    canvas.addEventListener("pointerup", event => {
      if (held !== null && !moved) picked(Math.max(0, timeAt(event)));
      held = null;
    });
    canvas.addEventListener("keydown", event => {
      const by = { ArrowLeft: -0.2, ArrowRight: 0.2 }[event.key], factor = { "+": 0.7, "-": 1.4 }[event.key];
      if (by) this.show(this.end - this.span + by * this.span, this.span);
      if (factor) this.show(this.end - this.span, this.span * factor);
    });
  }

  show(begin, span) {
    this.follow = false;
    this.span = Math.min(Math.max(span, 1), 1e6);
    this.end = Math.max(begin, 0) + this.span;
    this.stale = true;
  }

  // Following the run shows all of it up to ten minutes, then the last ten.
  draw(rows, now) {
    if (this.follow) {
      this.span = Math.min(Math.max(now, 60), longestFollowed_s);
      this.end = Math.max(now, this.span);
    } else if (!this.stale && this.drawnCount === rows.count) {
      return;
    }
    const begin = this.end - this.span;
    const rowAt = time => {
      let low = 0, high = rows.count;
      while (low < high) {
        const middle = (low + high) >> 1;
        if (rows.data[middle * rows.width] < time) low = middle + 1; else high = middle;
      }
      return low;
    };
    const first = Math.max(0, rowAt(begin) - 1), last = Math.min(rows.count, rowAt(this.end) + 1);
    this.curves.forEach((c, i) => { this.chart.data.datasets[i].data = thinned(rows, first, last, c.column); });
    this.chart.options.scales.x.min = begin;
    this.chart.options.scales.x.max = this.end;
    this.chart.update("none");
    this.stale = false;
    this.drawnCount = rows.count;
  }
}
