// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The page: asks the server what has changed, and draws when there is something new.

import * as THREE from './three.module.min.js';
import {Controls, fromPose} from './controls.js';
import {Flight} from './flight.js';
import {Measure} from './measure.js';
import {NextViews} from './next_views.js';
import {Surfels} from './surfels.js';

const POLL_MS = 1000, RETRY_MS = 2000;
const $ = (id) => document.getElementById(id);

const canvas = $('canvas');
const renderer = new THREE.WebGLRenderer({canvas, antialias: false, preserveDrawingBuffer: true});
renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
renderer.outputColorSpace = THREE.LinearSRGBColorSpace;  // colours as they are
THREE.ColorManagement.enabled = false;
const scene = new THREE.Scene();
scene.background = new THREE.Color(0xffffff);
const camera = new THREE.PerspectiveCamera(50, 1, 0.1, 1000);
const surfels = new Surfels(scene, renderer, drawMore);
const flight = new Flight(scene);
const measure = new Measure(scene, $('labels'), $('distance'));
const nextViews = new NextViews(scene, $('next-labels'), $('next-list'), lookFromNextView);
const controls = new Controls(camera, canvas, pick, draw);

// --- Drawing: only when something has changed ---

const pixel = new Uint8Array(4);
let isAsked = false, drawnAt = 0, numPictures = 0, fittedTo = 0, isFittedToAll = false, lastMs = 0;
let firstPictureMs = null, wholePictureMs = null;  // since the page was asked for

// More has come: not at once where pictures take long.
let waiting = null, pictureMs = 0, wasMoving = false;
function drawMore() {
  waiting ??= setTimeout(draw, Math.min(2000, 50 + 3 * pictureMs));
}
function draw() {
  clearTimeout(waiting);
  waiting = null;
  if (isAsked) return;
  isAsked = true;
  requestAnimationFrame(render);
}
function render(now) {
  isAsked = false;
  const width = window.innerWidth, height = window.innerHeight;
  const size = renderer.getSize(new THREE.Vector2());
  if (size.x !== width || size.y !== height) renderer.setSize(width, height, false);
  const goesOn = controls.step((now - drawnAt) / 1000);
  const isMoving = controls.isMoving;
  flight.group.visible = $('show-way').checked && controls.lens === null;  // it would be in the way
  nextViews.setVisible($('show-next').checked && controls.lens === null);
  surfels.prepare(camera, canvas.width, canvas.height, isMoving);
  const begin = performance.now();
  renderer.render(scene, camera);
  const gl = renderer.getContext();
  const isMeasured = surfels.isComplete !== true || isMoving;
  if (isMeasured) gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);  // waits
  pictureMs = performance.now() - begin;
  measure.place(camera, width, height);
  nextViews.place(camera, width, height);
  if (isMoving && wasMoving) surfels.adapt(pictureMs);
  else if (isMeasured) surfels.limit(pictureMs);
  wasMoving = isMoving;
  lastMs = pictureMs;
  drawnAt = now;
  if (surfels.numDrawn > 0) {
    numPictures++;
    firstPictureMs ??= performance.now();
    if (surfels.hasAll) wholePictureMs ??= performance.now();
  }
  if (goesOn) draw();
}
window.addEventListener('resize', () => {
  if (!controls.isTouched && fittedTo > 0 && !$('ride').checked) fit(true);  // a phone is turned
  draw();
});

// --- Where the model lies ---

let up = new THREE.Vector3(0, 0, 1), heights = [0, 1], cutRange = null;

// The axes of the cut planes: two level ones and up.
function cutAxes() {
  const east = Math.abs(up.x) < 0.9 ? new THREE.Vector3(1, 0, 0) : new THREE.Vector3(0, 1, 0);
  east.addScaledVector(up, -east.dot(up)).normalize();
  const north = new THREE.Vector3().crossVectors(up, east);
  return [east, north, up];
}
function percentile(sorted, share) { return sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))]; }

function measureModel() {
  const points = surfels.sample(20000);
  if (points.length === 0) return null;
  const ranges = cutAxes().map((axis) => {
    const along = points.map((point) => point.dot(axis)).sort((a, b) => a - b);
    return {low: along[0], high: along.at(-1), from: percentile(along, 0.02), to: percentile(along, 0.98)};
  });
  heights = [ranges[2].from, Math.max(ranges[2].to, ranges[2].from + 1e-9)];
  surfels.uniforms.heights.value.set(...heights);
  surfels.uniforms.up.value.copy(up);
  surfels.uniforms.cutAxes.value.set(...cutAxes().flatMap((axis) => [...axis]));
  cutRange = ranges;
  showLegend();
  return ranges;
}

// Shows all of it, from the side of the flight.
function fit(isAtOnce) {
  const ranges = measureModel();
  const centre = new THREE.Vector3();
  let radius = 1;
  if (ranges) {
    cutAxes().forEach((axis, k) => centre.addScaledVector(axis, 0.5 * (ranges[k].from + ranges[k].to)));
    radius = 0.5 * Math.hypot(...ranges.map(({from, to}) => to - from)) || 1;
  } else if (flight.stops.length > 0) {
    const sphere = new THREE.Box3().setFromPoints(flight.stops.map((stop) => stop.position)).getBoundingSphere(new THREE.Sphere());
    centre.copy(sphere.center);
    radius = 3 * sphere.radius || 1;
  } else {
    return;
  }
  const box = surfels.box();
  controls.extent = Math.max(radius, box ? 0.5 * box.getSize(new THREE.Vector3()).length() : 0);
  controls.up.copy(up);
  const from = new THREE.Vector3();
  for (const stop of flight.stops) from.add(stop.position.clone().sub(centre).divideScalar(flight.stops.length));
  const level = from.clone().addScaledVector(up, -from.dot(up));
  if (level.length() < 0.05 * radius) level.copy(cutAxes()[1]).negate();
  const towards = level.normalize().multiplyScalar(0.75).addScaledVector(up, 0.65).normalize();
  const half = Math.atan(Math.tan(camera.fov * Math.PI / 360) * Math.min(1, window.innerWidth / window.innerHeight));
  const eye = camera.clone();
  eye.up.copy(up);
  eye.position.copy(centre).addScaledVector(towards, 1.05 * radius / Math.sin(half));
  eye.lookAt(centre);
  fittedTo = surfels.numSurfels;
  if (isAtOnce) controls.set(eye.position, eye.quaternion, eye.position.distanceTo(centre));
  else controls.goTo(eye.position, eye.quaternion, centre);
}

function rayAt(x, y) {
  const ray = new THREE.Raycaster();
  ray.setFromCamera(new THREE.Vector2(2 * x / window.innerWidth - 1, 1 - 2 * y / window.innerHeight), camera);
  return ray.ray;
}
function pick(x, y) {
  return surfels.pick(rayAt(x, y), 2 / (window.innerHeight * camera.projectionMatrix.elements[5]));
}

// --- What the server says ---

let version = 0, server = null, status = {}, largestError_m = null, times = null;

async function poll() {
  let pause = POLL_MS;
  try {
    const answer = await fetch(`changes?since=${version}`, {signal: AbortSignal.timeout(20000)});
    if (!answer.ok) throw new Error(String(answer.status));
    const changes = await answer.json();
    if (server !== null && changes.server !== server) {  // another run: from the beginning
      server = null;
      version = 0;
      largestError_m = times = null;
      surfels.clear();
      setTimeout(poll, 0);
      return;
    }
    const isFirst = server === null;
    server = changes.server;
    version = changes.version;
    document.body.dataset.connected = 'yes';
    take(changes, isFirst);
  } catch {
    document.body.dataset.connected = 'no';
    showStatus();
    pause = RETRY_MS;
  }
  setTimeout(poll, pause);
}
document.addEventListener('visibilitychange', draw);

function take(changes) {
  flight.update(changes);
  surfels.update(changes);
  if (changes.next_views) nextViews.update(changes.next_views);
  $('next').hidden = nextViews.views.length === 0;
  if (changes.errors) largestError_m = changes.errors.largest_m;
  if (changes.times) times = changes.times;
  if (changes.up && !controls.isTouched) up = new THREE.Vector3(...changes.up).normalize();
  if (changes.status) {
    if (changes.status.phase === 'finished' && status.phase === 'running') isFittedToAll = false;  // once more, to what there is in the end
    status = changes.status;
  }
  if (changes.picture_image && !isAway) setPicture('image', `image?v=${changes.picture_image}`, 'image now');
  if (changes.picture_depth && !isAway) setPicture('depth', `depth?v=${changes.picture_depth}`, DEPTH_CAPTION);
  if (status.pose && !$('ride').checked) flight.setNow(fromPose(status.pose));
  showStatus();
  showSlider();
  const hasFrames = surfels.frames !== null;
  $('colour-time').disabled = !hasFrames;
  // Said in the list: a phone shows no title.
  const isOld = !hasFrames && status.phase === 'file';
  $('colour-time').textContent = isOld ? 'time first seen (not in this model)' : 'time first seen';
  $('colour-time').title = isOld ? 'model.ply has no first_frame: written by an earlier version, or by another program' : '';
  showLegend();
  $('colour-error').disabled = largestError_m === null;
  followGrowth();
  draw();
}
// Until a person takes over, the whole model is in view.
let growing = null;
function followGrowth() {
  if (controls.isTouched || $('ride').checked) return;
  const hasAll = surfels.hasAll;
  if (fittedTo === 0 || surfels.numSurfels > 1.3 * fittedTo || (hasAll && !isFittedToAll)) {
    isFittedToAll = hasAll;
    fit(true);
  }
  clearTimeout(growing);
  if (!isFittedToAll) growing = setTimeout(followGrowth, 200);
}

function showStatus() {
  const isLost = document.body.dataset.connected === 'no';
  const {phase, num_frames: total} = status;
  const counts = status.counts ?? {};
  // Not the frame's own number: of a video some are left out.
  const frame = counts.frames ?? status.frame;
  const of = total ? ` of ${total}` : '';
  $('headline').textContent = isLost ? 'The run has ended, or cannot be reached'
    : phase === 'file' ? status.name : phase === 'running' ? `Running: frame ${frame}${of}`
      : phase === 'finished' ? 'All frames are in; the run writes its files' : 'Starting';
  $('why').textContent = isLost ? 'What there was remains in view. “mono3d-view” with the output folder shows the result.'
    : status.health_reason || (status.tracking && status.reason ? status.reason : '');
  const {earth} = status;
  measure.setScale(earth ? earth.metres_per_unit : null, earth ? earth.scale_sigma : 0);
  const rows = [
    ['Surfels', phase === 'file' ? status.surfels : surfels.numSurfels],
    ['Tracking', phase === 'file' ? undefined : status.tracking],
    ['Health', status.health],
    ['Frames tracked', counts.tracked === undefined ? undefined : `${counts.tracked} of ${counts.frames}`],
    ['Frames dropped', counts.dropped_frames],
    ['Keyframes', counts.keyframes],
    ['Depth maps', counts.depth_maps],
    ['in the model', counts.fused],
    ['Bundles dropped', counts.dropped_bundles],
    ['Scale', earth && `± ${(100 * earth.scale_sigma).toPrecision(2)} %`],
    ['North', earth && `± ${earth.heading_sigma_deg.toPrecision(2)}°`],
    ['Place', earth?.position_sigma_m ? `± ${earth.position_sigma_m.toPrecision(2)} m` : undefined],
    ['Memory', status.memory_mb ? `${Math.round(status.memory_mb)} MB` : undefined],
  ];
  $('numbers').replaceChildren(...rows.filter(([, value]) => value !== undefined && value !== '').flatMap(([name, value]) => {
    const term = document.createElement('dt'), text = document.createElement('dd');
    term.textContent = name;
    text.textContent = typeof value === 'number' ? value.toLocaleString('en-GB') : value;
    if (name === 'Health') text.className = value;
    return [term, text];
  }));
  document.title = `mono3d: ${$('headline').textContent}`;
}

// --- Pictures ---

let isAway = false;  // the pictures of a keyframe are shown, not the latest ones

const DEPTH_CAPTION = 'depth: near red, far blue';

function setPicture(kind, url, caption, none) {
  const picture = $(kind), figure = picture.parentElement;
  picture.onload = () => {
    figure.hidden = picture.hidden = false;
    $(`${kind}-caption`).textContent = caption;
    $('pictures').classList.add('some');
  };
  // That there is none is said where one was asked for.
  picture.onerror = () => {
    picture.hidden = true;
    figure.hidden = none === undefined;
    if (none !== undefined) $(`${kind}-caption`).textContent = none;
  };
  picture.src = url;
}
let shownKeyframe = null;
function showKeyframe(keyframe) {
  if (!keyframe || keyframe.id === shownKeyframe) return;
  isAway = true;
  shownKeyframe = keyframe.id;
  const number = flight.keyframes.findIndex(({id}) => id === keyframe.id) + 1;
  setPicture('image', `keyframe_image?id=${keyframe.id}`, `keyframe ${number} of ${flight.keyframes.length}`, 'the image of this keyframe is not there');
  setPicture('depth', `keyframe_depth?id=${keyframe.id}`, DEPTH_CAPTION, 'no depth map of this keyframe');
  $('pictures-close').hidden = status.phase === 'file';
}
$('pictures-close').onclick = () => {
  isAway = false;
  shownKeyframe = null;
  $('pictures-close').hidden = true;
  setPicture('image', `image?v=${version}`, 'image now');
  setPicture('depth', `depth?v=${version}`, DEPTH_CAPTION);
};

// --- Going through the flight ---

function goToStop(place, isAtOnce) {
  const depth = 0.5 * controls.extent;
  const target = new THREE.Vector3(0, 0, -depth).applyQuaternion(place.quaternion).add(place.position);
  if (isAtOnce) controls.set(place.position, place.quaternion, depth, flight.camera);
  else controls.goTo(place.position, place.quaternion, target, flight.camera);
  controls.isTouched = true;
}
function showSlider() {
  const num = flight.stops.length, slider = $('slider');
  $('flight').classList.toggle('some', num > 1);
  const wasAtEnd = slider.value === slider.max;
  slider.max = Math.max(0, num - 1);
  if (wasAtEnd && status.phase !== 'file' && !$('ride').checked) slider.value = slider.max;
  labelStop();
}
function labelStop() {
  const stop = flight.stops[$('slider').value];
  if (!stop) return;
  const seconds = flight.path.length > 0 && !status.photos ? `  ${stop.t.toFixed(2)} s` : '';
  $('flight-label').textContent = `${Number($('slider').value) + 1} / ${flight.stops.length}${seconds}`;
}
$('slider').oninput = () => {
  const stop = flight.stops[$('slider').value];
  if (!stop) return;
  labelStop();
  flight.setNow(stop);
  showKeyframe(flight.path.length > 0 ? flight.nearestKeyframe(stop) : stop);
  if ($('ride').checked) goToStop(stop, true);
  draw();
};
$('ride').onchange = () => {
  const stop = flight.stops[$('slider').value];
  if ($('ride').checked && stop) goToStop(stop, false);
};

// A little behind the proposed place, so that its arrow is seen.
function lookFromNextView({position, quaternion, target}) {
  const back = position.clone().sub(target);
  const eye = camera.clone();
  eye.position.copy(target).addScaledVector(back, 1.4).addScaledVector(up, 0.15 * back.length());
  eye.up.copy(up);
  eye.lookAt(target);
  controls.goTo(eye.position, eye.quaternion, target);
  controls.isTouched = true;
}

// --- Clicks ---

let pressed = null;
canvas.addEventListener('pointerdown', (event) => { pressed = event.isPrimary ? [event.clientX, event.clientY] : null; });
canvas.addEventListener('pointerup', (event) => {
  if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4 || event.button !== 0) return;
  click(event.clientX, event.clientY);
});
function click(x, y) {
  if (measure.isOn) {
    const point = pick(x, y);
    if (point) measure.add(point);
    draw();
    return;
  }
  const keyframe = flight.pick(x, y, camera, window.innerWidth, window.innerHeight);
  if (!keyframe) return;
  showKeyframe(keyframe);
  flight.setNow(keyframe);
  goToStop(keyframe, false);
  const stop = flight.stops.findIndex((other) => other.position.distanceTo(keyframe.position) < 1e-6 * controls.extent);
  if (stop >= 0) $('slider').value = stop;
  labelStop();
}

// --- The panel ---

// The time of a frame of the model, by those of its first and last one.
function secondsOf(frame) {
  const {frames: [from, to], seconds: [from_s, to_s]} = times;
  return to > from ? from_s + (to_s - from_s) * (frame - from) / (to - from) : from_s;
}
function frameLegend() {
  return (surfels.frames ?? [0, 0]).map((frame) =>
    `${status.photos ? 'photo' : 'frame'} ${frame}${times ? ` (${secondsOf(frame).toFixed(1)} s)` : ''}`);
}
const LEGENDS = {
  1: () => ['0', '1'], 3: () => heights.map((height) => height.toPrecision(3)),
  4: frameLegend, 5: () => ['0', '31 or more'], 6: () => ['0 m', `${largestError_m.toPrecision(2)} m or more`],
};
function showLegend() {
  const legend = LEGENDS[$('colour').value];
  $('legend').classList.toggle('shown', legend !== undefined);
  if (legend) [$('legend-low').textContent, $('legend-high').textContent] = legend();
}
$('colour').onchange = () => {
  surfels.uniforms.mode.value = Number($('colour').value);
  if (surfels.uniforms.mode.value === 3) measureModel();
  showLegend();
  draw();
};
$('fit').onclick = () => {
  $('ride').checked = false;
  controls.isTouched = false;
  fit(false);
};
$('menu').onclick = () => {
  const isOpen = $('panel').classList.toggle('open');
  $('menu').setAttribute('aria-expanded', isOpen);
};
function toggle(button, set) {
  button.onclick = () => {
    const isOn = button.getAttribute('aria-pressed') !== 'true';
    button.setAttribute('aria-pressed', isOn);
    set(isOn);
    draw();
  };
}
toggle($('fly'), (isOn) => { controls.isFlying = isOn; });
toggle($('measure'), (isOn) => measure.setOn(isOn));
$('show-way').onchange = draw;
$('show-next').onchange = draw;

const CUTS = [['across', 0], ['along', 1], ['height', 2]].flatMap(([name, axis]) => [[`${name}, from`, axis, 'low'], [`${name}, to`, axis, 'high']]);
const cutInputs = CUTS.map(([name, axis, side]) => {
  const label = document.createElement('label'), input = document.createElement('input');
  Object.assign(input, {type: 'range', min: 0, max: 1000, value: side === 'low' ? 0 : 1000, name});
  label.append(name, input);
  $('cuts').append(label);
  input.oninput = () => cut(axis, side, Number(input.value) / 1000);
  return {input, axis, side};
});
function cut(axis, side, share) {
  if (!cutRange) measureModel();
  if (!cutRange) return;
  const {low, high} = cutRange[axis];
  const isOpen = share === (side === 'low' ? 0 : 1);
  const value = isOpen ? (side === 'low' ? -1e30 : 1e30) : low + share * (high - low);
  surfels.uniforms[side === 'low' ? 'cutLow' : 'cutHigh'].value.setComponent(axis, value);
  draw();
}
$('uncut').onclick = () => {
  for (const {input, axis, side} of cutInputs) {
    input.value = side === 'low' ? 0 : 1000;
    cut(axis, side, side === 'low' ? 0 : 1);
  }
};

// For scripts: where the page stands, and the same steps as by hand.
window.mono3d = {
  state: () => ({
    surfels: surfels.numSurfels, loaded: surfels.numLoaded, drawn: surfels.numDrawn, pictures: numPictures,
    complete: surfels.isComplete === true && surfels.numLoaded > 0, connected: document.body.dataset.connected === 'yes',
    budget: surfels.budget, frameMs: lastMs, phase: status.phase, keyframes: flight.keyframes.length,
    distance: measure.distance, nextViews: nextViews.isVisible ? nextViews.views.length : 0, up: [...up], blocks: surfels.blocks.size,
    eye: [...camera.position], firstPictureMs, wholePictureMs,
  }),
  blocks: () => [...surfels.blocks.values()].map(({info, loaded}) => ({id: info.id, surfels: info.surfels, loaded})),
  measure: (...ends) => { for (const end of ends) measure.add(new THREE.Vector3(...end)); },
  lookFrom: (pose, lens) => {
    const {position, quaternion} = fromPose(pose);
    controls.isTouched = true;
    const box = surfels.box();
    if (box) controls.extent = 0.5 * box.getSize(new THREE.Vector3()).length();
    controls.set(position, quaternion, controls.extent, lens);
  },
  turn: (dx, dy) => { controls.turn(dx, dy); controls.touched(); },
  pick: (x, y) => pick(x, y)?.toArray() ?? null,
  click,
};

poll();
