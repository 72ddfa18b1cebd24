// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The model: blocks of surfels in a random order, so that the first ones of a block are a coarser
// block. Fetches and draws of each block as many as its size on the screen calls for, within a
// budget.

import * as THREE from './three.module.min.js';

const HEAD = 48;                   // bytes in front of surfels on their way
const BYTES_OF_SURFEL = 16;
const REFRESH_MS = 3000;           // a block that goes on changing is fetched no more often
const FIRST_LEVEL = 2048;           // surfels of a block
const MAX_FETCHES = 4;             // at a time
const MAX_OF_FETCH = 65536;        // surfels: a megabyte
const MAX_BLOCKS_OF_FETCH = 128;   // a request of 4 KB
const MAX_KEPT = 8e6;              // surfels in memory, twice: 256 MB
const SURFELS_PER_PIXEL = 1.5;     // more than that nobody sees
const MIN_BUDGET = 5e4;
const MAX_BUDGET = 5e6;
const SLOW_MS = 45, FAST_MS = 20;  // of a picture while the camera moves

// Where the level of a block ends that begins there: the first one is small, the others double what
// there is until it is as much as wanted. A level is fetched and dropped as a whole.
function levelEnd(begin, wanted, size) {
  let end = Math.max(FIRST_LEVEL, 2 * begin);
  while (begin > 0 && end < wanted && 2 * end - begin <= MAX_OF_FETCH) end *= 2;
  return Math.min(end, begin + MAX_OF_FETCH, size);
}

const VERTEX_SHADER = `
uniform vec3 low, size, up;
uniform float maxRadius, grow, blockScale, pixelsPerUnit, maxPointSize;
uniform int mode;
uniform vec2 heights, frames, blockFrames;
uniform mat3 cutAxes;
uniform vec3 cutLow, cutHigh;
attribute uvec4 surfel;
varying vec3 vColour;
flat varying vec4 vPlane;   // normal in the camera's frame; radius
flat varying vec3 vCentre;

vec3 ramp(float x) {  // after Google's Turbo
  x = clamp(x, 0.0, 1.0);
  vec4 v4 = vec4(1.0, x, x * x, x * x * x);
  vec2 v2 = v4.zw * v4.z;
  return clamp(vec3(
    dot(v4, vec4(0.13572138, 4.61539260, -42.66032258, 132.13108234)) + dot(v2, vec2(-152.94239396, 59.28637943)),
    dot(v4, vec4(0.09140261, 2.19418839, 4.84296658, -14.18503333)) + dot(v2, vec2(4.27729857, 2.82956604)),
    dot(v4, vec4(0.10667330, 12.64194608, -60.58204836, 110.36276771)) + dot(v2, vec2(-89.90310912, 27.34824973))),
    0.0, 1.0);
}
float signedByte(uint word, int shift) { return float(int(word << (24 - shift)) >> 24) / 127.0; }
// From the square that an octahedron is unfolded to; nothing where there is none.
vec3 unfolded(vec2 flat2) {
  if (flat2.x < -1.0) return vec3(0.0);
  vec3 n = vec3(flat2, 1.0 - abs(flat2.x) - abs(flat2.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
  return normalize(n);
}
float unsignedByte(uint word, int shift) { return float((word >> shift) & 255u); }

void main() {
  vec3 p = low + size * vec3(float(surfel.x & 65535u), float(surfel.x >> 16), float(surfel.y & 65535u)) / 65535.0;
  float radius = maxRadius * exp2((unsignedByte(surfel.y, 16) - 255.0) / 20.0) * blockScale * grow;
  vec3 normal = unfolded(vec2(signedByte(surfel.z, 0), signedByte(surfel.z, 8)));
  vec3 world = (modelMatrix * vec4(p, 1.0)).xyz;
  vec3 centre = (viewMatrix * vec4(world, 1.0)).xyz;
  gl_Position = projectionMatrix * vec4(centre, 1.0);
  vec3 cut = cutAxes * world;
  if (any(lessThan(cut, cutLow)) || any(greaterThan(cut, cutHigh))) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  vec3 n = dot(normal, normal) > 0.1 ? normalize(mat3(modelViewMatrix) * normal) : normalize(-centre);
  float pixels = 2.0 * radius * pixelsPerUnit / max(-centre.z, 1e-6);
  gl_PointSize = clamp(pixels * 1.15 + 1.0, 1.0, maxPointSize);
  vPlane = vec4(n, pixels < 1.5 ? 1e30 : radius);  // a small one fills its pixel
  if (pixels < 1.5) gl_PointSize = 1.0;
  vCentre = centre;
  vec3 rgb = vec3(unsignedByte(surfel.w, 0), unsignedByte(surfel.w, 8), unsignedByte(surfel.w, 16)) / 255.0;
  if (mode == 0) vColour = rgb;
  else if (mode == 1) vColour = ramp(unsignedByte(surfel.w, 24) / 255.0);
  else if (mode == 2) vColour = dot(normal, normal) > 0.1 ? 0.5 + 0.5 * normalize(mat3(modelMatrix) * normal) : vec3(0.5);
  else if (mode == 3) vColour = ramp((dot(world, up) - heights.x) / (heights.y - heights.x));
  else if (mode == 4) {
    float frame = mix(blockFrames.x, blockFrames.y, unsignedByte(surfel.y, 24) / 255.0);
    vColour = ramp((frame - frames.x) / max(frames.y - frames.x, 1.0));
  }
  else if (mode == 5) vColour = ramp(log2(1.0 + unsignedByte(surfel.z, 16)) / 5.0);
  else vColour = ramp(unsignedByte(surfel.z, 24) / 255.0);
}`;

const FRAGMENT_SHADER = `
uniform vec2 viewport;
uniform vec4 lens;  // of the projection: [0][0], [1][1], [2][0], [2][1]
varying vec3 vColour;
flat varying vec4 vPlane;
flat varying vec3 vCentre;
void main() {
  if (vPlane.w < 1e29) {
    vec2 ndc = gl_FragCoord.xy / viewport * 2.0 - 1.0;
    vec3 ray = vec3((ndc + lens.zw) / lens.xy, -1.0);
    float across = dot(vPlane.xyz, ray);
    vec3 from = ray * (dot(vPlane.xyz, vCentre) / across) - vCentre;
    if (!(dot(from, from) <= vPlane.w * vPlane.w)) discard;
  }
  gl_FragColor = vec4(vColour, 1.0);
}`;

class Block {
  constructor(info) {
    this.info = info;
    this.levels = [];  // {points, words}
    this.loaded = 0;
    this.isFetching = false;
    this.loadedAt = -Infinity;
    this.wanted = 0;
    this.next = null;  // the block as it is now, until there is something of it
    this.group = new THREE.Group();
    this.group.matrixAutoUpdate = false;
    this.place(info);
  }
  place(info) {
    const [x, y, z, qx, qy, qz, qw] = info.pose;
    this.info = info;
    this.group.matrix.compose(new THREE.Vector3(x, y, z), new THREE.Quaternion(qx, qy, qz, qw),
      new THREE.Vector3(info.scale, info.scale, info.scale));
    this.group.matrixWorldNeedsUpdate = true;
    this.box = new THREE.Box3(new THREE.Vector3(...this.info.low), new THREE.Vector3(...this.info.high));
    this.sphere = this.box.getBoundingSphere(new THREE.Sphere()).applyMatrix4(this.group.matrix);
    this.sphere.radius += this.info.max_radius * info.scale;
  }
}

export class Surfels {
  // `onChange`: there is something new to draw.
  constructor(scene, renderer, onChange) {
    this.scene = scene;
    this.renderer = renderer;
    this.onChange = onChange;
    this.blocks = new Map();
    this.numFetches = 0;
    this.numLoaded = 0;
    this.numDrawn = 0;
    this.budget = 1e6;  // while the camera moves
    this.generation = 0;
    const gl = renderer.getContext();
    this.uniforms = {
      up: {value: new THREE.Vector3(0, 0, 1)}, mode: {value: 0},
      pixelsPerUnit: {value: 1}, maxPointSize: {value: gl.getParameter(gl.ALIASED_POINT_SIZE_RANGE)[1]},
      heights: {value: new THREE.Vector2(0, 1)}, frames: {value: new THREE.Vector2(0, 1)}, cutAxes: {value: new THREE.Matrix3()},
      cutLow: {value: new THREE.Vector3(-1e30, -1e30, -1e30)},
      cutHigh: {value: new THREE.Vector3(1e30, 1e30, 1e30)},
      viewport: {value: new THREE.Vector2(1, 1)}, lens: {value: new THREE.Vector4(1, 1, 0, 0)},
    };
  }

  get numSurfels() {
    let sum = 0;
    for (const block of this.blocks.values()) sum += (block.next ?? block).info.surfels;
    return sum;
  }
  // The frames that saw surfels first: the first and the last of them; null where none is known.
  get frames() {
    let range = null;
    for (const {info: {frames}} of this.blocks.values()) {
      if (frames) range = range ? [Math.min(range[0], frames[0]), Math.max(range[1], frames[1])] : [...frames];
    }
    return range;
  }

  clear() {
    for (const id of [...this.blocks.keys()]) this.remove(id);
    this.generation++;
  }
  remove(id) {
    const block = this.blocks.get(id);
    this.dispose(block);
    if (block.next) this.dispose(block.next);
    this.blocks.delete(id);
  }
  dispose(block) {
    block.isGone = true;
    while (block.levels.length) this.dropLevel(block);
    this.scene.remove(block.group);
  }
  dropLevel(block) {
    const level = block.levels.pop();
    block.group.remove(level.points);
    level.points.geometry.dispose();
    level.points.material.dispose();
    block.loaded -= level.words.length / 4;
    this.numLoaded -= level.words.length / 4;
  }

  // What the server says has changed.
  update(changes) {
    if (changes.ids) {
      const ids = new Set(changes.ids);
      for (const id of [...this.blocks.keys()]) if (!ids.has(id)) this.remove(id);
    }
    for (const info of changes.blocks) {
      const block = this.blocks.get(info.id);
      if (!block) {
        const added = new Block(info);
        this.blocks.set(info.id, added);
        this.scene.add(added.group);
      } else if ((block.next ?? block).info.version === info.version) {
        const {pose, scale} = info;
        block.place({...block.info, pose, scale});
        block.next?.place({...block.next.info, pose, scale});
      } else {
        const {pose, scale} = info;
        block.place({...block.info, pose, scale});
        if (block.next && block.next.loaded === 0) block.next.place(info);
        else block.next = new Block(info);
        if (block.loaded === 0) this.swap(block);
      }
    }
    if (changes.ids || changes.blocks.length) {
      this.fetchMore();
      this.onChange();
    }
  }
  // The block as it is now takes the place of what it was.
  swap(block) {
    const next = block.next;
    next.wanted = block.wanted;
    block.next = null;
    this.dispose(block);
    this.blocks.set(next.info.id, next);
    this.scene.add(next.group);
  }

  addLevel(block, buffer) {
    const words = new Uint32Array(buffer);
    const geometry = new THREE.BufferGeometry();
    const attribute = new THREE.BufferAttribute(words, 4);
    attribute.gpuType = THREE.IntType;
    geometry.setAttribute('surfel', attribute);
    const info = block.info;
    const size = info.high.map((high, k) => high - info.low[k]);
    const material = new THREE.ShaderMaterial({
      vertexShader: VERTEX_SHADER, fragmentShader: FRAGMENT_SHADER,
      uniforms: {
        ...this.uniforms, low: {value: new THREE.Vector3(...info.low)}, size: {value: new THREE.Vector3(...size)},
        maxRadius: {value: info.max_radius}, blockScale: {value: info.scale}, grow: {value: 1},
        blockFrames: {value: new THREE.Vector2(...(info.frames ?? [0, 0]))},
      },
    });
    const points = new THREE.Points(geometry, material);
    points.frustumCulled = false;  // done here for whole blocks
    block.group.add(points);
    block.levels.push({points, words});
    block.loaded += words.length / 4;
    this.numLoaded += words.length / 4;
  }

  // The next level of each of these blocks, in one request.
  async fetchLevels(wants) {
    const generation = this.generation;
    for (const {block} of wants) block.isFetching = true;
    this.numFetches++;
    try {
      const levels = wants.flatMap(({block, first, count}) => [block.info.id, first, count]);
      const answer = await fetch(`surfels?levels=${levels}`);
      if (!answer.ok) {  // no room at the server: later
        await new Promise((done) => setTimeout(done, 500));
        return;
      }
      const buffer = await answer.arrayBuffer();
      if (generation !== this.generation) return;
      let at = 0;
      for (const {block, first, count} of wants) {
        if (at + HEAD > buffer.byteLength) break;
        const size = new DataView(buffer, at, HEAD).getUint32(36, true);
        const end = at + HEAD + BYTES_OF_SURFEL * Math.max(0, Math.min(count, size - first));
        this.take(block, first, buffer.slice(at, end));
        at = end;
      }
      this.onChange();
    } catch {  // no connection: the poll says so
      await new Promise((done) => setTimeout(done, 1000));
    } finally {
      for (const {block} of wants) block.isFetching = false;
      this.numFetches--;
      this.fetchMore();  // a slow picture does not hold it up
      if (this.numFetches === 0) this.onChange();
    }
  }
  // What the server says of a block, as it is by now, and surfels of it from `first` on.
  take(block, first, buffer) {
    const head = new DataView(buffer), float = (k) => head.getFloat32(8 + 4 * k, true);
    const version = head.getFloat64(0, true);
    if (block.isGone || version === 0) return;
    if (first === 0) {
      block.place({...block.info, version, low: [float(0), float(1), float(2)], high: [float(3), float(4), float(5)],
        max_radius: float(6), surfels: head.getUint32(36, true), frames: framesOf(head)});
    } else if (version !== block.info.version) {
      return;  // what is said next of changes names it
    }
    if (buffer.byteLength > HEAD) this.addLevel(block, buffer.slice(HEAD));
    block.loadedAt = performance.now();
    const shown = this.blocks.get(block.info.id);
    if (shown?.next === block) this.swap(shown);
  }

  // Before a picture: how many of each block, and what has to be fetched.
  prepare(camera, width, height, isMoving) {
    const P = camera.projectionMatrix.elements;
    const uniforms = this.uniforms;
    uniforms.pixelsPerUnit.value = 0.5 * height * P[5];
    uniforms.viewport.value.set(width, height);
    uniforms.lens.value.set(P[0], P[5], P[8], P[9]);
    const frustum = new THREE.Frustum().setFromProjectionMatrix(
      new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse));
    let sum = 0;
    uniforms.frames.value.set(...(this.frames ?? [0, 1]));
    for (const block of this.blocks.values()) {
      block.wanted = 0;
      if (block.info.surfels > 0 && frustum.intersectsSphere(block.sphere)) {
        const distance = Math.max(camera.position.distanceTo(block.sphere.center), 0.3 * block.sphere.radius);
        const pixels = Math.PI * (uniforms.pixelsPerUnit.value * block.sphere.radius / distance) ** 2;
        block.wanted = Math.min((block.next ?? block).info.surfels, 200 + SURFELS_PER_PIXEL * pixels);
        sum += block.wanted;
      }
    }
    // While more comes, pictures that take long would keep it waiting.
    const budget = isMoving || this.isComplete === false ? this.budget : MAX_BUDGET;
    const share = Math.min(1, budget / Math.max(1, sum)), shareToFetch = Math.min(1, MAX_BUDGET / Math.max(1, sum));
    this.numDrawn = 0;
    for (const block of this.blocks.values()) {
      this.draw(block, Math.ceil(block.wanted * share));
      block.wanted = Math.ceil(block.wanted * shareToFetch);
    }
    this.fetchMore();
  }
  draw(block, count) {
    const drawn = Math.min(count, block.loaded);
    this.numDrawn += drawn;
    // A part of them covers as much area in all, but as they fall, with holes: larger by a quarter, they close most of them.
    const grow = drawn > 0 ? Math.min(8, Math.sqrt(1 + 1.6 * (block.info.surfels / drawn - 1))) : 1;
    let begin = 0;
    for (const {points, words} of block.levels) {
      const num = Math.max(0, Math.min(drawn - begin, words.length / 4));
      points.visible = num > 0;
      points.geometry.setDrawRange(0, num);
      const uniforms = points.material.uniforms;
      uniforms.grow.value = grow;
      uniforms.blockScale.value = block.info.scale;
      begin += words.length / 4;
    }
  }
  fetchMore() {
    const candidates = [];
    const now = performance.now();
    for (const shown of this.blocks.values()) {
      const block = shown.next ?? shown;
      if (block.isFetching || block.info.surfels === 0) continue;
      if (shown.next && now - shown.loadedAt < REFRESH_MS) {
        this.later ??= setTimeout(() => { this.later = null; this.fetchMore(); }, REFRESH_MS / 3);
        continue;
      }
      // Of every block the first level at least: nothing is missing when the camera turns.
      const wanted = Math.max(shown.wanted, shown.next ? 1 : 0, block.loaded === 0 ? 1 : 0);
      if (block.loaded < Math.min(wanted, block.info.surfels)) {
        candidates.push([wanted / (1 + block.loaded), block, wanted, shown.next ? shown : null]);
      }
    }
    candidates.sort((a, b) => b[0] - a[0]);
    const wants = candidates.map(([, block, wanted, replaced]) => {
      const first = block.loaded, {surfels} = block.info;
      // Of one that replaces another as many as that one has.
      const count = Math.max(levelEnd(first, wanted, surfels) - first, Math.min(replaced?.loaded ?? 0, surfels, MAX_OF_FETCH));
      return {block, first, count};
    });
    while (wants.length > 0 && this.numFetches < MAX_FETCHES) {
      if (this.numLoaded > MAX_KEPT && !this.makeRoom()) break;
      let num = 0, sum = 0;
      while (num < Math.min(wants.length, MAX_BLOCKS_OF_FETCH) && (num === 0 || sum + wants[num].count <= MAX_OF_FETCH)) {
        sum += wants[num++].count;
      }
      this.fetchLevels(wants.splice(0, num));
    }
    this.isComplete = candidates.length === 0 && this.numFetches === 0;
  }
  // Drops a level that is not wanted now.
  makeRoom() {
    for (const block of this.blocks.values()) {
      const level = block.levels.at(-1);
      if (block.levels.length > 1 && block.wanted < block.loaded - level.words.length / 4) {
        this.dropLevel(block);
        return true;
      }
    }
    return false;
  }
  // After a picture of a resting camera that took so long: where it begins to move, the first
  // pictures are not to take as long.
  limit(ms) {
    if (ms > SLOW_MS) this.budget = Math.max(MIN_BUDGET, Math.min(this.budget, this.numDrawn * SLOW_MS / ms));
  }
  // After a picture of a moving camera that took so long.
  adapt(ms) {
    if (ms > SLOW_MS) this.budget = Math.max(MIN_BUDGET, Math.min(this.budget, this.numDrawn) * Math.max(0.3, SLOW_MS / ms));
    if (ms < FAST_MS) this.budget = Math.min(MAX_BUDGET, this.budget * 1.2);
  }

  // In the world; null where there is no model.
  box() {
    const box = new THREE.Box3();
    for (const block of this.blocks.values()) {
      if (block.info.surfels > 0) box.union(block.box.clone().applyMatrix4(block.group.matrix));
    }
    return box.isEmpty() ? null : box;
  }
  // Is there something of every block?
  get hasAll() { return [...this.blocks.values()].every((block) => block.loaded > 0 || block.info.surfels === 0); }
  // Every so many of those that are there, until there are `max`; and the middle of blocks of which
  // there is nothing yet.
  sample(max) {
    const points = [], step = Math.max(1, Math.floor(this.numLoaded / max));
    for (const block of this.blocks.values()) {
      if (block.loaded === 0 && block.info.surfels > 0) {
        points.push(block.box.getCenter(new THREE.Vector3()).applyMatrix4(block.group.matrix));
      }
      for (const {words} of block.levels) {
        for (let i = 0; i < words.length; i += 4 * step) points.push(position(block, words, i));
      }
    }
    return points;
  }

  // The nearest surfel that the ray meets; null where there is none. `pixel`: what a pixel spans at
  // distance 1.
  pick(ray, pixel) {
    let nearest = Infinity, found = null;
    const local = new THREE.Ray(), inverse = new THREE.Matrix4(), sphere = new THREE.Sphere();
    const cut = new THREE.Vector3(), p = new THREE.Vector3();
    for (const block of this.blocks.values()) {
      sphere.copy(block.sphere).radius += 3 * pixel * block.sphere.center.distanceTo(ray.origin);
      if (!ray.intersectsSphere(sphere)) continue;
      local.copy(ray).applyMatrix4(inverse.copy(block.group.matrix).invert());
      for (const {words} of block.levels) {
        for (let i = 0; i < words.length; i += 4) {
          localPosition(block, words, i, p);
          const along = p.sub(local.origin).dot(local.direction);
          if (along <= 0 || along * block.info.scale >= nearest) continue;
          const off2 = p.lengthSq() - along * along;
          const reach = Math.max(radiusOf(block, words, i), 2 * pixel * along);
          if (off2 > reach * reach) continue;
          const world = position(block, words, i);
          cut.copy(world).applyMatrix3(this.uniforms.cutAxes.value);
          const {cutLow, cutHigh} = this.uniforms;
          if (['x', 'y', 'z'].some((k) => cut[k] < cutLow.value[k] || cut[k] > cutHigh.value[k])) continue;
          nearest = along * block.info.scale;
          found = world;
        }
      }
    }
    return found;
  }
}

function framesOf(head) {
  const [first, last] = [head.getUint32(40, true), head.getUint32(44, true)];
  return first <= last ? [first, last] : undefined;
}
function radiusOf({info}, words, i) {
  return info.max_radius * 2 ** ((words[i + 1] >>> 16 & 255) / 20 - 255 / 20);
}
function localPosition({info}, words, i, to) {
  to.set(words[i] & 65535, words[i] >>> 16, words[i + 1] & 65535).divideScalar(65535);
  return to.set(info.low[0] + to.x * (info.high[0] - info.low[0]), info.low[1] + to.y * (info.high[1] - info.low[1]),
    info.low[2] + to.z * (info.high[2] - info.low[2]));
}
function position(block, words, i) {
  return localPosition(block, words, i, new THREE.Vector3()).applyMatrix4(block.group.matrix);
}
