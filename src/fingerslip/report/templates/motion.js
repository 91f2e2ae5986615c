"use strict";
// A run in motion: the deformed body, the slip map and the signals, all at the time of one slider.

const language = JSON.parse(document.getElementById("colour-language").textContent);
const runs = Array.from(document.querySelectorAll("script[data-motion]"));
const TYPES = { u1: Uint8Array, i2: Int16Array, u2: Uint16Array, u4: Uint32Array, f4: Float32Array };
// Words in plots: their font, the height of a line of them, the length of a colour before a name and the gap behind it.
const FONT = "12px system-ui, sans-serif", LINE = 17, KEY = 18, GAP = 10;
// Slanted names of events: the width of one, and how far one is from the next.
const NAME = 70, APART = 21;
const OPEN_MAP = language.map.map((text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16)));

async function unpack(script) {
  const run = JSON.parse(script.textContent);
  const bytes = Uint8Array.from(atob(run.data), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  const buffer = await new Response(stream).arrayBuffer();
  for (const [name, own] of Object.entries(run.arrays)) {
    const count = own.shape.reduce((product, size) => product * size, 1);
    run[name] = new TYPES[own.type](buffer, own.at, count);
  }
  for (const name of ["moved", "stress"]) if (run[name]) addUp(run[name], run.arrays[name].shape);
  return run;
}

// Frames are stored as differences; typed arrays wrap round as they did when the differences were made.
function addUp(values, shape) {
  const size = values.length / shape[0];
  for (let at = size; at < values.length; at++) values[at] += values[at - size];
}

function mapColour(share) {
  const at = Math.min(Math.max(share, 0), 1) * (OPEN_MAP.length - 1), low = Math.floor(at);
  const high = Math.min(low + 1, OPEN_MAP.length - 1), part = at - low;
  return OPEN_MAP[low].map((value, i) => Math.round(value + part * (OPEN_MAP[high][i] - value)));
}

function nearest(values, wanted) {
  let best = 0;
  for (let i = 1; i < values.length; i++) if (Math.abs(values[i] - wanted) < Math.abs(values[best] - wanted)) best = i;
  return best;
}

function prepare(canvas, height) {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth || 500;
  canvas.style.height = `${height}px`;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  const draw = canvas.getContext("2d");
  draw.setTransform(ratio, 0, 0, ratio, 0, 0);
  draw.clearRect(0, 0, width, height);
  draw.font = FONT;
  return [draw, width, height];
}

// Ticks at round numbers, about `count` of them.
function ticks(low, high, count) {
  const rough = (high - low) / count || 1, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((one) => one >= rough * 0.999);
  const found = [];
  for (let at = Math.ceil(low / step - 1e-9) * step; at <= high + 1e-9 * step; at += step) found.push(at);
  return [found, Math.max(0, -Math.floor(Math.log10(step) + 1e-9))];
}

class Plots {
  constructor(canvas, run, choose) {
    Object.assign(this, { canvas, run, left: 56, right: 18 });
    const pick = (event) => {
      const share = (event.offsetX - this.left) / (canvas.clientWidth - this.left - this.right);
      choose(this.from + share * (this.to - this.from));
    };
    canvas.onpointerdown = pick;
    canvas.onpointermove = (event) => { if (event.buttons) pick(event); };
    this.from = run.times[0];
    this.to = run.times[run.times.length - 1];
  }

  draw(now) {
    const run = this.run, names = run.events.length || run.slide !== null ? 84 : 8;
    this.width = this.canvas.clientWidth || 500;
    const measure = this.canvas.getContext("2d");
    measure.font = FONT;
    const rows = [...(run.solid ? [] : [{ label: run.mapLabel, lines: [], map: true, height: 130 }]),
      ...run.panels.map((panel) => ({ ...panel, height: 112 }))];
    let top = names;
    for (const row of rows) {
      row.texts = this.texts(measure, row);
      row.heading = top;
      row.top = top + 4 + LINE * (1 + row.texts.reduce((last, text) => Math.max(last, text.line), 0));
      top = row.top + row.height + 8;
    }
    [this.draw2d] = prepare(this.canvas, top + 40);
    for (const row of rows) if (row.map) this.map(row); else this.panel(row);
    this.timeAxis(top);
    this.marks(names, top - 8, now);
    for (const row of rows) this.heading(row);
  }

  // The label of a row and the key to its lines, which has its own lines of text where there is no room beside the label.
  texts(measure, { label, lines }) {
    const right = this.width - this.right, wide = (text) => measure.measureText(text).width;
    const found = [{ text: label, at: this.left, line: 0, wide: wide(label) }];
    const entries = lines.map((line) => ({ ...line, text: line.name, wide: wide(line.name) + KEY }));
    const all = entries.reduce((sum, entry) => sum + entry.wide + GAP, -GAP), beside = right - all;
    let line = 0, at = beside;
    if (beside < this.left + found[0].wide + GAP) [line, at] = [1, this.left];
    for (const entry of entries) {
      if (line && at > this.left && at + entry.wide > right) [line, at] = [line + 1, this.left];
      found.push({ ...entry, at, line });
      at += entry.wide + GAP;
    }
    return found;
  }

  x(time) { return this.left + (time - this.from) / (this.to - this.from) * (this.width - this.left - this.right); }

  frame(row, low, high) {
    const draw = this.draw2d, y = (value) => row.top + row.height * (1 - (value - low) / (high - low));
    const [values, digits] = ticks(low, high, 4);
    draw.textAlign = "right";
    draw.textBaseline = "middle";
    for (const value of values) {
      draw.strokeStyle = "#e6e6e6";
      draw.beginPath(); draw.moveTo(this.left, y(value)); draw.lineTo(this.width - this.right, y(value)); draw.stroke();
      draw.fillStyle = "#333";
      draw.fillText(value.toFixed(digits), this.left - 6, y(value));
    }
    return y;
  }

  map(row) {
    const { times, along, states } = this.run, count = along.length;
    const y = this.frame(row, along[0], along[count - 1]), draw = this.draw2d;
    for (let t = 0; t < times.length; t++) {
      const x0 = this.x(times[t]), x1 = t + 1 < times.length ? this.x(times[t + 1]) : x0 + 1;
      for (let i = 0; i < count; i++) {
        draw.fillStyle = language.states[states[t * count + i]];
        const low = i ? 0.5 * (along[i] + along[i - 1]) : along[0];
        const high = i + 1 < count ? 0.5 * (along[i] + along[i + 1]) : along[count - 1];
        draw.fillRect(x0, y(high), x1 - x0 + 0.6, y(low) - y(high) + 0.6);
      }
    }
  }

  panel(row) {
    const values = row.lines.flatMap((line) => Array.from(this.run[line.array]).filter(Number.isFinite));
    const low = Math.min(0, ...values), high = Math.max(...values, low + 1e-9) * 1.04;
    const y = this.frame(row, low, high), draw = this.draw2d;
    for (const line of row.lines) {
      [draw.strokeStyle, draw.lineWidth] = [line.colour, line.width];
      draw.setLineDash(line.dash);
      draw.beginPath();
      let pen = false;
      this.run[line.array].forEach((value, i) => {
        if (!Number.isFinite(value)) { pen = false; return; }
        if (pen) draw.lineTo(this.x(this.run.times[i]), y(value)); else draw.moveTo(this.x(this.run.times[i]), y(value));
        pen = true;
      });
      draw.stroke();
    }
    draw.setLineDash([]);
    draw.lineWidth = 1;
  }

  // Drawn after the marks of events, which would cross the words.
  heading(row) {
    const draw = this.draw2d;
    draw.textAlign = "left";
    draw.textBaseline = "middle";
    for (const { text, colour, at, line, wide, width, dash } of row.texts) {
      const middle = row.heading + LINE * (line + 0.5);
      draw.fillStyle = "#fff";
      draw.fillRect(at - 2, middle - LINE / 2, wide + 4, LINE);
      draw.fillStyle = colour ? "#333" : "#000";
      draw.fillText(text, at + (colour ? KEY : 0), middle);
      if (!colour) continue;
      [draw.strokeStyle, draw.lineWidth] = [colour, 1.2 * width];
      draw.setLineDash(dash);
      draw.beginPath(); draw.moveTo(at, middle); draw.lineTo(at + KEY - 4, middle); draw.stroke();
      draw.setLineDash([]);
    }
    draw.lineWidth = 1;
  }

  timeAxis(top) {
    const draw = this.draw2d, [values, digits] = ticks(this.from, this.to, Math.max(3, this.width / 90));
    draw.textAlign = "center";
    draw.textBaseline = "top";
    draw.fillStyle = "#333";
    for (const value of values) draw.fillText(value.toFixed(digits), this.x(value), top);
    draw.fillText("time [s]", 0.5 * (this.left + this.width - this.right), top + 16);
  }

  marks(top, bottom, now) {
    const draw = this.draw2d, run = this.run;
    const lines = [...(run.slide === null ? [] : [{ name: "slide starts", time: run.slide, colour: language.grey, dash: [2, 2] }]),
      ...run.events];
    let reached = -Infinity;
    for (const [number, line] of lines.entries()) {
      const x = this.x(line.time), last = this.width - NAME - APART * (lines.length - 1 - number);
      draw.strokeStyle = line.colour;
      draw.lineWidth = 1.5;
      draw.setLineDash(line.dash);
      draw.beginPath(); draw.moveTo(x, top - 16); draw.lineTo(x, bottom); draw.stroke();
      reached = Math.min(Math.max(x, reached + APART), last);
      draw.save();
      draw.translate(reached, top - 20);
      draw.rotate(-0.75);
      draw.textAlign = "left";
      draw.textBaseline = "middle";
      draw.fillStyle = line.colour;
      draw.fillText(line.name, 0, 0);
      draw.restore();
    }
    draw.setLineDash([]);
    draw.strokeStyle = "#000";
    draw.lineWidth = 1.2;
    draw.beginPath(); draw.moveTo(this.x(now), top - 8); draw.lineTo(this.x(now), bottom); draw.stroke();
    draw.lineWidth = 1;
  }
}

class Section {
  constructor(canvas, run) {
    Object.assign(this, { canvas, run });
    // Around the section at all times.
    const { low, high } = run.body;
    this.box = [low[0], high[0], low[1], high[1]];
  }

  at(frame, node) {
    const { body, points, moved } = this.run, base = frame * points.length;
    return [0, 1].map((c) => points[2 * node + c] * body.unit + moved[base + 2 * node + c] * body.movedUnit);
  }

  // The whole section above, and a close view of the contact below it.
  draw(frame, field) {
    const wide = this.canvas.clientWidth || 500, [whole, close] = [this.whole(), this.closer(frame)];
    const high = ([x0, x1, y0, y1]) => Math.round(wide * (y1 - y0) / (x1 - x0));
    const [draw, width, height] = prepare(this.canvas, high(whole) + 12 + high(close));
    this.part(draw, frame, field, whole, [0, high(whole), width], false);
    this.part(draw, frame, field, close, [height - high(close), high(close), width], true);
  }

  part(draw, frame, field, [x0, x1, y0], [top, height, width], close) {
    const scale = width / (x1 - x0), to = ([x, y]) => [(x - x0) * scale, top + height - (y - y0) * scale];
    draw.save();
    draw.beginPath(); draw.rect(0, top, width, height); draw.clip();
    this.cells(draw, frame, field, to);
    for (const plate of this.run.body.plates[frame]) this.plate(draw, plate, to, width);
    this.skin(draw, frame, to, close);
    for (const kind of this.run.body.receptors) {
      draw.fillStyle = kind.colour;
      draw.strokeStyle = "#fff";
      for (const node of kind.nodes) {
        const [x, y] = to(this.at(frame, node));
        draw.beginPath(); draw.arc(x, y, close ? 5 : 1.6, 0, 7); draw.fill();
        if (close) draw.stroke();
      }
    }
    this.scaleBar(draw, scale, top, close ? 0.5 : 5);
    draw.restore();
  }

  whole() {
    const [x0, x1, y0, y1] = this.box, pad = 0.04 * (x1 - x0);
    return [x0 - pad, x1 + pad, y0 - 1.6 * pad, y1 + 2.2 * pad];
  }

  // Around what touches, or what is nearest to the plate where nothing does; most of it is the body.
  closer(frame) {
    const { skin, skinStates, body } = this.run, { normal: [n, m] } = body.plates[frame][0] || { normal: [0, 1] };
    const places = Array.from(skin, (node) => this.at(frame, node)), height = ([x, y]) => n * x + m * y;
    const touching = places.filter((_, i) => skinStates[frame * skin.length + i]);
    places.sort((a, b) => height(a) - height(b));
    const near = touching.length ? touching : places.slice(0, Math.ceil(places.length / 4));
    const half = 0.11 * (this.box[1] - this.box[0]), inside = 0.385 * half;
    const [x, y] = [0, 1].map((c) => near.reduce((sum, place) => sum + place[c], 0) / near.length + inside * [n, m][c]);
    return [x - half, x + half, y - 0.565 * half, y + 0.565 * half];
  }

  cells(draw, frame, field, to) {
    const { body, cells, region, stress, arrays } = this.run, corners = arrays.cells.shape[1], count = arrays.cells.shape[0];
    const places = [], nodes = this.run.points.length / 2;
    for (let node = 0; node < nodes; node++) places.push(to(this.at(frame, node)));
    for (let cell = 0; cell < count; cell++) {
      const layer = body.regions[region[cell]];
      const colour = field === "layers" || layer.stiff ? layer.colour
        : `rgb(${mapColour(stress[frame * count + cell] * body.stressUnit / body.top)})`;
      draw.fillStyle = draw.strokeStyle = colour;
      draw.beginPath();
      for (let c = 0; c < corners; c++) draw.lineTo(...places[cells[cell * corners + c]]);
      draw.closePath(); draw.fill(); draw.stroke();
    }
  }

  plate(draw, plate, to, width) {
    const [x, y] = to(plate.centre);
    draw.strokeStyle = "#000";
    draw.lineWidth = 2;
    for (const line of plate.lines) {
      draw.beginPath();
      for (const point of line) draw.lineTo(...to(point));
      draw.stroke();
    }
    draw.lineWidth = 1;
    const [u, v] = this.run.body.slide;
    if (!u && !v) return;
    // A flat one has its arrow in the middle of the picture, a curved one at its contact, on the side off the body.
    const middle = plate.flat ? (width * 0.5 - x) * u : 0, [n, m] = plate.normal;
    const at = (along, off) => [x + (middle + along) * u - (12 + off) * n, y - (middle + along) * v + (12 + off) * m];
    draw.fillStyle = "#000";
    draw.beginPath(); draw.moveTo(...at(-34, 0)); draw.lineTo(...at(34, 0)); draw.stroke();
    draw.beginPath(); draw.moveTo(...at(41, 0)); draw.lineTo(...at(34, -4)); draw.lineTo(...at(34, 4)); draw.fill();
  }

  skin(draw, frame, to, close) {
    const { skin, skinStates } = this.run;
    draw.lineWidth = 0.5;
    draw.strokeStyle = "#333";
    for (let i = 0; i < skin.length; i++) {
      const state = skinStates[frame * skin.length + i];
      if (!state) continue;
      const [x, y] = to(this.at(frame, skin[i]));
      draw.fillStyle = language.states[state];
      draw.beginPath(); draw.arc(x, y, close ? 6 : 2.6, 0, 7); draw.fill(); draw.stroke();
    }
    draw.lineWidth = 1;
  }

  scaleBar(draw, scale, top, length) {
    draw.fillStyle = "rgba(255, 255, 255, 0.85)";
    draw.fillRect(4, top, Math.max(length * scale, 44) + 12, 22);
    draw.fillStyle = "#000";
    draw.fillRect(10, top + 16, length * scale, 2);
    draw.textAlign = "left";
    draw.textBaseline = "bottom";
    draw.fillText(`${length} mm`, 10, top + 14);
  }
}

class Player {
  constructor(root) {
    this.root = root;
    this.find = (name) => root.querySelector(`[data-part=${name}]`);
    this.slider = this.find("time");
    this.slider.oninput = () => this.show(Number(this.slider.value));
    this.find("play").onclick = () => this.toggle();
    this.find("run").onchange = (event) => this.load(event.target.value);
    this.find("field").onchange = ({ target }) => {
      if (target.value === "contact") this.body.fromBelow();
      this.redraw();
    };
    this.find("open").onchange = () => this.redraw();
    window.addEventListener("resize", () => this.redraw());
    window.addEventListener("beforeprint", () => this.redraw());
    this.load(0);
  }

  async load(number) {
    this.stop();
    const run = this.run = await unpack(runs[number]);
    this.slider.max = run.times.length - 1;
    this.plots = new Plots(this.find("plots"), run, (time) => this.show(nearest(run.times, time)));
    // A canvas keeps the kind of its first drawing, so each run gets a new one.
    const old = this.find("body"), canvas = old.cloneNode(false);
    old.replaceWith(canvas);
    this.root.classList.toggle("plots", !run.body);
    this.body = run.body && (run.solid ? new Solid(canvas, run, () => this.redraw()) : new Section(canvas, run));
    this.find("field").parentElement.hidden = this.find("bar").hidden = !run.body;
    this.find("field").querySelector("[value=contact]").hidden = !run.solid;
    this.find("open").parentElement.hidden = !run.body || !run.solid;
    this.keys();
    const moment = run.events.length ? run.events[0].time : run.slide ?? run.times[run.times.length - 1];
    this.show(nearest(run.times, moment));
    this.root.dataset.ready = "yes";
  }

  keys() {
    const entries = language.stateNames.map((name, state) => [name, language.states[state]])
      .concat(this.run.body ? this.run.body.receptors.map((kind) => [kind.kind, kind.colour]) : []);
    this.find("keys").replaceChildren(...entries.map(([name, colour]) => {
      const item = document.createElement("li");
      item.textContent = name;
      item.style.setProperty("--key", colour);
      return item;
    }));
  }

  show(index) {
    this.index = index;
    this.slider.value = index;
    this.redraw();
  }

  redraw() {
    const { run } = this;
    if (!run) return;
    const now = run.times[this.index], text = this.words(now);
    this.plots.draw(now);
    if (this.body) {
      const field = this.find("field").value;
      this.body.open = this.find("open").checked;
      this.body.draw(nearest(run.body.frames, now), field);
      this.bar(field);
      this.find("keys").hidden = run.solid && field !== "contact";
    }
    this.find("said").textContent = text;
    this.slider.setAttribute("aria-valuetext", text);
  }

  bar(field) {
    const bar = this.find("bar"), { body } = this.run;
    bar.hidden = field === "contact";
    if (field === "layers") {
      bar.replaceChildren(...body.regions.map(({ name, colour }) => {
        const item = document.createElement("span");
        item.innerHTML = `<b style="display:inline-block;width:1em;height:.8em;border:1px solid #777;background:${colour}"></b> `;
        item.append(name);
        return item;
      }));
      return;
    }
    const strip = document.createElement("i"), title = document.createElement("span");
    strip.style.background = `linear-gradient(to right, ${language.map.join()})`;
    title.textContent = body.field;
    const [values, digits] = ticks(0, body.top, 4);
    for (const value of values) {
      const mark = document.createElement("b");
      mark.textContent = value.toFixed(digits);
      mark.style.left = `${100 * value / body.top}%`;
      strip.append(mark);
    }
    bar.replaceChildren(strip, title);
  }

  words(now) {
    const { run } = this, parts = [`t = ${now.toFixed(3)} s`];
    if (run.slide !== null) {
      const since = now - run.slide;
      parts.push(since < 0 ? `${(-since).toFixed(3)} s before the slide` : `${since.toFixed(3)} s into the slide`);
    }
    const passed = run.events.filter((event) => event.time <= now + 1e-9);
    if (passed.length) parts.push(`after ${passed[passed.length - 1].name} slip`);
    const drawn = run.body && run.body.frames[nearest(run.body.frames, now)];
    if (run.body && Math.abs(drawn - now) > 5e-4) parts.push(`body at ${drawn.toFixed(3)} s`);
    return parts.join(", ");
  }

  toggle() {
    if (this.timer) { this.stop(); return; }
    this.find("play").textContent = "Pause";
    const step = () => {
      const last = this.run.times.length - 1;
      this.show(this.index >= last ? 0 : this.index + Math.max(1, Math.round(last / 150)));
      if (this.index >= last) this.stop();
    };
    this.timer = window.setInterval(step, 80);
  }

  stop() {
    window.clearInterval(this.timer);
    this.timer = null;
    this.find("play").textContent = "Play";
  }
}

document.addEventListener("DOMContentLoaded", () => {
  document.querySelectorAll(".motion").forEach((root) => new Player(root));
});
