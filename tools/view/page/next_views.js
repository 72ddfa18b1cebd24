// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Where to fly next: an arrow from each proposed view to what it looks at, with its number.

import * as THREE from './three.module.min.js';
import {fromPose} from './controls.js';

const COLOUR = 0x961ea0;

export class NextViews {
  // `goTo(view)`: a person has chosen one.
  constructor(scene, labels, list, goTo) {
    Object.assign(this, {labels, list, goTo, views: [], chosen: null});
    this.arrows = new THREE.LineSegments(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({color: COLOUR}));
    this.arrows.frustumCulled = false;
    scene.add(this.arrows);
    this.setVisible(false);
  }
  get isVisible() { return this.arrows.visible; }
  setVisible(isVisible) {
    this.arrows.visible = isVisible;
    this.list.hidden = !isVisible;
  }
  update(views) {
    this.views = views.map((view) => ({...view, ...fromPose(view.pose), target: new THREE.Vector3(...view.target)}));
    const points = [];
    for (const {position, quaternion, target} of this.views) {
      const along = target.clone().sub(position), end = position.clone().addScaledVector(along, 0.9);
      const tip = (x, y) => new THREE.Vector3(x, y, 0).multiplyScalar(0.04 * along.length()).applyQuaternion(quaternion)
        .add(position).addScaledVector(along, 0.8);
      points.push(position, end);
      for (const [x, y] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) points.push(end, tip(x, y));
      // Like the frustum of a camera, so that it can be told which end is the camera's.
      const rim = [[-1, -0.7], [1, -0.7], [1, 0.7], [-1, 0.7]].map(([x, y]) =>
        new THREE.Vector3(x, y, -1.4).multiplyScalar(0.05 * along.length()).applyQuaternion(quaternion).add(position));
      rim.forEach((corner, i) => points.push(position, corner, corner, rim[(i + 1) % 4]));
    }
    this.arrows.geometry.dispose();
    this.arrows.geometry = new THREE.BufferGeometry().setFromPoints(points);
    this.list.replaceChildren(...this.views.map((view) => {
      const item = document.createElement('li'), button = document.createElement('button');
      button.textContent = `${view.reason} (${(100 * view.gain_share).toPrecision(2)} %)`;
      button.onclick = () => this.goTo(view);
      item.append(button);
      return item;
    }));
  }
  // After the camera has moved.
  place(camera, width, height) {
    this.labels.replaceChildren();
    if (!this.arrows.visible) return;
    this.views.forEach((view, i) => {
      const at = view.position.clone().project(camera);
      if (Math.abs(at.z) > 1) return;
      const label = document.createElement('span');
      label.textContent = i + 1;
      label.style.left = `${(at.x + 1) / 2 * width}px`;
      label.style.top = `${(1 - at.y) / 2 * height}px`;
      this.labels.append(label);
    });
  }
}
