// SPDX-License-Identifier: Apache-2.0
// The page: runs the chip in step with the screen, shows it, and hands on what a person does.
"use strict";

const scenarios = {
  "Heat to 110 °C": "head PH-1;1 set SETPOINT 110;1.2 run",
  "The sensor falls out": "head PH-1;1 set SETPOINT 110;1.2 run;240 seat 0.2",
  "The sensor works loose slowly": "head E3D-like;1 set SETPOINT 110;1.2 run;" +
    [...Array(12).keys()].map(i => `${200 + 3 * i} seat ${(1 - 0.05 * (i + 1)).toFixed(2)}`).join(";"),
  "The switch sticks": "head PH-1;1 set SETPOINT 110;1.2 run;240 heater shorted",
  "The element breaks": "head PH-1;1 set SETPOINT 110;1.2 run;240 heater open",
  "A wire of the sensor breaks": "head PH-1;1 set SETPOINT 110;1.2 run;120 sensor open",
  "The supply sags": "head PH-1;1 set SETPOINT 110;1.2 run;240 supply 0.75",
  "The host falls silent": "head PH-1;1 set SETPOINT 110;1.2 run;120 host off",
  "The clock stops": "head PH-1;1 set SETPOINT 110;1.2 run;60 clock off",
  "Droplets": "head PH-1;1 set SETPOINT 110;1.2 run;300 drops 500 10;360 drops 0 0",
  "Self-tuning": "head PH-1;1 set SETPOINT 110;1.2 tune",
  "A bit flips": "head PH-1;1 set SETPOINT 110;1.2 run;120 flip guard.run_q 0",
};

const frameBudget_ms = 12;  // of each sixtieth of a second
const longestStep_s = 0.5;
const mostLogRows = 400;

class Page {
  constructor(machine) {
    this.machine = machine;
    this.done = "";  // the scenario with all that was done since, as text
    this.logged = 0;
    this.ratio = { time: 0, real: 0 };
    this.chart = new TemperatureChart(byId("temperature"), curves, time => this.showPins(time - this.waves.width / 2));
    this.waves = new Waves(byId("waves"), machine.about.pins);
    this.makeStates();
    this.makeKnobs();
    this.makeRegisters();
    this.makeScenarios();
    this.listen();
  }

  // ---- the run

  // Whether it was understood; if not, the run goes on as it was.
  open(scenario) {
    const problem = this.machine.open(scenario);
    if (problem) {
      this.tell(`The scenario: ${problem}.`);
      return false;
    }
    this.tell("");
    this.done = scenario;
    this.logged = 0;
    byId("log").tBodies[0].replaceChildren();
    for (const knob of knobs) turnKnob(`${knob.word} ${knob.choices ? Object.keys(knob.choices)[0] : knob.value}`);
    this.chart.follow = true;
    this.keepInAddress();
    this.show();
    this.showPins(0);
    return true;
  }

  // The first scenario, where that of the address was refused; what was wrong stays told.
  beginAnew() {
    const told = byId("trouble").textContent;
    this.open(scenarios["Heat to 110 °C"]);
    this.tell(told);
  }

  // Whether it was understood.
  act(event) {
    const problem = this.machine.act(event);
    byId("refused").textContent = problem.replace(/^line 1: /, "");
    if (problem) return false;
    this.done += `\n${this.machine.now} ${event}`;
    this.keepInAddress();
    this.show();
    return true;
  }

  keepInAddress() { history.replaceState(null, "", "#" + encodeURIComponent(this.done)); }

  // The chip as far as the speed says, in the time that a frame leaves.
  frame(real_ms) {
    const speed = Number(byId("speed").value);
    const passed_s = Math.min(0.1, (real_ms - (this.lastFrame ?? real_ms)) / 1e3);
    this.lastFrame = real_ms;
    if (speed > 0) {
      const target = this.machine.now + Math.min(speed * passed_s, 1e3);
      const stop = performance.now() + frameBudget_ms;
      let step = Math.min(longestStep_s, 0.02 * Math.max(1, speed));
      while (this.machine.now < target - 1e-9 && performance.now() < stop)
        this.machine.runUntil(Math.min(target, this.machine.now + step));
      this.measure(real_ms);
    }
    if (!(this.shown > real_ms - 120)) {
      this.shown = real_ms;
      this.show();
    }
    requestAnimationFrame(time => this.step(time));
  }
  step(time) {
    try {
      this.frame(time);
    } catch (error) {
      this.tell(`The model has stopped: ${error.message}. Choose a scenario to begin anew.`);
      throw error;
    }
  }

  measure(real_ms) {
    const { time, real } = this.ratio;
    if (real_ms - real < 1000) return;
    if (real > 0) byId("ratio").textContent = `${((this.machine.now - time) / (real_ms - real) * 1e3).toPrecision(3)} × real time`;
    this.ratio = { time: this.machine.now, real: real_ms };
  }

  tell(text) {
    byId("trouble").textContent = text;
    byId("trouble").hidden = !text;
  }

  // ---- what is shown

  show() {
    const rows = this.machine.rows();
    const row = rows.data.subarray((rows.count - 1) * rows.width);
    byId("now").textContent = `${this.machine.now.toFixed(1)} s`;
    const degrees = value => Number.isNaN(value) ? "–" : `${value.toFixed(2)} °C`;
    this.showFigures({
      "Set-point": degrees(row[columns.setpoint]), "Reading": degrees(row[columns.reading]), "Block": degrees(row[columns.block]),
      "Heater": degrees(row[columns.heater]), "Duty": `${row[columns.duty].toFixed(1)} %` });
    const fault = this.machine.text("fault");
    byId("fault").textContent = typeset(fault);
    byId("fault").hidden = !fault;
    const seen = this.machine.calls.states_seen();
    [...byId("states").children].forEach((item, i) => item.classList.toggle("lit", (seen >> i & 1) !== 0));
    this.chart.draw(rows, this.machine.now);
    this.showLog();
    this.showRegisters();
  }

  showFigures(figures) {
    const list = byId("figures");
    if (!list.children.length) {
      for (const name of Object.keys(figures)) {
        const item = element("div");
        item.append(element("dt", name), element("dd"));
        list.append(item);
      }
    }
    Object.values(figures).forEach((value, i) => { list.children[i].lastChild.textContent = value; });
  }

  showLog() {
    const body = byId("log").tBodies[0];
    const scroller = body.closest(".scroll");
    const atEnd = scroller.scrollTop + scroller.clientHeight >= scroller.scrollHeight - 4;
    for (const [number, time, what, answer, request, reply, failed] of this.machine.json("log_from", this.logged)) {
      this.logged = number + 1;
      turnKnob(what);
      if (what === "poll" && !byId("polls").checked) continue;
      const line = body.insertRow();
      line.append(element("td", `${time.toFixed(2)} s`));
      const cell = element("td", typeset(answer ? `${what}: ${answer}` : what), what === "fault" || failed ? "bad" : "");
      for (const bytes of [request, reply]) {
        if (bytes) cell.append(element("br"), element("code", bytes));
      }
      line.append(cell);
    }
    while (body.rows.length > mostLogRows) body.deleteRow(0);
    if (atEnd) scroller.scrollTop = scroller.scrollHeight;
  }

  showRegisters() {
    const words = this.machine.json("registers");
    this.registers.forEach(({ map, value, word }, i) => {
      const raw = words[i];
      const signed = map.type === "int16" && raw >= 0x8000 ? raw - 0x10000 : raw;
      const text = map.access === "wo" ? "" : String(Number((signed * map.scale).toPrecision(6)));
      if (value.textContent !== text) value.textContent = text;
      const hex = map.access === "wo" ? "" : "0x" + raw.toString(16).padStart(4, "0");
      if (word.textContent !== hex) word.textContent = hex;
    });
  }

  // Pins from this time on.
  showPins(begin) {
    const width = Number(byId("width").value);
    begin = Math.max(0, begin);
    const changes = this.machine.json("pins", begin, begin + width);
    this.waves.known = this.machine.now;
    this.waves.show(changes, this.machine.about.clock_hz, begin, width);
    byId("moment").value = String(Number(begin.toFixed(7)));
    const lost = changes.length && changes[0][0] / this.machine.about.clock_hz > begin + 1e-9 && begin > 1e-4;
    byId("kept").textContent = begin > this.machine.now ? "This moment is still to come."
      : lost || !changes.length ? "The pins of this moment are no longer kept. A copied link runs to it again." : "";
  }

  // ---- what is made once

  makeStates() {
    byId("states").append(...this.machine.about.states.map(name => element("li", name)));
  }

  makeKnobs() {
    makeKnobs(byId("knobs"), event => this.act(event));
    for (const [word, args, summary] of this.machine.about.events) {
      const option = new Option(`${summary} (${word} ${args})`.replace(" )", ")"), word + (args ? " " : ""));
      byId("events").append(option);
    }
  }

  makeRegisters() {
    const body = byId("registers").tBodies[0];
    this.registers = registerMap.map(map => {
      const line = body.insertRow();
      const value = element("td", "", "number"), word = element("td");
      const name = element("td", map.name);
      if (map.access !== "ro") {
        const change = element("button", "set");
        change.setAttribute("aria-label", `Set ${map.name}`);
        change.addEventListener("click", () => {
          const asked = prompt(`${map.name}${map.unit ? ` in ${typeset(map.unit)}` : ""}\n${map.doc}`, value.textContent);
          if (asked !== null) this.act(`set ${map.name} ${asked.trim()}`);
        });
        name.append(change);
      }
      line.append(name, value, element("td", typeset(map.unit)), word, element("td", typeset(map.doc)));
      return { map, line, value, word };
    });
  }

  makeScenarios() {
    const list = byId("scenario");
    list.add(new Option("choose …", ""));
    for (const name of Object.keys(scenarios)) list.add(new Option(name));
    for (const head of this.machine.about.heads) list.add(new Option(`Cold head: ${head}`));
    list.addEventListener("change", () => {
      const head = list.value.match(/^Cold head: (.*)$/);
      if (list.value) this.open(head ? `head ${head[1]}` : scenarios[list.value]);
      list.value = "";
    });
  }

  listen() {
    byId("heat").addEventListener("click", () => {
      if (this.act(`set SETPOINT ${byId("setpoint").value}`)) this.act("run");
    });
    for (const button of document.querySelectorAll("[data-event]"))
      button.addEventListener("click", () => this.act(button.dataset.event));
    byId("by_hand").addEventListener("submit", event => {
      event.preventDefault();
      this.act(byId("event").value);
    });
    byId("link").addEventListener("click", async () => {
      await navigator.clipboard?.writeText(location.href).catch(() => {});
      byId("link").textContent = "Copied";
      setTimeout(() => { byId("link").textContent = "Copy link"; }, 1500);
    });
    byId("follow").addEventListener("click", () => { this.chart.follow = true; });
    byId("newest").addEventListener("click", () => this.showPins(this.machine.now - Number(byId("width").value)));
    byId("moment").addEventListener("change", () => this.showPins(Number(byId("moment").value)));
    byId("width").addEventListener("change", () => {
      const middle = this.waves.begin + this.waves.width / 2;
      this.showPins(middle - Number(byId("width").value) / 2);
    });
    const waves = byId("waves");
    waves.addEventListener("wheel", event => {
      event.preventDefault();
      this.showPins(this.waves.begin + this.waves.width * event.deltaY * 0.001);
    }, { passive: false });
    waves.addEventListener("keydown", event => {
      const by = { ArrowLeft: -0.2, ArrowRight: 0.2 }[event.key];
      if (by) this.showPins(this.waves.begin + by * this.waves.width);
    });
    byId("polls").addEventListener("change", () => {
      byId("log").tBodies[0].replaceChildren();
      this.logged = 0;
      this.showLog();
    });
    byId("find").addEventListener("input", () => {
      const words = byId("find").value.toLowerCase();
      for (const { map, line } of this.registers) line.hidden = !`${map.name} ${map.doc}`.toLowerCase().includes(words);
    });
    addEventListener("resize", () => this.waves.draw());
  }
}

// What stands behind #, if anything; as it is where it is no text in an address's code.
function scenarioOfAddress() {
  const coded = location.hash.slice(1);
  if (!coded) return null;
  try {
    return decodeURIComponent(coded);
  } catch {
    return coded;
  }
}

// "#SCENARIO", or "#trace=SECONDS&SCENARIO", which writes the trace into the page and ends, for tests.
async function main() {
  const [chip, charts] = await Promise.all([unpacked(packedParts.chip), unpacked(packedParts.charts)]);
  const machine = await Machine.load(chip);
  const scenario = scenarioOfAddress() ?? JSON.parse(byId("given").textContent) ?? scenarios["Heat to 110 °C"];
  const asked = scenario.match(/^trace=([0-9.]+)&([^]*)$/);
  if (asked) {
    const problem = machine.open(asked[2]);
    if (!problem) machine.runUntil(Number(asked[1]));
    byId("trace").textContent = problem || machine.text("trace");
    return;
  }
  (0, eval)(new TextDecoder().decode(charts));
  const page = new Page(machine);
  if (!page.open(scenario)) page.beginAnew();
  addEventListener("hashchange", () => page.open(scenarioOfAddress() ?? ""));
  requestAnimationFrame(time => page.step(time));
}

main().catch(error => {
  byId("trouble").textContent = `The page cannot run here: ${error.message}. It needs a browser of 2023 or later.`;
  byId("trouble").hidden = false;
});
