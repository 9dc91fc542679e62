// SPDX-License-Identifier: Apache-2.0
// What the pages share: elements, registers, and knobs for what stands around a virtual chip.
"use strict";

const byId = id => document.getElementById(id);
const typeset = text => text.replace(/\bdegC\b/g, "°C");
const registerMap = JSON.parse(byId("map").textContent).registers;

function element(tag, text = "", className = "") {
  const node = document.createElement(tag);
  node.textContent = text;
  node.className = className;
  return node;
}

const knobs = [
  { label: "Sensor", word: "sensor", choices: { sound: "sound", open: "wire open", to_ground: "short to ground", to_supply: "short to supply",
    frozen: "frozen", silent: "no answer", low: "line stuck low", high: "line stuck high", wrong_bits: "wrong bits" } },
  { label: "Seat of the sensor", word: "seat", range: [0, 1, 0.05], value: 1, unit: "" },
  { label: "Heater", word: "heater", choices: { sound: "sound", open: "element open", shorted: "switch shorted" } },
  { label: "Supply", word: "supply", range: [0, 1.25, 0.05], value: 1, unit: "× nominal" },
  { label: "Fan", word: "fan", range: [0, 0.5, 0.01], value: 0, unit: "W/K" },
  { label: "Ambient", word: "ambient", range: [-20, 60, 1], value: 25, unit: "°C" },
  { label: "Host", word: "host", choices: { on: "polls", off: "silent" } },
  { label: "Clock", word: "clock", choices: { on: "runs", off: "stopped" } },
  { label: "Emergency stop", word: "estop", choices: { off: "released", on: "pressed" } },
  { label: "Reset pin", word: "reset", choices: { off: "high", on: "low" } },
];

// A row each in `list`; `act` is called with the event of a scenario.
function makeKnobs(list, act) {
  for (const knob of knobs) {
    const label = element("label", knob.label);
    const input = document.createElement(knob.choices ? "select" : "input");
    input.id = `knob_${knob.word}`;
    label.htmlFor = input.id;
    const cell = element("div");
    cell.append(input);
    if (knob.choices) {
      for (const [value, text] of Object.entries(knob.choices)) input.add(new Option(text, value));
    } else {
      [input.min, input.max, input.step] = knob.range;
      Object.assign(input, { type: "range", value: knob.value });
      const shown = element("output", `${knob.value} ${knob.unit}`);
      input.addEventListener("input", () => { shown.textContent = `${input.value} ${knob.unit}`; });
      cell.append(shown);
    }
    input.addEventListener("change", () => act(`${knob.word} ${input.value}`));
    list.append(label, cell);
  }
}

// A knob shows what a scenario has set.
function turnKnob(event) {
  const [word, value] = event.split(" ");
  const knob = knobs.find(k => k.word === word);
  if (!knob || value === undefined) return;
  const input = byId(`knob_${word}`);
  input.value = value;
  input.dispatchEvent(new Event("input"));
}
