// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

namespace mono3d::tools {

// The 3D view of a report: plain WebGL2, drawn when something changes.

inline constexpr char kModelViewHtml[] = R"html(<div class="view3d">
<canvas id="view3d" tabindex="0" aria-label="the model in 3D"></canvas>
<div class="view3d-controls">
<label>Colour by <select id="view3d-colour"><option value="0">image</option>
<option value="1">normal</option><option value="2">height</option></select></label>
<label><input id="view3d-path" type="checkbox" checked> path</label>
<button id="view3d-reset" type="button">Reset</button>
</div>
</div>
)html";

inline constexpr char kModelViewScript[] = R"js("use strict";
(() => {
  const canvas = document.getElementById("view3d");
  const surfelsElement = document.getElementById("surfels");
  const bytesOf = (id) => Uint8Array.from(
      atob(document.getElementById(id).textContent), (c) => c.charCodeAt(0));
  const surfels = bytesOf("surfels");
  const path = new Float32Array(bytesOf("path").buffer);
  const numSurfels = surfels.length / 12;
  const begin = {yaw: -0.6, pitch: 0.75, distance: 1.35, target: [0, 0, 0]};
  let camera = structuredClone(begin);
  let gl = null, surfelProgram = null, pathProgram = null, surfelArray = null, pathArray = null;

  const surfelVertex = `#version 300 es
    in vec2 corner; in vec3 position; in vec3 colour; in float radius; in vec2 normal;
    uniform mat4 toClip; uniform float extent, smallest, ratio; uniform int mode;
    out vec2 at; out vec3 shade;
    vec3 rainbow(float t) {
      return clamp(vec3(1.5 - abs(4.0 * t - 3.0), 1.5 - abs(4.0 * t - 2.0),
                        1.5 - abs(4.0 * t - 1.0)), 0.0, 1.0);
    }
    void main() {
      vec3 n = vec3(normal, 1.0 - abs(normal.x) - abs(normal.y));
      if (n.z < 0.0) {
        n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
      }
      n = normalize(n);
      vec3 u = normalize(cross(n, abs(n.z) < 0.9 ? vec3(0, 0, 1) : vec3(1, 0, 0)));
      vec3 v = cross(n, u);
      vec3 middle = (2.0 * position - 1.0) * extent;
      float r = smallest * pow(ratio, radius);
      at = corner;
      shade = mode == 0 ? colour : mode == 1 ? 0.5 * n + 0.5 : rainbow(0.5 + 0.8 * middle.z);
      gl_Position = toClip * vec4(middle + r * (corner.x * u + corner.y * v), 1);
    }`;
  const surfelFragment = `#version 300 es
    precision mediump float; in vec2 at; in vec3 shade; out vec4 colour;
    void main() { if (dot(at, at) > 1.0) discard; colour = vec4(shade, 1); }`;
  const pathVertex = `#version 300 es
    in vec3 position; uniform mat4 toClip;
    void main() { gl_Position = toClip * vec4(position, 1); }`;
  const pathFragment = `#version 300 es
    precision mediump float; out vec4 colour; void main() { colour = vec4(0.9, 0.25, 0.1, 1); }`;

  function makeProgram(vertex, fragment) {
    const program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text.trim());
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
      throw new Error(gl.getProgramInfoLog(program));
    }
    return program;
  }
  function attribute(program, name, size, type, normalised, stride, offset, divisor) {
    const at = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, type, normalised, stride, offset);
    gl.vertexAttribDivisor(at, divisor);
  }
  function buffer(data) {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
  }
  function start() {
    gl = canvas.getContext("webgl2", {antialias: true, preserveDrawingBuffer: true});
    if (!gl) {
      canvas.replaceWith("This browser has no WebGL2: the picture below shows the model.");
      document.querySelector(".view3d-controls").remove();
      return;
    }
    surfelProgram = makeProgram(surfelVertex, surfelFragment);
    pathProgram = makeProgram(pathVertex, pathFragment);
    surfelArray = gl.createVertexArray();
    gl.bindVertexArray(surfelArray);
    buffer(new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]));
    attribute(surfelProgram, "corner", 2, gl.FLOAT, false, 8, 0, 0);
    buffer(surfels);
    attribute(surfelProgram, "position", 3, gl.UNSIGNED_SHORT, true, 12, 0, 1);
    attribute(surfelProgram, "colour", 3, gl.UNSIGNED_BYTE, true, 12, 6, 1);
    attribute(surfelProgram, "radius", 1, gl.UNSIGNED_BYTE, true, 12, 9, 1);
    attribute(surfelProgram, "normal", 2, gl.BYTE, true, 12, 10, 1);
    pathArray = gl.createVertexArray();
    gl.bindVertexArray(pathArray);
    buffer(path);
    attribute(pathProgram, "position", 3, gl.FLOAT, false, 12, 0, 0);
    draw();
  }
  function axes() {
    const [sy, cy] = [Math.sin(camera.yaw), Math.cos(camera.yaw)];
    const [sp, cp] = [Math.sin(camera.pitch), Math.cos(camera.pitch)];
    return {right: [cy, sy, 0], up: [-sy * sp, cy * sp, cp], back: [sy * cp, -cy * cp, sp]};
  }
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  function toClip() {
    const {right, up, back} = axes();
    const f = 1.6, near = 0.02 * camera.distance, far = camera.distance + 12;
    const aspect = canvas.width / canvas.height;
    const [fx, fy] = aspect > 1 ? [f / aspect, f] : [f, f * aspect];
    const a = (far + near) / (near - far), b = 2 * far * near / (near - far);
    const t = camera.target, d = camera.distance;
    const [tx, ty, tz] = [-dot(right, t), -dot(up, t), -dot(back, t) - d];
    const column = (i) => [fx * right[i], fy * up[i], a * back[i], -back[i]];
    return new Float32Array([...column(0), ...column(1), ...column(2),
                             fx * tx, fy * ty, a * tz + b, -tz]);
  }
  let isDue = false;
  function draw() {
    if (isDue || !gl) return;
    isDue = true;
    requestAnimationFrame(() => {
      isDue = false;
      const scale = Math.min(devicePixelRatio || 1, 2);
      canvas.width = Math.max(1, Math.round(canvas.clientWidth * scale));
      canvas.height = Math.max(1, Math.round(canvas.clientHeight * scale));
      gl.viewport(0, 0, canvas.width, canvas.height);
      gl.clearColor(0.93, 0.94, 0.95, 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      const matrix = toClip();
      gl.useProgram(surfelProgram);
      const uniform = (name) => gl.getUniformLocation(surfelProgram, name);
      gl.uniformMatrix4fv(uniform("toClip"), false, matrix);
      for (const name of ["extent", "smallest", "ratio"]) {
        gl.uniform1f(uniform(name), Number(surfelsElement.dataset[name]));
      }
      gl.uniform1i(uniform("mode"), Number(document.getElementById("view3d-colour").value));
      gl.bindVertexArray(surfelArray);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, numSurfels);
      if (!document.getElementById("view3d-path").checked) return;
      gl.useProgram(pathProgram);
      gl.uniformMatrix4fv(gl.getUniformLocation(pathProgram, "toClip"), false, matrix);
      gl.bindVertexArray(pathArray);
      gl.drawArrays(gl.LINES, 0, path.length / 3);
    });
  }
  function turn(dx, dy) {
    camera.yaw -= 0.008 * dx;
    camera.pitch = Math.min(1.57, Math.max(-1.57, camera.pitch + 0.008 * dy));
    draw();
  }
  function move(dx, dy) {
    const {right, up} = axes();
    const step = camera.distance / canvas.clientHeight;
    camera.target = camera.target.map((t, i) => t + step * (dy * up[i] - dx * right[i]));
    draw();
  }
  function zoom(factor) {
    camera.distance = Math.min(10, Math.max(0.02, camera.distance * factor));
    draw();
  }
  const pointers = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
    pointers.set(event.pointerId, now);
    if (pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      const gap = (p) => Math.max(1, Math.hypot(p[0] - other[0], p[1] - other[1]));
      zoom(gap(before) / gap(now));
      move(dx / 2, dy / 2);
    } else if (event.buttons & 2 || event.shiftKey) {
      move(dx, dy);
    } else {
      turn(dx, dy);
    }
  });
  for (const name of ["pointerup", "pointercancel"]) {
    canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  }
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(0.001 * event.deltaY));
  }, {passive: false});
  const reset = () => { camera = structuredClone(begin); draw(); };
  canvas.addEventListener("dblclick", reset);
  document.getElementById("view3d-reset").addEventListener("click", reset);
  for (const id of ["view3d-colour", "view3d-path"]) {
    document.getElementById(id).addEventListener("change", draw);
  }
  canvas.addEventListener("webglcontextlost", (event) => { event.preventDefault(); gl = null; });
  canvas.addEventListener("webglcontextrestored", start);
  addEventListener("resize", draw);
  start();
})();
)js";

}  // namespace mono3d::tools
