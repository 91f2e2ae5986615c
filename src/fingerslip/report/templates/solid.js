"use strict";
// A solid that turns: drag to turn, wheel or pinch to zoom, arrow keys to turn, plus and minus to zoom.

const VERTEX = `#version 300 es
in vec3 place; in vec3 normal; in vec3 colour; in float depth;
uniform mat4 view; uniform mat3 turn;
out vec3 shade; out float behind; out vec3 facing;
void main() { gl_Position = view * vec4(place, 1.0); facing = turn * normal; shade = colour; behind = depth; }`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 shade; in float behind; in vec3 facing;
uniform float cut; uniform float lit;
out vec4 pixel;
void main() {
  if (cut > 0.5 && behind > 0.0) discard;
  float light = mix(1.0, 0.45 + 0.55 * abs(normalize(facing).z) , lit);
  pixel = vec4(shade * light, 1.0);
}`;

function program(gl) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  return made;
}

const rgb = (text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16) / 255);
const STATES = language.states.map(rgb);
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

class Solid {
  constructor(canvas, run, redraw) {
    Object.assign(this, { canvas, run, turn: -0.62, tilt: 0.34, zoom: 1, open: true });
    canvas.classList.add("turn");
    canvas.tabIndex = 0;
    canvas.setAttribute("aria-label", `${canvas.getAttribute("aria-label")} Drag or use the arrow keys to turn, plus and minus to zoom.`);
    this.gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (this.gl) this.program = program(this.gl);
    this.normals = new Map();
    Object.assign(this, { low: run.body.low, high: run.body.high });
    this.pointers(canvas, redraw);
  }

  pointers(canvas, redraw) {
    canvas.onpointerdown = (event) => { canvas.setPointerCapture(event.pointerId); this.last = [event.clientX, event.clientY]; };
    canvas.onpointermove = (event) => {
      if (!event.buttons || !this.last) return;
      this.turn += 0.01 * (event.clientX - this.last[0]);
      this.tilt = Math.min(1.57, Math.max(-1.57, this.tilt + 0.01 * (event.clientY - this.last[1])));
      this.last = [event.clientX, event.clientY];
      redraw();
    };
    canvas.onwheel = (event) => {
      event.preventDefault();
      this.zoom = Math.min(8, Math.max(0.5, this.zoom * Math.exp(-0.001 * event.deltaY)));
      redraw();
    };
    canvas.onkeydown = (event) => {
      const steps = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
      if (steps[event.key]) { this.turn += steps[event.key][0]; this.tilt += steps[event.key][1]; }
      else if (event.key === "+") this.zoom *= 1.15;
      else if (event.key === "-") this.zoom /= 1.15;
      else return;
      event.preventDefault();
      redraw();
    };
  }

  draw(frame, field) {
    const { gl, canvas } = this;
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth || 500, height = Math.round(width * 0.8);
    canvas.style.height = `${height}px`;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    if (!gl) return;
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(1, 1, 1, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(this.program);
    this.camera(width / height);
    this.places = this.moved(frame);
    this.surface(frame, field);
    this.outlines(frame);
  }

  // Where the contact can be seen: the plate is an outline.
  fromBelow() { this.tilt = Math.min(this.tilt, -0.9); }

  camera(aspect) {
    const { gl } = this, [ct, st, ca, sa] = [Math.cos(this.turn), Math.sin(this.turn), Math.cos(this.tilt), Math.sin(this.tilt)];
    const rows = [[ct, 0, st], [sa * st, ca, -sa * ct], [-ca * st, sa, ca * ct]];
    const middle = this.low.map((low, i) => 0.5 * (low + this.high[i]));
    const size = 0.6 * Math.hypot(...this.low.map((low, i) => this.high[i] - low)) / this.zoom;
    const scale = [1 / size, aspect / size, -0.2 / size];
    const view = new Float32Array(16);
    rows.forEach((row, i) => {
      for (let c = 0; c < 3; c++) view[4 * c + i] = scale[i] * row[c];
      view[12 + i] = -scale[i] * (row[0] * middle[0] + row[1] * middle[1] + row[2] * middle[2]);
    });
    view[15] = 1;
    gl.uniformMatrix4fv(gl.getUniformLocation(this.program, "view"), false, view);
    gl.uniformMatrix3fv(gl.getUniformLocation(this.program, "turn"), false,
      new Float32Array([0, 1, 2].flatMap((c) => rows.map((row) => row[c]))));
    gl.uniform1f(gl.getUniformLocation(this.program, "cut"), this.open ? 1 : 0);
  }

  moved(frame) {
    const { points, moved, body } = this.run, base = frame * points.length, places = new Float32Array(points.length);
    for (let i = 0; i < points.length; i++) places[i] = points[i] * body.unit + moved[base + i] * body.movedUnit;
    return places;
  }

  surface(frame, field) {
    const { run, places } = this, count = run.points.length / 3, chosen = [];
    for (let t = 0; t < run.triangleRegion.length; t++) {
      if (run.triangleCut[t] && !this.open) continue;
      chosen.push(run.triangles[3 * t], run.triangles[3 * t + 1], run.triangles[3 * t + 2]);
    }
    const colours = new Float32Array(3 * count), depth = new Float32Array(count);
    const layer = new Uint8Array(count);
    for (let t = 0; t < run.triangleRegion.length; t++) for (let c = 0; c < 3; c++) layer[run.triangles[3 * t + c]] = run.triangleRegion[t];
    const layers = run.body.regions.map(({ colour }) => rgb(colour)), stiff = run.body.regions.map((one) => one.stiff);
    for (let v = 0; v < count; v++) {
      const state = run.vertexState[frame * count + v];
      const shade = field === "layers" || (field !== "contact" && stiff[layer[v]]) ? layers[layer[v]]
        : field === "contact" ? (state < 255 ? STATES[state] : layers[layer[v]])
          : mapColour(run.stress[frame * count + v] * run.body.stressUnit / run.body.top).map((one) => one / 255);
      colours.set(shade, 3 * v);
      // Vertices in the cut itself are kept.
      depth[v] = run.points[3 * v + 2] * run.body.unit - run.body.cutAt - 2e-3;
    }
    this.buffers({ place: [places, 3], normal: [this.smooth(places, chosen), 3], colour: [colours, 3], depth: [depth, 1] });
    const { gl } = this, index = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, index);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(chosen), gl.STREAM_DRAW);
    gl.uniform1f(gl.getUniformLocation(this.program, "lit"), 1);
    gl.drawElements(gl.TRIANGLES, chosen.length, gl.UNSIGNED_INT, 0);
    gl.deleteBuffer(index);
  }

  smooth(places, triangles) {
    const normals = new Float32Array(places.length);
    const at = (v) => [places[3 * v], places[3 * v + 1], places[3 * v + 2]];
    for (let t = 0; t < triangles.length; t += 3) {
      const [a, b, c] = [0, 1, 2].map((i) => at(triangles[t + i]));
      const normal = cross(b.map((one, i) => one - a[i]), c.map((one, i) => one - a[i]));
      for (let i = 0; i < 3; i++) for (let k = 0; k < 3; k++) normals[3 * triangles[t + i] + k] += normal[k];
    }
    return normals;
  }

  // Counterfaces as outlines, and an arrow along the slide.
  outlines(frame) {
    const { body } = this.run, lines = [], half = 0.55 * Math.max(this.high[0] - this.low[0], this.high[2] - this.low[2]);
    for (const plate of body.plates[frame]) {
      for (const line of plate.lines) for (let i = 1; i < line.length; i++) lines.push(line[i - 1], line[i]);
      if (!body.slide.some(Boolean)) continue;
      const along = body.slide, across = cross(plate.normal, along);
      const corner = (a, b) => plate.centre.map((one, i) => one + half * (a * along[i] + b * across[i]));
      const tip = corner(0.95, 0.8);
      lines.push(corner(0.35, 0.8), tip, corner(0.83, 0.88), tip, corner(0.83, 0.72), tip);
    }
    const places = new Float32Array(lines.flat());
    this.buffers({ place: [places, 3], normal: [places.slice(), 3], colour: [new Float32Array(places.length), 3],
      depth: [new Float32Array(lines.length).fill(-1), 1] });
    this.gl.uniform1f(this.gl.getUniformLocation(this.program, "lit"), 0);
    this.gl.drawArrays(this.gl.LINES, 0, lines.length);
  }

  buffers(values) {
    const { gl } = this;
    (this.old || []).forEach((buffer) => gl.deleteBuffer(buffer));
    this.old = Object.entries(values).map(([name, [data, size]]) => {
      const buffer = gl.createBuffer(), at = gl.getAttribLocation(this.program, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STREAM_DRAW);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, size, gl.FLOAT, false, 0, 0);
      return buffer;
    });
  }
}
