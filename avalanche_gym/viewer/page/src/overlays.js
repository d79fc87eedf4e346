// Bounding boxes, contact points with their normals, cells of the broad phase, and the arrow of a kick.

import {
  ArrowHelper, BoxGeometry, BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, EdgesGeometry, LineBasicMaterial, LineSegments,
  Points, PointsMaterial, Vector3,
} from "three";
import { CELL_WIDTH, CONTACT_WIDTH } from "./protocol.js";

const EDGES = new EdgesGeometry(new BoxGeometry(1, 1, 1)).attributes.position.array;

class Segments {
  constructor(scene, color, opacity, depthTest) {
    const material = new LineBasicMaterial({ color, transparent: true, opacity, depthTest, fog: false });
    this.object = new LineSegments(new BufferGeometry(), material);
    this.object.frustumCulled = false;
    this.object.renderOrder = 2;
    scene.add(this.object);
  }

  set(array) {
    setPositions(this.object, array);
  }
}

function setPositions(object, array) {
  const old = object.geometry.attributes.position;
  if (!old || old.array.length < array.length) {
    object.geometry.dispose();
    object.geometry = new BufferGeometry();
    const attribute = new BufferAttribute(new Float32Array(Math.max(2 * array.length, 96)), 3).setUsage(DynamicDrawUsage);
    object.geometry.setAttribute("position", attribute);
  }
  const attribute = object.geometry.attributes.position;
  attribute.array.set(array);
  attribute.needsUpdate = true;
  object.geometry.setDrawRange(0, array.length / 3);
  object.visible = array.length > 0;
}

function pushBox(list, low, high) {
  for (let i = 0; i < EDGES.length; i += 3) {
    for (let axis = 0; axis < 3; axis++) {
      const share = EDGES[i + axis] + 0.5;
      list.push(low.getComponent(axis) * (1 - share) + high.getComponent(axis) * share);
    }
  }
}

export class Overlays {
  constructor(scene, bodies) {
    this.bodies = bodies;
    this.shown = { boxes: false, contacts: false, cells: false };
    this.boxes = new Segments(scene, new Color("#ffe9a8"), 0.9, true);
    this.cells = new Segments(scene, new Color("#59d0ff"), 0.45, true);
    this.normals = new Segments(scene, new Color("#ff3b6b"), 1, false);
    const material = new PointsMaterial({ color: "#ff3b6b", size: 7, sizeAttenuation: false, depthTest: false, fog: false });
    this.points = new Points(new BufferGeometry(), material);
    this.points.frustumCulled = false;
    this.points.renderOrder = 3;
    scene.add(this.points);
    this.arrow = new ArrowHelper(new Vector3(1, 0, 0), new Vector3(), 1, 0xffffff);
    this.arrow.line.material.depthTest = this.arrow.cone.material.depthTest = false;
    this.arrow.line.renderOrder = this.arrow.cone.renderOrder = 4;
    this.arrow.visible = false;
    scene.add(this.arrow);
  }

  update(frame, unit) {
    const boxes = [];
    if (this.shown.boxes) {
      const low = new Vector3(), high = new Vector3();
      for (const [handle, place] of this.bodies.places) {
        if (!place.pushable) continue;
        this.bodies.bounds(handle, low, high);
        pushBox(boxes, low, high);
      }
    }
    this.boxes.set(boxes);

    const points = [], normals = [];
    if (this.shown.contacts) {
      const c = frame.contacts;
      for (let i = 0; i < c.length; i += CONTACT_WIDTH) {
        points.push(c[i], c[i + 1], c[i + 2]);
        normals.push(c[i], c[i + 1], c[i + 2]);
        normals.push(c[i] + unit * c[i + 3], c[i + 1] + unit * c[i + 4], c[i + 2] + unit * c[i + 5]);
      }
    }
    setPositions(this.points, points);
    this.normals.set(normals);

    const cells = [];
    if (this.shown.cells) {
      const low = new Vector3(), high = new Vector3(), c = frame.cells;
      for (let i = 0; i < c.length; i += CELL_WIDTH) {
        low.fromArray(c, i);
        high.copy(low).addScalar(c[i + 3]);
        pushBox(cells, low, high);
      }
    }
    this.cells.set(cells);
    this.counts = { boxes: boxes.length / 72, contacts: points.length / 3, cells: cells.length / 72 };
  }

  showArrow(from, to) {
    const direction = to.clone().sub(from), length = direction.length();
    this.arrow.visible = length > 0;
    if (length === 0) return;
    this.arrow.position.copy(from);
    this.arrow.setDirection(direction.divideScalar(length));
    this.arrow.setLength(length, 0.25 * length, 0.12 * length);
  }

  hideArrow() {
    this.arrow.visible = false;
  }
}
