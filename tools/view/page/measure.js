// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The distance of two points of the model.

import * as THREE from './three.module.min.js';

export class Measure {
  constructor(scene, labels, output) {
    this.labels = labels;
    this.output = output;
    this.points = [];
    this.isOn = false;
    this.metresPerUnit = null;  // not known
    this.scaleSigma = 0;
    const material = new THREE.LineBasicMaterial({color: 0x111111, depthTest: false});
    this.line = new THREE.LineSegments(new THREE.BufferGeometry(), material);
    this.line.frustumCulled = false;
    this.line.renderOrder = 1;
    scene.add(this.line);
  }
  setOn(isOn) {
    this.isOn = isOn;
    this.points = [];
    this.draw();
  }
  add(point) {
    if (this.points.length === 2) this.points = [];
    this.points.push(point);
    this.draw();
  }
  // Relative standard deviation of the scale.
  setScale(metresPerUnit, sigma) {
    if (metresPerUnit === this.metresPerUnit && sigma === this.scaleSigma) return;
    this.metresPerUnit = metresPerUnit;
    this.scaleSigma = sigma;
    this.draw();
  }
  // As text: in metres where the scale is known.
  get length() {
    if (this.metresPerUnit === null) return `${this.distance.toPrecision(4)} units`;
    return `${(this.distance * this.metresPerUnit).toPrecision(4)} m`;
  }
  get doubt() {
    if (this.metresPerUnit === null) return '';
    return ` ± ${(this.distance * this.metresPerUnit * this.scaleSigma).toPrecision(2)} m by the scale`;
  }
  get distance() { return this.points.length === 2 ? this.points[0].distanceTo(this.points[1]) : null; }
  draw() {
    const two = this.points.length === 2 ? this.points : [];
    this.line.geometry.dispose();
    this.line.geometry = new THREE.BufferGeometry().setFromPoints(two);
    this.output.textContent = !this.isOn ? ''
      : this.distance === null ? `Click on ${this.points.length === 0 ? 'a point' : 'the other point'} of the model`
        : this.length + this.doubt;
  }
  // After the camera has moved.
  place(camera, width, height) {
    const ends = this.points.map((point) => point.clone().project(camera));
    this.labels.replaceChildren();
    ends.forEach((end, i) => {
      if (Math.abs(end.z) > 1) return;
      const label = document.createElement('span');
      label.textContent = i === 1 ? this.length.replace(' units', '') : '+';
      label.style.left = `${(end.x + 1) / 2 * width}px`;
      label.style.top = `${(1 - end.y) / 2 * height}px`;
      this.labels.append(label);
    });
  }
}
