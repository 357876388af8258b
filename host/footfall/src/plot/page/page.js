"use strict";
// Draws what the element `data` holds: the feet of a replay, as lines, states, tracks and events over time.
// What has been drawn is summed up in data attributes, which the tests read.
(() => {
  const page = JSON.parse(document.getElementById("data").textContent);
  const root = document.documentElement;
  const body = document.body;
  body.dataset.errors = 0;
  addEventListener("error", (event) => {
    body.dataset.errors = Number(body.dataset.errors) + 1;
    body.dataset.error = event.message;
  });

  const STATES = {
    swing: "state: swing", quiet_swing: "state: quiet swing", landing: "state: landing", slip: "state: slip", unknown: "state: unknown",
  };
  const FONT = "12px system-ui, sans-serif";
  const AXIS_WIDTH = 72;

  const colours = {};
  const readColours = () => {
    const style = getComputedStyle(root);
    for (const name of ["background", "text", "faint", "grid", "load", "tangential", "vertical", "total", "label",
      "decision", "event", "slide", ...Object.keys(STATES)]) {
      colours[name] = style.getPropertyValue("--" + name).trim();
    }
  };

  const make = (tag, parent, text, name) => {
    const element = document.createElement(tag);
    if (text !== undefined) element.textContent = text;
    if (name) element.className = name;
    if (parent) parent.append(element);
    return element;
  };
  const grouped = (number) => number.toLocaleString("en").replaceAll(",", "\u202f");
  const counted = (count, one, many) => `${grouped(count)} ${count === 1 ? one : many}`;

  // Times are stored as steps in µs, values as whole numbers of levels between two values.
  const unpackLine = (line, shift) => {
    const times = new Float64Array(line.t.length);
    const scale = (line.high - line.low) / line.levels;
    let micros = 0;
    line.t.forEach((step, k) => {
      micros += step;
      times[k] = shift + micros / 1e6;
    });
    return [times, line.v.map((level) => (level === null ? null : line.low + level * scale))];
  };
  // Stretches: step in µs to the start, what is so from there on, and so on; the last step leads to the end.
  const unpackStretches = (packed, names, shift) => {
    const stretches = [];
    let micros = 0;
    for (let k = 0; k + 2 < packed.length; k += 2) {
      micros += packed[k];
      stretches.push({ from: shift + micros / 1e6, to: shift + (micros + packed[k + 2]) / 1e6, is: names[packed[k + 1]] });
    }
    return stretches;
  };
  // The last index whose time is not after `time`; -1 where there is none.
  const before = (length, timeOf, time) => {
    let [low, high] = [0, length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (timeOf(middle) <= time) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  };
  const stretchAt = (stretches, time) => {
    const found = stretches[before(stretches.length, (k) => stretches[k].from, time)];
    return found && time < found.to ? found : undefined;
  };

  const groups = page.groups.map((group) => ({ ...group, charts: [], range: [group.from, group.to] }));
  const zoom = (group, from, to) => {
    group.range = [from, to];
    for (const chart of group.charts) chart.setScale("x", { min: from, max: to });
    body.dataset.from = from;
    body.dataset.to = to;
  };

  // Draws the blocks of one colour in one path; returns how many there are in sight.
  const blocks = (chart, stretches, colour, top, height) => {
    const { min, max } = chart.scales.x;
    const context = chart.ctx;
    let count = 0;
    context.beginPath();
    for (const { from, to } of stretches) {
      if (to <= min || from >= max) continue;
      const left = chart.valToPos(Math.max(from, min), "x", true);
      context.rect(left, top, chart.valToPos(Math.min(to, max), "x", true) - left, height);
      count += 1;
    }
    context.fillStyle = colour;
    context.fill();
    return count;
  };
  const clipped = (chart, draw) => {
    const { left, top, width, height } = chart.bbox;
    chart.ctx.save();
    chart.ctx.beginPath();
    chart.ctx.rect(left, top, width, height);
    chart.ctx.clip();
    draw(left, top, width, height);
    chart.ctx.restore();
  };
  const shade = (foot) => (chart) => clipped(chart, (left, top, width, height) => {
    for (const state of Object.keys(STATES)) {
      const count = blocks(chart, foot.byState[state], colours[state], top, height);
      chart.root.dataset["shaded_" + state] = count;
    }
  });

  const xAxis = (group, shown) => ({
    show: true, stroke: () => colours.text, font: FONT, size: shown ? 24 : 8,
    label: shown ? group.title : undefined, labelSize: 20, labelGap: 0, labelFont: FONT, gap: 3,
    values: shown ? (chart, splits) => splits.map((value) => String(+value.toFixed(6))) : () => [],
    grid: { stroke: () => colours.grid, width: 1 }, ticks: { show: shown, stroke: () => colours.grid, size: 4 },
  });
  const yAxis = (label, extra) => ({
    stroke: () => colours.text, font: FONT, size: AXIS_WIDTH - 18, gap: 4, label, labelSize: 18, labelGap: 0, labelFont: FONT,
    grid: { stroke: () => colours.grid, width: 1 }, ticks: { show: false }, ...extra,
  });

  const options = (foot, group, height, last, hooks) => ({
    width: 600, height: height + (last ? 36 : 0), padding: [6, 24, 0, 0],
    legend: { show: false },
    scales: { x: { time: false, range: () => group.range }, y: { auto: false } },
    cursor: {
      y: false, points: { show: false },
      drag: { x: true, y: false, setScale: false },
      // Where the cursor is goes to all charts; what is dragged is that chart's own.
      sync: { key: group.key, filters: { pub: (type) => type === "mousemove" || type === "mouseleave" } },
      bind: { dblclick: () => () => zoom(group, group.from, group.to) },
    },
    hooks: {
      drawClear: [shade(foot)],
      setSelect: [(chart) => {
        const { left, width } = chart.select;
        if (width < 3) return;
        chart.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
        zoom(group, chart.posToVal(left, "x"), chart.posToVal(left + width, "x"));
      }],
      ...hooks,
    },
  });

  const place = (foot, group, chart, name) => {
    chart.root.dataset.panel = name;
    group.charts.push(chart);
    foot.charts.push(chart);
  };

  const linePanel = (foot, group, line, parent) => {
    const data = unpackLine(line, foot.shift);
    line.data = data;
    const isLoad = line.kind === "load";
    const padding = isLoad ? 0.06 * (line.high - line.low) || 1 : 0.04;
    const range = [line.low - padding, line.high + padding];
    const settings = options(foot, group, isLoad ? 124 : 112, false, {});
    settings.axes = [xAxis(group, false), yAxis(line.name, isLoad ? {} : { splits: () => [0, 0.5, 1] })];
    settings.scales.y.range = range;
    settings.series = [{}, { stroke: () => colours[line.kind], width: 1.5, spanGaps: false, points: { size: 4 } }];
    const chart = new uPlot(settings, data, parent);
    place(foot, group, chart, line.kind);
    const values = data[1].filter((value) => value !== null);
    Object.assign(chart.root.dataset, {
      name: line.name, points: values.length,
      low: values.reduce((a, b) => Math.min(a, b), Infinity), high: values.reduce((a, b) => Math.max(a, b), -Infinity),
      first: data[0][0], last: data[0][data[0].length - 1],
    });
  };

  // Where a touch-down or lift-off was: a triangle that points down or up.
  const triangle = (context, x, middle, half, wide, up) => {
    context.moveTo(x, middle + (up ? -half : half));
    context.lineTo(x - wide, middle + (up ? half : -half));
    context.lineTo(x + wide, middle + (up ? half : -half));
    context.closePath();
  };
  const drawTracks = (foot) => (chart) => clipped(chart, (left, top, width, height) => {
    const pixels = devicePixelRatio;
    const row = (name) => chart.valToPos(foot.rows.indexOf(name) + 0.5, "y", true);
    const half = 6 * pixels;
    chart.root.dataset.decision = blocks(chart, foot.stable, colours.decision, row("decision") - half, 2 * half);
    if (foot.labels) chart.root.dataset.label = blocks(chart, foot.labels, colours.label, row("label") - half, 2 * half);
    const middle = row("events");
    chart.root.dataset.slips = blocks(chart, foot.slips, colours.slide, middle - half, 2 * half);
    const context = chart.ctx;
    context.beginPath();
    const { min, max } = chart.scales.x;
    const count = { touch_down: 0, lift_off: 0 };
    const inSight = foot.events.filter((event) => event.what in count && event.at >= min && event.at <= max);
    // Where they are many they become thin.
    const wide = Math.min(half, Math.max(0.5, width / (3 * inSight.length)));
    for (const event of inSight) {
      triangle(context, chart.valToPos(event.at, "x", true), middle, half, wide, event.what === "lift_off");
      count[event.what] += 1;
    }
    context.fillStyle = colours.event;
    context.fill();
    chart.root.dataset.touch_downs = count.touch_down;
    chart.root.dataset.lift_offs = count.lift_off;
  });
  const trackPanel = (foot, group, parent) => {
    // Charts count from the bottom.
    foot.rows = [...foot.tracks].reverse();
    const count = foot.rows.length;
    const settings = options(foot, group, 20 * count + 16, true, { draw: [drawTracks(foot)] });
    settings.scales.y.range = [0, count];
    settings.axes = [xAxis(group, true), yAxis(undefined, {
      size: AXIS_WIDTH, grid: { show: false },
      splits: () => foot.rows.map((_, k) => k + 0.5), values: () => foot.rows,
    })];
    settings.series = [{}, { show: false }];
    const ends = [[group.from, group.to], [null, null]];
    place(foot, group, new uPlot(settings, ends, parent), "tracks");
  };

  const readout = (foot, group) => (chart) => {
    const left = chart.cursor.left;
    foot.readout.replaceChildren();
    if (left === null || left === undefined || left < 0) return;
    const time = chart.posToVal(left, "x");
    const say = (text) => make("span", foot.readout, text);
    say(`t ${time.toFixed(4)} s`);
    for (const line of foot.lines) {
      const value = line.data[1][before(line.data[0].length, (k) => line.data[0][k], time)];
      if (value !== undefined && value !== null) say(`${line.name} ${line.kind === "load" ? value.toPrecision(4) : value.toFixed(3)}`);
    }
    const decision = stretchAt(foot.decisions, time);
    if (decision) say(`decision: ${decision.is.replace("_", " ")}`);
    const state = stretchAt(foot.states, time);
    if (state) say(`state: ${state.is.replace("_", " ")}`);
    const label = foot.allLabels && stretchAt(foot.allLabels, time);
    if (label) say(`label: ${label.is.replace("_", " ")}`);
    const slip = stretchAt(foot.slips, time);
    if (slip) say(`slip of ${slip.distance === null ? "an unknown distance" : (1e3 * slip.distance).toFixed(1) + " mm"}`);
  };

  const describe = (foot) => {
    const parts = [`${grouped(foot.samples)} samples`, `${+foot.duration.toFixed(3)} s at ${+foot.rate.toFixed(3)} Hz`];
    parts.push(counted(foot.counts.touch_down, "touch-down", "touch-downs"), counted(foot.counts.lift_off, "lift-off", "lift-offs"));
    const slips = counted(foot.counts.slip_start, "slip", "slips");
    const distance = foot.slipped;
    const together = distance < 1 ? `${(1e3 * distance).toFixed(1)} mm` : `${distance.toFixed(2)} m`;
    parts.push(distance > 0 ? `${slips}, ${together} together` : slips);
    const unstable = foot.counts.unstable_start;
    if (unstable > 0) parts.push(`${counted(unstable, "stance", "stances")} never stable`);
    if (foot.left_out > 0) parts.push(`${grouped(foot.left_out)} more events in the table (--events)`);
    return parts.join(" · ");
  };

  const unpackFoot = (foot) => {
    foot.charts = [];
    foot.states = unpackStretches(foot.states, page.states, foot.shift);
    foot.byState = {};
    for (const state of Object.keys(STATES)) foot.byState[state] = foot.states.filter((stretch) => stretch.is === state);
    foot.decisions = unpackStretches(foot.decisions, page.decisions, foot.shift);
    foot.stable = foot.decisions.filter((stretch) => stretch.is === "stable");
    foot.allLabels = foot.labels && unpackStretches(foot.labels, page.labels, foot.shift);
    foot.labels = foot.allLabels && foot.allLabels.filter((stretch) => stretch.is === "stable");
    foot.events = foot.events.map(([at, what, duration, distance]) => ({
      at: foot.shift + at / 1e6, what: page.events[what],
      duration: duration === null ? null : duration / 1e6, distance,
    }));
    foot.slips = foot.events.filter((event) => event.what === "slip_start").map((event) => ({
      from: event.at, to: event.duration === null ? foot.shift + foot.from + foot.duration : event.at + event.duration,
      distance: event.distance,
    }));
  };

  const legend = () => {
    const parent = document.getElementById("legend");
    parent.replaceChildren();
    const entry = (colour, text, name) => {
      const span = make("span", parent);
      const swatch = make("i", span, undefined, name);
      swatch.style.background = `var(--${colour})`;
      make("span", span, text);
    };
    const lines = new Map(page.feet.flatMap((foot) => foot.lines.map((line) => [line.kind, line.kind === "load" ? "load" : line.name])));
    for (const [kind, name] of lines) entry(kind, name, "line");
    for (const [state, name] of Object.entries(STATES)) {
      if (page.feet.some((foot) => foot.byState[state].length > 0)) entry(state, name);
    }
    entry("decision", "decision: stable");
    if (page.feet.some((foot) => foot.labels)) entry("label", "label: stable");
    entry("slide", "event: slip");
    make("span", parent, "▼ touch-down");
    make("span", parent, "▲ lift-off");
  };

  const fit = () => {
    const width = document.getElementById("feet").clientWidth;
    for (const group of groups) for (const chart of group.charts) chart.setSize({ width, height: chart.height });
  };
  const setTheme = (theme) => {
    root.dataset.theme = theme;
    readColours();
    for (const group of groups) for (const chart of group.charts) chart.redraw(true);
  };

  const system = matchMedia("(prefers-color-scheme: dark)");
  setTheme(system.matches ? "dark" : "light");
  page.feet.forEach(unpackFoot);
  document.getElementById("title").textContent = page.title;
  const samples = page.feet.reduce((sum, foot) => sum + foot.samples, 0);
  document.getElementById("counts").textContent = `${counted(page.feet.length, "foot", "feet")}, ${grouped(samples)} samples · ${page.program}`;
  legend();
  groups.forEach((group, k) => { group.key = "group" + k; });
  for (const foot of page.feet) {
    const group = groups[foot.group];
    const section = make("section", document.getElementById("feet"));
    section.dataset.foot = foot.name;
    section.dataset.samples = foot.samples;
    const head = make("div", section, undefined, "head");
    if (foot.name !== page.title) make("h2", head, foot.name);
    make("span", head, describe(foot), "faint");
    foot.readout = make("div", section, undefined, "readout faint");
    for (const line of foot.lines) linePanel(foot, group, line, section);
    trackPanel(foot, group, section);
    const tracks = foot.charts[foot.charts.length - 1];
    (tracks.hooks.setCursor ||= []).push(readout(foot, group));
  }
  fit();
  for (const group of groups) zoom(group, group.from, group.to);
  let pending = 0;
  addEventListener("resize", () => {
    clearTimeout(pending);
    pending = setTimeout(fit, 60);
  });
  system.addEventListener("change", () => setTheme(system.matches ? "dark" : "light"));
  document.getElementById("theme").addEventListener("click", () => setTheme(root.dataset.theme === "dark" ? "light" : "dark"));
  document.getElementById("whole").addEventListener("click", () => groups.forEach((group) => zoom(group, group.from, group.to)));
  // Charts draw in a microtask.
  setTimeout(() => {
    body.dataset.feet = page.feet.length;
    body.dataset.panels = groups.reduce((sum, group) => sum + group.charts.length, 0);
    body.dataset.ready = "true";
  }, 0);
})();
