// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Moves the camera: turning about a point, flying, going somewhere, or looking through a lens.

import * as THREE from './three.module.min.js';

// A camera of computer vision looks along +z with y down, one of three.js along -z with y up.
const FROM_CV = new THREE.Quaternion(1, 0, 0, 0);

export function fromPose([x, y, z, qx, qy, qz, qw]) {
  return {position: new THREE.Vector3(x, y, z), quaternion: new THREE.Quaternion(qx, qy, qz, qw).multiply(FROM_CV)};
}

export class Controls {
  // `pick(x, y)`: the surfel at a place of the window. `onMove`: the camera has another place.
  constructor(camera, canvas, pick, onMove) {
    Object.assign(this, {camera, canvas, pick, onMove});
    this.up = new THREE.Vector3(0, 0, 1);
    this.target = new THREE.Vector3();
    this.extent = 1;          // of what is seen, for near, far and speed
    this.isFlying = false;
    this.isTouched = false;   // a person has moved it
    this.lens = null;         // {fx fy cx cy width height}: as this camera sees
    this.pointers = new Map();
    this.keys = new Set();
    this.flight = null;
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, (event) => this.lift(event));
    canvas.addEventListener('wheel', (event) => this.wheel(event), {passive: false});
    canvas.addEventListener('contextmenu', (event) => event.preventDefault());
    canvas.addEventListener('dblclick', (event) => this.turnAbout(this.pick(event.clientX, event.clientY)));
    window.addEventListener('keydown', (event) => this.key(event, true));
    window.addEventListener('keyup', (event) => this.key(event, false));
    window.addEventListener('blur', () => this.keys.clear());
  }

  get isMoving() { return this.pointers.size > 0 || this.keys.size > 0 || this.flight !== null || performance.now() - this.wheelAt < 200; }

  touched() {
    this.isTouched = true;
    this.flight = null;
    this.lens = null;
    this.onMove();
  }

  down(event) {
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, {x: event.clientX, y: event.clientY, button: event.button, shift: event.shiftKey});
  }
  lift(event) {
    this.pointers.delete(event.pointerId);
    this.onMove();
  }
  move(event) {
    const pointer = this.pointers.get(event.pointerId);
    if (!pointer) return;
    const dx = event.clientX - pointer.x, dy = event.clientY - pointer.y;
    if (dx === 0 && dy === 0) return;
    if (this.pointers.size === 2) {
      const other = [...this.pointers.entries()].find(([id]) => id !== event.pointerId)[1];
      const before = Math.hypot(pointer.x - other.x, pointer.y - other.y);
      const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
      this.shift(0.5 * dx, 0.5 * dy);
      this.approach(before / Math.max(after, 1));
    } else if (pointer.button === 2 || pointer.shift) {
      this.shift(dx, dy);
    } else {
      this.turn(dx, dy);
    }
    pointer.x = event.clientX;
    pointer.y = event.clientY;
    this.touched();
  }
  wheel(event) {
    event.preventDefault();
    this.wheelAt = performance.now();
    this.approach(Math.exp(Math.max(-1, Math.min(1, 0.0015 * event.deltaY))));
    this.touched();
    setTimeout(() => this.onMove(), 220);
  }
  key(event, isDown) {
    if (/^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName) || event.ctrlKey || event.metaKey) return;
    if (!'wasdqe'.includes(event.key.toLowerCase()) && !event.key.startsWith('Arrow')) return;
    if (isDown) this.keys.add(event.key.toLowerCase());
    else this.keys.delete(event.key.toLowerCase());
    this.onMove();
  }

  distance() { return this.camera.position.distanceTo(this.target); }

  turn(dx, dy) {
    const {camera} = this;
    const right = new THREE.Vector3(1, 0, 0).applyQuaternion(camera.quaternion);
    const sign = this.isFlying ? -0.6 : 1;
    const ahead = new THREE.Vector3(0, 0, -1).applyQuaternion(camera.quaternion);
    let pitch = -sign * 0.005 * dy;
    const elevation = Math.asin(Math.max(-1, Math.min(1, ahead.dot(this.up))));
    pitch = Math.max(-1.55 - elevation, Math.min(1.55 - elevation, pitch));
    const turned = new THREE.Quaternion().setFromAxisAngle(this.up, -sign * 0.005 * dx)
      .multiply(new THREE.Quaternion().setFromAxisAngle(right, pitch));
    camera.quaternion.premultiply(turned).normalize();
    if (this.isFlying) {
      this.target.sub(camera.position).applyQuaternion(turned).add(camera.position);
    } else {
      camera.position.sub(this.target).applyQuaternion(turned).add(this.target);
    }
    this.level();
  }
  // Brings the horizon back, as far as there is one.
  level() {
    const ahead = new THREE.Vector3(0, 0, -1).applyQuaternion(this.camera.quaternion);
    if (Math.abs(ahead.dot(this.up)) > 0.9999) return;
    this.camera.up.copy(this.up);
    this.camera.lookAt(this.camera.position.clone().add(ahead));
  }
  shift(dx, dy) {
    const perPixel = 2 * this.distance() * Math.tan(this.camera.fov * Math.PI / 360) / window.innerHeight;
    this.translate(new THREE.Vector3(-dx * perPixel, dy * perPixel, 0));
  }
  translate(inCamera) {
    const by = inCamera.applyQuaternion(this.camera.quaternion);
    this.camera.position.add(by);
    this.target.add(by);
  }
  approach(factor) {
    const away = this.camera.position.clone().sub(this.target);
    const length = Math.max(away.length() * factor, 1e-4 * this.extent);
    this.camera.position.copy(this.target).add(away.setLength(length));
  }
  turnAbout(point) {
    if (!point) return;
    const to = this.camera.position.clone().sub(this.target).setLength(0.4 * this.camera.position.distanceTo(point)).add(point);
    const camera = this.camera.clone();
    camera.position.copy(to);
    camera.up.copy(this.up);
    camera.lookAt(point);
    this.goTo(to, camera.quaternion, point);
    this.isTouched = true;
  }

  // Flies there within half a second.
  goTo(position, quaternion, target, lens = null) {
    this.flight = {begin: performance.now(), from: this.camera.position.clone(), fromQ: this.camera.quaternion.clone(),
      to: position.clone(), toQ: quaternion.clone(), target: target.clone(), lens};
    this.lens = null;
    this.onMove();
  }
  // Is there at once.
  set(position, quaternion, depth, lens = null) {
    this.flight = null;
    this.camera.position.copy(position);
    this.camera.quaternion.copy(quaternion);
    this.target.set(0, 0, -depth).applyQuaternion(quaternion).add(position);
    this.lens = lens;
    this.onMove();
  }

  // Before a picture; `seconds` since the one before. True while it moves by itself.
  step(seconds) {
    const {flight, camera} = this;
    if (flight) {
      const x = Math.min(1, (performance.now() - flight.begin) / 500), s = x * x * (3 - 2 * x);
      camera.position.lerpVectors(flight.from, flight.to, s);
      camera.quaternion.slerpQuaternions(flight.fromQ, flight.toQ, s);
      if (x === 1) {
        this.target.copy(flight.target);
        this.lens = flight.lens;
        this.flight = null;
      }
    }
    if (this.keys.size > 0) {
      const speed = 0.6 * Math.max(this.distance(), 0.02 * this.extent) * Math.min(seconds, 0.1);
      const has = (...names) => names.some((name) => this.keys.has(name)) ? speed : 0;
      this.translate(new THREE.Vector3(has('d', 'arrowright') - has('a', 'arrowleft'), has('e') - has('q'),
        has('s', 'arrowdown') - has('w', 'arrowup')));
      this.isTouched = true;
      this.lens = null;
    }
    this.project();
    return this.flight !== null || this.keys.size > 0;
  }
  project() {
    const {camera} = this, width = window.innerWidth, height = window.innerHeight;
    camera.aspect = width / height;
    camera.near = Math.max(1e-3 * this.extent, 0.01 * Math.min(this.distance(), this.extent));
    camera.far = 20 * this.extent + this.distance();
    if (this.lens) camera.near = 1e-3 * this.extent;
    camera.updateProjectionMatrix();
    if (this.lens) this.projectLens(width, height);
    camera.updateMatrixWorld();
  }
  // The image of the lens fills the window as far as its form allows; its pixel (0, 0) is a centre.
  projectLens(width, height) {
    const {fx, fy, cx, cy, width: w, height: h} = this.lens;
    const s = Math.min(width / w, height / h);
    const left = 0.5 * (width - s * w), top = 0.5 * (height - s * h);
    const P = this.camera.projectionMatrix.elements;
    P[0] = 2 * s * fx / width;
    P[5] = 2 * s * fy / height;
    P[8] = 1 - 2 * (left + s * (cx + 0.5)) / width;
    P[9] = 2 * (top + s * (cy + 0.5)) / height - 1;
    this.camera.projectionMatrixInverse.copy(this.camera.projectionMatrix).invert();
  }
}
