// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The way of the camera, its keyframes and where it is.

import * as THREE from './three.module.min.js';
import {fromPose} from './controls.js';

const WAY = 0xe8590c, KEYFRAME = 0x1864ab, NOW = 0xc92a2a;

// Corners of what a camera sees at distance 1.
function corners(camera) {
  if (!camera) return [[-0.6, 0.4], [0.6, 0.4], [0.6, -0.4], [-0.6, -0.4]];
  const {fx, fy, cx, cy, width, height} = camera;
  const x = [-cx / fx, (width - cx) / fx], y = [cy / fy, -(height - cy) / fy];
  return [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]];
}

// Lines of a frustum, appended to `positions`.
function addFrustum(positions, {position, quaternion}, camera, length) {
  const rim = corners(camera).map(([x, y]) =>
    new THREE.Vector3(x, y, -1).multiplyScalar(length).applyQuaternion(quaternion).add(position));
  for (let i = 0; i < 4; ++i) {
    positions.push(...position, ...rim[i], ...rim[i], ...rim[(i + 1) % 4]);
  }
}

function lines(colour, Kind = THREE.LineSegments) {
  const object = new Kind(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({color: colour}));
  object.frustumCulled = false;
  return object;
}
function setPositions(object, positions) {
  object.geometry.dispose();
  object.geometry = new THREE.BufferGeometry();
  object.geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
}

export class Flight {
  constructor(scene) {
    this.camera = null;  // of the images
    this.keyframes = [];
    this.path = [];
    this.length = 1;     // of a frustum
    this.now = null;
    this.group = new THREE.Group();
    this.way = lines(WAY, THREE.Line);
    this.frusta = lines(KEYFRAME);
    this.current = lines(NOW);
    this.group.add(this.way, this.frusta, this.current);
    scene.add(this.group);
  }
  // What the slider goes through.
  get stops() { return this.path.length > 0 ? this.path : this.keyframes; }

  update(changes) {
    if (changes.camera) this.camera = changes.camera;
    for (const name of ['keyframes', 'path']) {
      if (changes[name]) this[name] = changes[name].map((pose) => ({...pose, ...fromPose(pose.pose)}));
    }
    if (changes.camera || changes.keyframes || changes.path) this.draw();
  }
  draw() {
    const stops = this.stops;
    const box = new THREE.Box3().setFromPoints(stops.map((stop) => stop.position));
    const size = box.isEmpty() ? 1 : box.getSize(new THREE.Vector3()).length();
    this.length = Math.max(1e-6, 0.02 * size || 0.1);
    setPositions(this.way, stops.flatMap((stop) => [...stop.position]));
    const positions = [];
    // A crowd of them hides the model.
    const step = Math.max(1, Math.ceil(this.keyframes.length / 80));
    this.drawnKeyframes = this.keyframes.filter((_, i) => i % step === 0);
    for (const keyframe of this.drawnKeyframes) addFrustum(positions, keyframe, this.camera, this.length);
    setPositions(this.frusta, positions);
    if (this.now) this.setNow(this.now);
  }
  setNow(place) {
    this.now = place;
    const positions = [];
    if (place) addFrustum(positions, place, this.camera, 2.5 * this.length);
    setPositions(this.current, positions);
  }
  nearestKeyframe({position, quaternion}) {
    let nearest = null, least = Infinity;
    for (const keyframe of this.keyframes) {
      const cost = keyframe.position.distanceTo(position) / this.length + 5 * keyframe.quaternion.angleTo(quaternion);
      if (cost < least) [nearest, least] = [keyframe, cost];
    }
    return nearest;
  }
  // The keyframe whose frustum is at a place of the window.
  pick(x, y, camera, width, height) {
    let nearest = null, least = 14;
    const centre = new THREE.Vector3();
    if (!this.group.visible) return null;
    for (const keyframe of this.drawnKeyframes ?? []) {
      centre.set(0, 0, -0.5 * this.length).applyQuaternion(keyframe.quaternion).add(keyframe.position).project(camera);
      if (Math.abs(centre.z) > 1) continue;
      const distance = Math.hypot((centre.x + 1) / 2 * width - x, (1 - centre.y) / 2 * height - y);
      if (distance < least) [nearest, least] = [keyframe, distance];
    }
    return nearest;
  }
}
