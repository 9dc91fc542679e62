// SPDX-License-Identifier: Apache-2.0
// The page: shows what the server's events say, and hands on what a person asks for.
"use strict";

const mostLogRows = 400;
const mostRows = 400_000;  // a day and more, four a second
const staleAfter_ms = 3000;
const token = new URLSearchParams(location.search).get("token");
const runColors = ["--path", "--heater", "--good", "--muted"];  // of as many earlier runs
const shownCurves = curves.filter(curve => ["reading", "set-point", "duty"].includes(curve.name));

// Samples in one piece, as the chart takes them; the older half goes when it is full.
class Rows {
  constructor() {
    this.width = Object.keys(columns).length;
    this.clear();
  }
  clear() {
    this.count = 0;
    this.data = new Float64Array(this.width * 4096);
  }
  get newest() { return this.count ? this.data[(this.count - 1) * this.width] : 0; }
  add(time, temperature, setpoint, duty) {
    if (this.count && !(time > this.newest)) return;  // told twice
    if (this.count === mostRows) this.forgetHalf();
    if ((this.count + 1) * this.width > this.data.length) this.grow();
    const row = this.data.subarray(this.count * this.width, ++this.count * this.width);
    row.fill(NaN);
    row[columns.time] = time;
    row[columns.reading] = temperature ?? NaN;
    row[columns.setpoint] = setpoint ?? NaN;
    row[columns.duty] = duty ?? NaN;
  }
  forgetHalf() {
    const kept = this.count >> 1;
    this.data.copyWithin(0, (this.count - kept) * this.width, this.count * this.width);
    this.count = kept;
  }
  grow() {
    const larger = new Float64Array(2 * this.data.length);
    larger.set(this.data);
    this.data = larger;
  }
}

// The chart with earlier runs behind it.
class LiveChart extends TemperatureChart {
  // [{ name, rows, color }]; `begin` is when heating began in this run, if it has.
  showRuns(runs, begin) {
    const datasets = this.chart.data.datasets;
    datasets.length = this.curves.length;
    for (const { name, rows, color } of runs) {
      const shift = begin === undefined ? 0 : begin - (heatingBegins(rows) ?? begin);
      datasets.push({ label: runTitle(name), data: rows.map(([time, temperature]) => ({ x: time + shift, y: temperature ?? NaN })), pointRadius: 0,
        yAxisID: "temperature", borderWidth: 1.5, borderDash: [2, 3], fill: false,
        borderColor: getComputedStyle(document.documentElement).getPropertyValue(color).trim() });
    }
    this.stale = true;
  }
}

// "run_2026-01-31_235959_2.csv": "2026-01-31 23:59:59 (2)".
const runTitle = name => name.replace(/^run_(.*)_(\d\d)(\d\d)(\d\d)(?:_(\d+))?\.csv$/, (_, date, hour, minute, second, number) =>
  `${date} ${hour}:${minute}:${second}${number ? ` (${number})` : ""}`);
// Each duty holds until the next row; where the line was lost there is none.
function meanDuty(rows) {
  let seconds = 0, sum = 0;
  for (let i = 0; i + 1 < rows.length; ++i) {
    const [time, , , duty] = rows[i];
    if (duty === null) continue;
    seconds += rows[i + 1][0] - time;
    sum += duty * (rows[i + 1][0] - time);
  }
  return seconds > 0 ? sum / seconds : 0;
}
const heatingBegins = rows => rows.find(([, , , duty]) => duty > 0)?.[0];

class Page {
  constructor() {
    this.rows = new Rows();
    this.chart = new LiveChart(byId("temperature"), shownCurves, () => {});
    this.connected = false;
    this.runs = [];  // in the chart
    this.makeRegisters();
    this.listenToPerson();
    this.listenToServer();
    setInterval(() => this.showAge(), 250);
  }

  // ---- from the server

  listenToServer() {
    const source = this.source = new EventSource("/events" + (token ? `?token=${encodeURIComponent(token)}` : ""));
    const on = (name, act) => source.addEventListener(name, event => act.call(this, JSON.parse(event.data)));
    on("about", this.begin);
    on("connection", this.showConnection);
    on("reading", this.showReading);
    on("registers", this.showRegisters);
    on("faults", this.showFaults);
    on("notice", this.showNotice);
    on("around", this.showAround);
    on("kept", this.showKept);
    on("answer", this.showAnswer);
    source.addEventListener("error", () => {
      this.showConnection({ connected: false, text: "the server of this page does not answer, or refuses: it has ended, too many pages are open, or the token is another one" });
      if (source.readyState !== EventSource.CLOSED) return;  // it tries again by itself
      setTimeout(() => { if (!document.hidden && source === this.source) this.listenToServer(); }, 3000);
    });
  }

  async begin(about) {
    this.listed = false;  // it may be another server
    byId("place").textContent = about.place;
    byId("bench").hidden = !about.virtual;
    byId("states").replaceChildren(...about.states.map(name => element("li", name)));
    const samples = await (await this.ask("/samples")).json();
    this.rows.clear();
    for (const row of samples) this.rows.add(...row);
    this.heatingBegan = heatingBegins(samples);
    this.overlay();
    this.chart.draw(this.rows, this.rows.newest);
  }

  showConnection({ connected, text, identity }) {
    if (this.connected && !connected) this.rows.add(this.rows.newest + 0.001, NaN, NaN, NaN);  // the curves end
    this.connected = connected;
    byId("connection").textContent = connected ? `Connected${identity ? ` to ${identity}` : ""}.` : "Lost.";
    byId("connection").className = connected ? "good" : "bad";
    this.tell("lost", connected ? "" : `No connection: ${typeset(text)}.\nWhat is shown is old. Stop cannot reach the chip. Its guard and its host watchdog go on by themselves; the emergency stop and the switch of the supply work without this page. It is tried again each second.`);
    this.showStale();
  }

  showReading(reading) {
    if (this.heatingBegan === undefined && reading.duty > 0) {
      this.heatingBegan = reading.time_s;
      this.overlay();
    }
    if (this.connected) this.answered = performance.now();  // a page that opens later hears the last reading, too
    this.rows.add(reading.time_s, reading.temperature, reading.setpoint, reading.duty);
    const degrees = value => value === null ? "–" : `${value.toFixed(2)} °C`;
    byId("temperature_now").textContent = degrees(reading.temperature);
    byId("setpoint_now").textContent = `${reading.setpoint.toFixed(1)} °C`;
    byId("duty_now").textContent = `${reading.duty.toFixed(1)} %`;
    const said = [reading.run ? "Heating is on" : "Heating is off"];
    if (reading.at_temperature) said.push("at temperature");
    if (reading.locked) said.push("locked");
    if (reading.present.length) said.push(`present now: ${reading.present.join(", ")}`);
    byId("condition").textContent = said.join("; ") + ".";
    for (const item of byId("states").children) item.classList.toggle("lit", item.textContent === reading.state);
    this.chart.draw(this.rows, this.rows.newest);
    this.showStale();
  }

  showRegisters(values) {
    for (const { map, value, doc } of this.registers) {
      const [text, meaning] = values[map.name] ?? ["", ""];
      if (value.textContent !== text) value.textContent = text;
      const said = typeset(meaning ? `${meaning}. ${map.doc}` : map.doc);
      if (doc.textContent !== said) doc.textContent = said;
    }
  }

  showFaults(sentences) {
    byId("faults").replaceChildren(...sentences.map(sentence => element("li", typeset(sentence))));
    byId("faults").hidden = !sentences.length;
  }

  showAround({ speed, ...around }) {
    const list = byId("speed");
    if (speed !== undefined && !Array.from(list.options, option => option.value).includes(speed)) list.add(new Option(`${speed} ×`, speed));
    list.value = speed;
    for (const [word, value] of Object.entries(around)) turnKnob(`${word} ${value}`);
  }

  // ---- earlier runs

  async showKept({ name, problem }) {
    byId("history").hidden = false;
    byId("kept").textContent = problem ? `This run can not be kept: ${problem}. It goes on, and so does the page; what is missing in ${name} stays missing.`
      : `This run is kept as ${name}.`;
    byId("kept").className = problem ? "bad" : "";
    if (this.listed) return;
    this.listed = true;
    this.runs = [];
    this.overlay();
    const runs = (await (await this.ask("/runs")).json()).filter(run => run.name !== name);
    byId("runs").tBodies[0].replaceChildren(...runs.map(run => this.runLine(run.name)));
  }

  runLine(name) {
    const line = element("tr"), label = element("label"), box = document.createElement("input");
    box.type = "checkbox";
    box.addEventListener("change", () => this.chooseRun(box, name, line));
    label.append(box, ` ${runTitle(name)}`);
    const first = element("td");
    first.append(label);
    line.append(first, ...Array.from({ length: 4 }, () => element("td", "", "number")));
    return line;
  }

  async chooseRun(box, name, line) {
    this.runs = this.runs.filter(run => run.name !== name);
    if (box.checked) {
      const used = this.runs.map(run => run.color);
      const color = runColors.find(one => !used.includes(one));
      if (!color) {
        box.checked = false;
        byId("kept").textContent = `${runColors.length} runs are in the chart, no more fit; take one out first.`;
        return;
      }
      const run = { name, rows: [], color };
      this.runs.push(run);
      run.rows = await (await this.ask(`/runs/${name}`)).json();
      this.tellFigures(line, run.rows);
    }
    this.overlay();
  }

  tellFigures(line, rows) {
    const temperatures = rows.map(row => row[1]).filter(value => value !== null);
    const figures = rows.length < 2 || !temperatures.length ? ["–", "–", "–", "–"]
      : [`${(rows.at(-1)[0] - rows[0][0]).toFixed(0)} s`, `${Math.max(...temperatures).toFixed(2)} °C`, `${temperatures.at(-1).toFixed(2)} °C`,
         `${meanDuty(rows).toFixed(1)} %`];
    figures.forEach((figure, i) => { line.cells[i + 1].textContent = figure; });
  }

  overlay() {
    this.chart.showRuns(this.runs, this.heatingBegan);
    this.chart.draw(this.rows, this.rows.newest);
  }

  // ---- what is told

  showNotice({ text, changed }) {
    const list = changed.map(change => typeset(change).replace("->", "→")).join(", ");
    byId("notice_text").textContent = list ? `${text} ${list}.` : text;
    byId("notice").hidden = false;
    this.log("notice", text, "");
  }

  showAnswer({ asked, outcome, text }) {
    this.log(typeset(asked), typeset(text ? `${outcome}, ${text}` : outcome), outcome === "done" ? "" : "bad");
  }

  log(asked, answer, className) {
    const body = byId("log").tBodies[0];
    const line = body.insertRow(0);
    line.append(element("td", new Date().toLocaleTimeString()), element("td", `${asked}: ${answer}`, className));
    while (body.rows.length > mostLogRows) body.deleteRow(-1);
  }

  tell(id, text) {
    if (byId(id).textContent !== text) byId(id).textContent = text;  // said once to who hears the page
    byId(id).hidden = !text;
  }

  showAge() {
    const age_s = (performance.now() - this.answered) / 1000;
    byId("age").textContent = this.answered === undefined ? "no answer since this page was opened" : `answered ${age_s.toFixed(1)} s ago`;
    this.showStale();
  }
  showStale() {
    const stale = !this.connected || !(performance.now() - this.answered < staleAfter_ms);
    document.body.classList.toggle("stale", stale);
  }

  // ---- to the server

  ask(path, options = {}) {
    const headers = { ...options.headers, ...(token ? { Authorization: `Bearer ${token}` } : {}) };
    return fetch(path, { ...options, headers });
  }

  // Sent once. Where nothing comes back nobody knows, and that is said.
  async command(what) {
    const id = Array.from(crypto.getRandomValues(new Uint8Array(12)), byte => byte.toString(16).padStart(2, "0")).join("");
    const asked = [what.do, what.register, what.value, what.event, what.ratio].filter(word => word !== undefined).join(" ");
    this.showOutcome(`${asked}: asked …`, "");
    try {
      const answer = await this.ask("/command", { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ id, ...what }) });
      if (answer.headers.get("Content-Type").startsWith("application/json")) {
        const { asked: text, outcome, text: said } = await answer.json();
        this.showOutcome(`${text}: ${outcome}${said ? `, ${said}` : ""}`, outcome === "done" ? "good" : "bad");
      } else {
        const refusal = (await answer.text()).trim();
        this.showOutcome(`${asked}: refused, ${refusal}`, "bad");
        this.log(asked, `refused, ${typeset(refusal)}`, "bad");
      }
    } catch {
      this.showOutcome(`${asked}: unknown, the server did not answer; read back what the chip has`, "bad");
      this.log(asked, "unknown, the server did not answer", "bad");
    }
  }

  showOutcome(text, className) {
    byId("outcome").textContent = typeset(text);
    byId("outcome").className = className;
  }

  // ---- what is made once

  makeRegisters() {
    const body = byId("registers").tBodies[0];
    this.registers = registerMap.filter(map => map.access !== "wo").map(map => {
      const line = body.insertRow();
      const value = element("td", "", "number"), doc = element("td", typeset(map.doc));
      const name = element("td", map.name);
      if (map.access === "rw") {
        const change = element("button", "set");
        change.setAttribute("aria-label", `Set ${map.name}`);
        change.addEventListener("click", () => this.openWrite(map, value.textContent));
        name.append(change);
      }
      line.append(name, value, element("td", typeset(map.unit)), doc);
      return { map, line, value, doc };
    });
  }

  openWrite(map, value) {
    this.written = map.name;
    const shown = raw => Number((raw * map.scale).toPrecision(6));
    const unit = typeset(map.unit);
    byId("write_name").textContent = `Set ${map.name}`;
    byId("write_doc").textContent = typeset(map.doc);
    byId("write_value").value = Number(value);
    byId("write_unit").textContent = unit;
    byId("write_range").textContent = `From ${shown(map.min)} to ${shown(map.max)}${unit ? ` ${unit}` : ""}.`;
    byId("write").showModal();
    byId("write_value").select();
  }

  listenToPerson() {
    const buttons = { run: "run", stop: "stop", clear: "clear", tune: "tune" };
    for (const [id, word] of Object.entries(buttons)) byId(id).addEventListener("click", () => this.command({ do: word }));
    byId("setpoint_form").addEventListener("submit", event => {
      event.preventDefault();
      this.command({ do: "set", register: "SETPOINT", value: byId("setpoint").valueAsNumber });
    });
    byId("write_form").addEventListener("submit", event => {
      event.preventDefault();
      byId("write").close();
      this.command({ do: "set", register: this.written, value: byId("write_value").valueAsNumber });
    });
    byId("write_cancel").addEventListener("click", () => byId("write").close());
    // Wherever one is, a dialog too.
    addEventListener("keydown", event => {
      if (event.key === "Escape" && !event.repeat) this.command({ do: "stop" });
    }, { capture: true });
    makeKnobs(byId("knobs"), event => this.command({ do: "event", event }));
    byId("speed").addEventListener("change", () => this.command({ do: "speed", ratio: Number(byId("speed").value) }));
    byId("notice_seen").addEventListener("click", () => { byId("notice").hidden = true; });
    // A browser has few connections to a server, and one of them must be left for Stop, however many tabs there are.
    document.addEventListener("visibilitychange", () => {
      this.source.close();
      if (!document.hidden) this.listenToServer();
    });
    byId("follow").addEventListener("click", () => { this.chart.follow = true; });
    byId("find").addEventListener("input", () => {
      const words = byId("find").value.toLowerCase();
      for (const { map, line } of this.registers) line.hidden = !`${map.name} ${map.doc}`.toLowerCase().includes(words);
    });
  }
}

new Page();
