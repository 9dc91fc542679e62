// SPDX-License-Identifier: Apache-2.0
"use strict";
const data = JSON.parse(document.getElementById("data").textContent);
const phaseColors = ["--band-0", "--band-1", "--band-2", "--band-3"];
const faultMargin_s = 5;  // that a click on a fault shows before and behind it
const deviationLimit = 3;  // degC: shows the regulation; the heat-up lies far outside and is cut off

// ---- texts and tables

const grouped = new Intl.NumberFormat("en-US", { maximumFractionDigits: 0 });
const significant = new Intl.NumberFormat("en-US", { maximumSignificantDigits: 4 });

function number(value) {
  if (value === null) return "–";
  const text = (Number.isInteger(value) ? grouped : significant).format(value);
  return text.replace(/,/g, "\u202f").replace(/^-/, "\u2212");
}

// Units are plain ASCII in the data, for programs, and typeset here.
function typeset(text) {
  return text.replace(/\bdegC\b/g, "°C");
}

function withUnit(value, unit) {
  return unit ? number(value) + "\u00a0" + unit : number(value);
}

function element(tag, text = "", className = "") {
  const node = document.createElement(tag);
  node.textContent = text;
  node.className = className;
  return node;
}

function row(...cells) {
  const node = document.createElement("tr");
  node.append(...cells);
  return node;
}

function fillTable(id, rows, foot = []) {
  const table = document.getElementById(id);
  const body = document.createElement("tbody");
  body.append(...(rows.length ? rows : [row(element("td", "none", "muted"))]));
  table.append(body);
  if (foot.length) {
    const node = document.createElement("tfoot");
    node.append(...foot);
    table.append(node);
  }
}

function namedTexts(id, list) {
  fillTable(id, list.map(entry => row(element("th", entry.name), element("td", typeset(entry.text)))));
}

function showHeader() {
  document.getElementById("date").textContent = data.date.replace(/(\d)T(\d)/, "$1 $2").replace(/Z$/, " UTC");
  document.getElementById("verdict").classList.add(data.good ? "good" : "bad");
}

function showPhases() {
  const list = document.getElementById("phases");
  data.phases.forEach((phase, i) => {
    const item = document.createElement("li");
    const swatch = document.createElement("i");
    swatch.style.background = `var(${phaseColors[i % phaseColors.length]})`;
    item.append(swatch, element("strong", phase.name),
                ` ${number(phase.begin_s)} – ${withUnit(phase.end_s, "s")}`);
    list.append(item);
  });
}

// What a pull request or a mail takes.
function summaryText() {
  const rows = data.key_figures.map(f => `| ${f.what} | ${number(f.value)} | ${typeset(f.unit)} |`);
  return [`**${data.job}**: ${data.verdict}`, "", "| | | |", "|---|---|---|", ...rows, ""].join("\n");
}

async function copySummary() {
  const told = document.getElementById("copied");
  try {
    await navigator.clipboard.writeText(summaryText());
    told.textContent = "copied, as Markdown";
  } catch (refused) {
    told.textContent = `not copied: ${refused.message}; the figures stand in summary.json`;
  }
}

function showFaults() {
  const place = document.getElementById("faults");
  if (!data.faults.length) {
    place.append(element("p", "Faults: none.", "muted"));
    return;
  }
  const list = document.createElement("ul");
  for (const fault of data.faults) {
    const link = element("button", withUnit(fault.t_s, "s"));
    link.type = "button";
    link.title = "the curves around it";
    link.addEventListener("click", () => showTimes([fault.t_s - faultMargin_s, fault.t_s + faultMargin_s]));
    const item = document.createElement("li");
    item.append(link, `: ${fault.sentence}`);
    list.append(item);
  }
  place.append(element("strong", data.faults.length === 1 ? "1 fault" : `${data.faults.length} faults`, "bad"), list);
}

function showPathTexts() {
  const { path_before: before, path_after: after } = data;
  const { unit, lower_bound: bound } = data.path;
  document.getElementById("length_before").textContent = withUnit(before.cost, unit);
  const change = before.cost > 0 ? Math.round(100 * (after.cost / before.cost - 1)) : 0;
  const sign = change < 0 ? "\u2212" : "+";
  document.getElementById("length_after").textContent =
    withUnit(after.cost, unit) + (change ? ` (${sign}${Math.abs(change)}\u00a0%)` : "");
  const gap = bound > 0 ? 100 * (after.cost / bound - 1) : 0;
  document.getElementById("path_bound").textContent =
    gap < 1e-6 ? "Proved: no order is cheaper."
      : `No order costs less than ${withUnit(bound, unit)}: this one is at most ${gap.toPrecision(2)}\u00a0% above the cheapest.`;
  const drawn = after.x_mm.length;
  if (drawn < after.points)
    document.getElementById("path_note").textContent = `Drawn: the first ${number(drawn)} of ${number(after.points)} bumps.`;
}

function showLockstep() {
  const windows = data.lockstep;
  const sum = field => windows.reduce((total, w) => total + w[field], 0);
  const verdict = mismatches =>
    element("td", mismatches ? `${number(mismatches)} differ` : "equal", mismatches ? "bad" : "good");
  const sentence = document.getElementById("lockstep_sentence");
  if (!sum("comparisons")) {
    sentence.textContent = "The RTL did not run beside the model in this print: nothing was compared.";
    return;
  }
  sentence.textContent = `${number(sum("comparisons"))} values of ${number(sum("clocks"))} clocks compared, `
    + (sum("mismatches") ? `${number(sum("mismatches"))} of them differ.` : "all of them equal.");
  const head = document.createElement("thead");
  head.append(row(element("th", "Window"),
    ...["First cycle", "Last cycle", "Clocks", "Flops a clock", "Comparisons"].map(text => element("th", text, "number")),
    element("th", "Verdict")));
  document.getElementById("lockstep").append(head);
  const fields = ["first_cycle", "last_cycle", "clocks", "flops_per_clock", "comparisons"];
  const rows = windows.map(w => row(element("td", w.name), ...fields.map(f => element("td", number(w[f]), "number")),
                                    verdict(w.mismatches)));
  const total = row(element("td", "Total"), element("td"), element("td"), element("td", number(sum("clocks")), "number"),
                    element("td"), element("td", number(sum("comparisons")), "number"), verdict(sum("mismatches")));
  fillTable("lockstep", rows, windows.length > 1 ? [total] : []);
}

// A segment for each window, as wide as it is long; of very many, neighbours share one that shows the worst of them.
function showWindows() {
  const check = data.windows;
  if (!check) return;
  const maxSegments = 600, maxFaults = 20;
  const badness = ["equal", "missing", "unusable", "differs"];
  document.getElementById("windows").hidden = false;
  const strip = document.getElementById("window_strip");
  const share = Math.max(1, Math.ceil(check.list.length / maxSegments));
  for (let first = 0; first < check.list.length; first += share) {
    const group = check.list.slice(first, first + share);
    const verdict = badness[Math.max(...group.map(w => badness.indexOf(w.verdict)))];
    const last = first + group.length - 1;
    const segment = element("i", "", verdict);
    const begin = group[0].first_cycle, end = group[group.length - 1].last_cycle;
    segment.style.flexGrow = end - begin + 1;
    segment.title = `${first === last ? `window ${first}` : `windows ${first} to ${last}`}: cycles ${number(begin)} to ${number(end)}, ${verdict}`;
    strip.append(segment);
  }
  strip.classList.toggle("dense", strip.childElementCount > 150);
  strip.setAttribute("aria-label", `${check.equal} of ${check.windows} windows equal`);
  document.getElementById("window_end").textContent = withUnit(check.cycles / check.clock_hz, "s");
  const line = (name, text, className = "") => row(element("th", name), element("td", text, "number " + className));
  fillTable("window_figures", [
    line("Windows equal", `${number(check.equal)} of ${number(check.windows)}`, check.equal === check.windows ? "good" : "bad"),
    line("Clocks compared", `${number(check.clocks)} of ${number(check.cycles)}`, check.clocks === check.cycles ? "good" : "bad"),
    line("Flop values compared", number(check.flop_values)),
    line("Pin values compared", number(check.pin_values)),
    line("Gaps and differences", check.whole ? "none" : `${number(check.faults.length)}, listed below`, check.whole ? "good" : "bad"),
    line("Lost workers, windows run again", check.lost_workers.length ? number(check.lost_workers.length) : "none"),
    line("Workers", check.workers),
    line("Wall time", withUnit(check.wall_s, "s")),
  ]);
  if (!check.faults.length) return;
  const list = document.createElement("ul");
  for (const fault of check.faults.slice(0, maxFaults)) list.append(element("li", fault));
  if (check.faults.length > maxFaults)
    list.append(element("li", `${number(check.faults.length - maxFaults)} more in summary.json`, "muted"));
  document.getElementById("window_faults").append(list);
}

function showKeyFigures() {
  fillTable("key_figures", data.key_figures.map(figure => row(
    element("th", figure.what), element("td", number(figure.value), "number"), element("td", typeset(figure.unit), "unit"))));
}

// ---- charts

function color(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

function curve(t, values) {
  return t.map((x, i) => ({ x, y: values[i] }));
}

// Of each curve the point nearest in time, so that one tooltip tells what held at one instant.
Chart.Interaction.modes.instant = (chart, event) => {
  const { x, y } = Chart.helpers.getRelativePosition(event, chart);
  const { left, right, top, bottom } = chart.chartArea;
  if (x < left || x > right || y < top || y > bottom) return [];
  const t = chart.scales.x.getValueForPixel(x);
  return chart.getSortedVisibleDatasetMetas().flatMap(meta => {
    const points = chart.data.datasets[meta.index].data;
    let low = 0, high = points.length - 1;
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (points[middle].x <= t) low = middle; else high = middle;
    }
    if (high < 0) return [];
    const index = Math.abs(points[high].x - t) < Math.abs(points[low].x - t) ? high : low;
    return points[index].y === null ? [] : [{ element: meta.data[index], datasetIndex: meta.index, index }];
  });
};

// Phases as shaded bands and faults as lines, behind the curves.
const timeMarks = {
  id: "timeMarks",
  beforeDatasetsDraw({ ctx, chartArea, scales: { x } }) {
    const { left, right, top, bottom } = chartArea;
    const clip = pixel => Math.min(right, Math.max(left, pixel));
    ctx.save();
    data.phases.forEach((phase, i) => {
      const begin = clip(x.getPixelForValue(phase.begin_s)), end = clip(x.getPixelForValue(phase.end_s));
      ctx.fillStyle = color(phaseColors[i % phaseColors.length]);
      ctx.fillRect(begin, top, end - begin, bottom - top);
    });
    ctx.strokeStyle = color("--bad");
    ctx.setLineDash([4, 3]);
    for (const fault of data.faults) {
      const at = clip(x.getPixelForValue(fault.t_s));
      ctx.beginPath();
      ctx.moveTo(at, top);
      ctx.lineTo(at, bottom);
      ctx.stroke();
    }
    ctx.restore();
  },
};

// A millimetre is as long on x as on y: the axis with room to spare gets the wider range.
const equalAspect = {
  id: "equalAspect",
  afterLayout(chart) {
    const { width, height } = chart.chartArea;
    const { x, y } = chart.options.scales;
    const box = chart.options.plugins.equalAspect;
    const mmPerPixel = Math.max((box.x[1] - box.x[0]) / width, (box.y[1] - box.y[0]) / height);
    const centre = range => (range[0] + range[1]) / 2;
    const wanted = {
      x: [centre(box.x) - mmPerPixel * width / 2, centre(box.x) + mmPerPixel * width / 2],
      y: [centre(box.y) - mmPerPixel * height / 2, centre(box.y) + mmPerPixel * height / 2],
    };
    // labels of the new range may change the area by a pixel or two, so settle within a small tolerance
    const tolerance = 3 * mmPerPixel;
    if (Math.abs(x.min - wanted.x[0]) < tolerance && Math.abs(y.min - wanted.y[0]) < tolerance) return;
    [x.min, x.max] = wanted.x;
    [y.min, y.max] = wanted.y;
    queueMicrotask(() => chart.update("none"));
  },
};

function axis(title, more = {}) {
  return {
    ...more,
    title: { display: true, text: title, color: color("--muted") },
    ticks: { color: color("--muted"), includeBounds: false, ...more.ticks },
    grid: { color: color("--grid"), borderColor: color("--line"), ...more.grid },
  };
}

function plain(label, points, line, more = {}) {
  return { label, data: points, borderColor: line, backgroundColor: line, borderWidth: 1.6, pointRadius: 0, ...more };
}

const lastTime = Math.max(...data.temperature.t_s.slice(-1), ...data.duty.t_s.slice(-1),
                          ...data.phases.map(phase => phase.end_s), 0);

let shownTimes = [0, lastTime];

function timeAxis() {
  return axis("time (s)", { type: "linear", min: shownTimes[0], max: shownTimes[1] });
}

// Both curves show the same times.
function showTimes([begin, end]) {
  shownTimes = [Math.max(begin, 0), Math.min(end, lastTime)];
  for (const id of ["temperature", "deviation"]) {
    const chart = Chart.getChart(id);
    [chart.options.scales.x.min, chart.options.scales.x.max] = shownTimes;
    chart.update("none");
  }
}

// Drag over a curve: what lies between becomes the whole width.
function zoomInTime(id) {
  const canvas = document.getElementById(id);
  const leastPixels = 5;  // a click is no drag
  let from = null;
  const pixel = event => Math.min(Math.max(event.offsetX, Chart.getChart(id).chartArea.left), Chart.getChart(id).chartArea.right);
  canvas.addEventListener("pointerdown", event => {
    from = pixel(event);
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointerup", event => {
    const to = pixel(event), { x } = Chart.getChart(id).scales;
    if (from !== null && Math.abs(to - from) >= leastPixels)
      showTimes([x.getValueForPixel(Math.min(from, to)), x.getValueForPixel(Math.max(from, to))]);
    from = null;
  });
  canvas.addEventListener("dblclick", () => showTimes([0, lastTime]));
}

function timeChartOptions(scales, unitOf) {
  return {
    animation: false, maintainAspectRatio: false, responsive: true, parsing: false, normalized: true,
    interaction: { mode: "instant" },
    scales,
    plugins: {
      legend: { align: "start", labels: { color: color("--text"), usePointStyle: true, pointStyle: "line", pointStyleWidth: 26 } },
      tooltip: { callbacks: {
        title: items => items.length ? `${number(items[0].parsed.x)} s` : "",
        label: item => `${item.dataset.label}: ${withUnit(Number(item.parsed.y.toFixed(3)), unitOf(item))}`,
      } },
    },
  };
}

function temperatureChart() {
  const { t_s, reading_degc, heater_degc, setpoint_degc } = data.temperature;
  const datasets = [
    plain("set-point", curve(t_s, setpoint_degc), color("--setpoint"), { borderDash: [6, 4], stepped: true, yAxisID: "y", order: 1 }),
    plain("chip reading", curve(t_s, reading_degc), color("--reading"), { borderWidth: 2.2, yAxisID: "y", order: 0 }),
    plain("heater", curve(t_s, heater_degc), color("--heater"), { borderWidth: 1.2, yAxisID: "y", order: 2 }),
    plain("duty (right)", curve(data.duty.t_s, data.duty.duty.map(duty => duty === null ? null : 100 * duty)), color("--duty"),
          { stepped: true, fill: "origin", backgroundColor: color("--duty-fill"), borderWidth: 1, yAxisID: "duty", order: 3 }),
  ].filter(dataset => dataset.data.some(point => point.y !== null));
  const scales = {
    x: timeAxis(),
    y: axis("temperature (°C)", { beginAtZero: true, grace: "8%" }),
    duty: axis("heater duty (%)", { position: "right", min: 0, max: 100, grid: { drawOnChartArea: false } }),
  };
  return new Chart("temperature", {
    type: "line", data: { datasets }, plugins: [timeMarks],
    options: timeChartOptions(scales, item => item.dataset.yAxisID === "duty" ? "%" : "°C"),
  });
}

function deviationChart() {
  const { t_s, reading_degc, setpoint_degc } = data.temperature;
  const difference = reading_degc.map((reading, i) =>
    reading === null || setpoint_degc[i] === null ? null : reading - setpoint_degc[i]);
  const options = timeChartOptions({
    x: timeAxis(),
    y: axis("°C", { min: -deviationLimit, max: deviationLimit, ticks: { stepSize: 1, autoSkip: false } }),
    // an empty right axis of the width of the chart above, so that both time axes stand one below the other
    right: axis("", { position: "right", grid: { display: false, drawBorder: false }, ticks: { display: false },
                      afterFit: scale => { scale.width = charts[0] ? charts[0].scales.duty.width : scale.width; } }),
  }, () => "°C");
  options.scales.y.afterFit = scale => { scale.width = charts[0] ? charts[0].scales.y.width : scale.width; };
  options.plugins.legend.display = false;
  return new Chart("deviation", {
    type: "line", plugins: [timeMarks],
    data: { datasets: [plain("reading minus set-point", curve(t_s, difference), color("--reading"))] }, options,
  });
}

function range(...lists) {
  let low = Infinity, high = -Infinity;
  for (const list of lists) for (const value of list) {
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (low > high) return [0, 1];
  const margin = Math.max(0.06 * (high - low), 0.1);
  return [low - margin, high + margin];
}

function pathChart(id, path, box) {
  const points = curve(path.x_mm, path.y_mm);
  const radius = points.length > 4000 ? 0 : points.length > 400 ? 1.2 : 2.6;
  const datasets = [
    plain("first bump", points.slice(0, 1), color("--good"), { pointRadius: 7, pointHoverRadius: 7 }),
    plain("bump", points, color("--path"), { showLine: true, borderWidth: 1.1, pointRadius: radius, pointHoverRadius: 5 }),
  ];
  return new Chart(id, {
    type: "scatter", data: { datasets }, plugins: [equalAspect],
    options: {
      animation: false, maintainAspectRatio: false, responsive: true, parsing: false, normalized: true,
      scales: { x: axis("x (mm)", { min: box.x[0], max: box.x[1] }), y: axis("y (mm)", { min: box.y[0], max: box.y[1] }) },
      plugins: {
        equalAspect: box,
        legend: { align: "start", labels: { color: color("--text"), usePointStyle: true, boxHeight: 7, filter: item => item.text === "first bump" } },
        tooltip: { callbacks: {
          label: item => `bump ${number(item.dataIndex + 1)}: x ${withUnit(item.parsed.x, "mm")}, y ${withUnit(item.parsed.y, "mm")}`,
        } },
      },
    },
  });
}

function microns(value) {
  return withUnit(Number(value.toFixed(1)), "µm");
}

// A bump each: in place, beside it, or without a droplet.
function dropletPoints() {
  const { bump, t_s, miss_x_um, miss_y_um, good_um } = data.droplets;
  const { x_mm, y_mm } = data.path_after;
  const points = x_mm.map((x, i) => ({ x, y: y_mm[i], number: i + 1 }));
  bump.forEach((b, i) => {
    points[b].t_s = t_s[i];
    points[b].miss_um = Math.hypot(miss_x_um[i], miss_y_um[i]);
    points[b].told = `${microns(miss_x_um[i])} in x and ${microns(miss_y_um[i])} in y beside it at ${withUnit(Number(t_s[i].toFixed(3)), "s")}`;
  });
  return { good: points.filter(p => p.miss_um <= good_um), beside: points.filter(p => p.miss_um > good_um),
           none: points.filter(p => p.miss_um === undefined) };
}

function showDropletText({ good, beside, none }) {
  const all = [...good, ...beside];
  const worst = all.reduce((most, p) => p.miss_um > most.miss_um ? p : most, { miss_um: 0 });
  document.getElementById("droplet_sentence").textContent =
    (all.length ? `The farthest fell ${microns(worst.miss_um)} beside its bump (number ${number(worst.number)}); good is ${microns(data.droplets.good_um)} at most. ` : "No droplet fell. ")
    + (beside.length ? `${number(beside.length)} fell farther. ` : "") + (none.length ? `${number(none.length)} of the bumps drawn got none.` : "");
}

function dropletChart(box) {
  const { good, beside, none } = dropletPoints();
  const most = Math.max(...[...good, ...beside].map(p => p.miss_um), 1e-9);
  const size = good.length > 4000 ? 1.5 : good.length > 400 ? 3 : 6;
  // the farther, the larger
  const radius = context => context.raw ? size * (0.5 + 0.5 * context.raw.miss_um / most) : size;
  const set = (label, points, line, more) => plain(label, points, line, { pointHoverRadius: size + 3, ...more });
  return new Chart("droplets", {
    type: "scatter", plugins: [equalAspect],
    data: { datasets: [
      set("in its place", good, color("--path"), { pointRadius: radius }),
      set("too far", beside, color("--bad"), { pointRadius: radius }),
      set("no droplet", none, color("--bad"), { pointRadius: size, pointStyle: "crossRot", borderWidth: 2 }),
    ].filter(dataset => dataset.data.length) },
    options: {
      animation: false, maintainAspectRatio: false, responsive: true, parsing: false, normalized: true,
      scales: { x: axis("x (mm)", { min: box.x[0], max: box.x[1] }), y: axis("y (mm)", { min: box.y[0], max: box.y[1] }) },
      plugins: {
        equalAspect: { ...box },
        legend: { align: "start", labels: { color: color("--text"), usePointStyle: true, boxHeight: 7 } },
        tooltip: { callbacks: { label: ({ raw }) => `bump ${number(raw.number)}: ${raw.told ?? "no droplet"}` } },
      },
    },
  });
}

// Wheel and drag on the map; its box is what equalAspect fits into the picture.
function zoomOnMap(id, whole) {
  const canvas = document.getElementById(id), step = 1.25;
  let held = null;
  const show = box => {
    Object.assign(Chart.getChart(id).options.plugins.equalAspect, box);
    Chart.getChart(id).update("none");
  };
  const around = (range, centre, factor) => range.map(end => centre + (end - centre) * factor);
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    const { scales: { x, y }, options } = Chart.getChart(id);
    const { equalAspect: box } = options.plugins, factor = event.deltaY > 0 ? step : 1 / step;
    show({ x: around(box.x, x.getValueForPixel(event.offsetX), factor), y: around(box.y, y.getValueForPixel(event.offsetY), factor) });
  }, { passive: false });
  canvas.addEventListener("pointerdown", event => {
    const { x, y } = Chart.getChart(id).scales;
    held = { x: x.getValueForPixel(event.offsetX), y: y.getValueForPixel(event.offsetY) };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", event => {
    if (!held) return;
    const { scales: { x, y }, options } = Chart.getChart(id);
    const box = options.plugins.equalAspect;
    const dx = held.x - x.getValueForPixel(event.offsetX), dy = held.y - y.getValueForPixel(event.offsetY);
    show({ x: box.x.map(end => end + dx), y: box.y.map(end => end + dy) });
  });
  canvas.addEventListener("pointerup", () => { held = null; });
  canvas.addEventListener("dblclick", () => show(whole()));
}

let charts = [];

function pathBox() {
  const { path_before: before, path_after: after } = data;
  return { x: range(before.x_mm, after.x_mm), y: range(before.y_mm, after.y_mm) };
}

function draw() {
  for (const chart of charts) chart.destroy();
  charts = [];
  const { path_before: before, path_after: after } = data;
  const box = pathBox();
  charts.push(temperatureChart());
  charts.push(deviationChart(), pathChart("path_before", before, box), pathChart("path_after", after, box), dropletChart(box));
}

Chart.defaults.font.family = getComputedStyle(document.body).fontFamily;
showHeader();
showPhases();
showFaults();
showPathTexts();
showDropletText(dropletPoints());
showLockstep();
showWindows();
showKeyFigures();
namedTexts("settings", data.settings);
namedTexts("versions", data.versions);
draw();
zoomInTime("temperature");
zoomInTime("deviation");
zoomOnMap("droplets", pathBox);
document.getElementById("copy").addEventListener("click", copySummary);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
matchMedia("print").addEventListener("change", draw);
