// The bodies and markers of the last frame, drawn as instances: one batch for each mesh and kind of surface.

import {
  BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, InstancedBufferAttribute, InstancedMesh, Matrix4, Quaternion, Vector3,
} from "three";
import { makeMaterial } from "./material.js";
import { GROUND, PUSHABLE, RESTING, ROW_WIDTH, SHADOWLESS, UNLIT } from "./protocol.js";

const RESTING_OPACITY = 0.3;
const FIRST_CAPACITY = 8;
const SMOOTHED_ABOVE = 0.025; // [s] frames that stay longer are blended into the next

// A picture may be of a moment before the frame came.
const clamp = (share) => Math.min(Math.max(share, 0), 1);

function rowsByHandle(frame) {
  const rows = new Map();
  for (let o = 0; o < frame.rows.length; o += ROW_WIDTH) rows.set(frame.rows[o], frame.rows.subarray(o, o + ROW_WIDTH));
  return rows;
}

export class Bodies {
  constructor(scene) {
    this.scene = scene;
    this.meshes = new Map();
    this.batches = new Map();
    this.settings = { wireframe: false, restingTransparent: false };
    this.clear();
  }

  // Another show: its meshes come anew.
  clear() {
    for (const batch of this.batches.values()) this.drop(batch);
    for (const mesh of this.meshes.values()) mesh.geometry.dispose();
    this.batches.clear();
    this.meshes.clear();
    this.frame = this.start = null;
    this.done = true;
    this.share = 1; // of the way from the last frame to this one that has passed
    this.places = new Map(); // by handle: what is drawn now
  }

  drop(batch) {
    this.scene.remove(batch.object);
    batch.object.dispose();
    batch.object.material.dispose();
    batch.object.geometry.dispose();
  }

  addMesh(mesh) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(mesh.positions.slice(), 3));
    geometry.setAttribute("normal", new BufferAttribute(mesh.normals.slice(), 3));
    if (mesh.colors) geometry.setAttribute("color", new BufferAttribute(mesh.colors, 4));
    geometry.setIndex(new BufferAttribute(mesh.faces, 1));
    this.meshes.set(mesh.number, { ...mesh, geometry });
  }

  // Surface of a height field, its normals by central differences, and the upper rim of its sides.
  setHeights(number, heights) {
    const mesh = this.meshes.get(number);
    if (!mesh) return;
    const [rows, columns] = mesh.grid;
    const position = mesh.geometry.attributes.position, normal = mesh.geometry.attributes.normal;
    const p = position.array, n = normal.array;
    const dx = p[3] - p[0], dy = p[3 * columns + 1] - p[1];
    const at = (row, column) => heights[row * columns + column];
    for (let row = 0; row < rows; row++) {
      const above = Math.min(row + 1, rows - 1), below = Math.max(row - 1, 0);
      for (let column = 0; column < columns; column++) {
        const right = Math.min(column + 1, columns - 1), left = Math.max(column - 1, 0);
        const slopeX = (at(row, right) - at(row, left)) / ((right - left) * dx);
        const slopeY = (at(above, column) - at(below, column)) / ((above - below) * dy);
        const length = Math.hypot(slopeX, slopeY, 1), i = 3 * (row * columns + column);
        p[i + 2] = at(row, column);
        n[i] = -slopeX / length;
        n[i + 1] = -slopeY / length;
        n[i + 2] = 1 / length;
      }
    }
    const size = rows * columns, sides = p.length / 3 - size;
    if (sides > 0) {
      const rim = [];
      for (let column = 0; column < columns; column++) rim.push(at(0, column));
      for (let row = 0; row < rows; row++) rim.push(at(row, columns - 1));
      for (let column = columns - 1; column >= 0; column--) rim.push(at(rows - 1, column));
      for (let row = rows - 1; row >= 0; row--) rim.push(at(row, 0));
      let bottom = p[p.length - 1];
      for (const height of rim) bottom = Math.min(bottom, height);
      rim.forEach((height, index) => {
        p[3 * (size + index) + 2] = height;
        p[3 * (size + sides / 2 + index) + 2] = bottom;
      });
    }
    position.needsUpdate = normal.needsUpdate = true;
    for (const batch of this.batches.values()) {
      if (batch.mesh !== mesh) continue;
      batch.object.geometry.attributes.position.needsUpdate = true;
      batch.object.geometry.boundingSphere = batch.object.geometry.boundingBox = null;
    }
  }

  // Returns whether the frame before it is blended into it.
  setFrame(frame, now) {
    // What jumps is not blended: the first frame, and one that came after a gap.
    const inTurn = this.frame !== null && this.frame.number + 1 === frame.number;
    this.start = inTurn && frame.duration > SMOOTHED_ABOVE ? rowsByHandle(this.frame) : null;
    this.frame = frame;
    this.arrived = now;
    this.done = false;
    return this.start !== null;
  }

  // Put every instance where it is to be seen at this time [ms].
  update(now) {
    const { frame, start } = this;
    if (!frame || this.done) return;
    const share = (this.share = start ? clamp((now - this.arrived) / (1000 * frame.duration)) : 1);
    this.done = share >= 1;
    const places = new Map();
    for (const batch of this.batches.values()) batch.count = 0;
    const matrix = new Matrix4(), unit = new Vector3(1, 1, 1), color = new Color();
    for (let i = 0; i < frame.count; i++) {
      const o = i * ROW_WIDTH, row = frame.rows;
      const handle = row[o], mesh = this.meshes.get(row[o + 1]), flags = row[o + 4];
      if (!mesh) continue;
      const position = new Vector3(row[o + 5], row[o + 6], row[o + 7]);
      const turn = new Quaternion(row[o + 9], row[o + 10], row[o + 11], row[o + 8]);
      const from = share < 1 ? start.get(handle) : undefined;
      if (from && from[1] === row[o + 1]) {
        position.lerpVectors(new Vector3(from[5], from[6], from[7]), position.clone(), share);
        turn.slerpQuaternions(new Quaternion(from[9], from[10], from[11], from[8]), turn.clone(), share);
      }
      const resting = (flags & RESTING) !== 0 && (flags & PUSHABLE) !== 0;
      const opacity = row[o + 3] * (resting && this.settings.restingTransparent ? RESTING_OPACITY : 1);
      const batch = this.batchOf(mesh, opacity < 1 || (flags & UNLIT) !== 0, flags);
      const slot = batch.count++;
      batch.object.setMatrixAt(slot, matrix.compose(position, turn, unit));
      batch.object.setColorAt(slot, color.setHex(row[o + 2]));
      batch.opacity.array[slot] = opacity;
      batch.handles[slot] = handle;
      places.set(handle, { mesh, position, turn, flags, pushable: (flags & PUSHABLE) !== 0 });
    }
    for (const batch of this.batches.values()) {
      batch.object.count = batch.count;
      batch.object.visible = batch.count > 0;
      batch.object.instanceMatrix.needsUpdate = batch.opacity.needsUpdate = true;
      if (batch.object.instanceColor) batch.object.instanceColor.needsUpdate = true;
      // Else a click would look for bodies where they were when first drawn.
      batch.object.boundingSphere = null;
    }
    this.places = places;
  }

  batchOf(mesh, transparent, flags) {
    const unlit = (flags & UNLIT) !== 0, ground = (flags & GROUND) !== 0, shadow = (flags & SHADOWLESS) === 0;
    const key = `${mesh.number} ${transparent} ${unlit} ${ground}`;
    let batch = this.batches.get(key);
    if (batch && batch.count < batch.handles.length) return batch;
    const capacity = batch ? 2 * batch.handles.length : FIRST_CAPACITY;
    const geometry = new BufferGeometry();
    geometry.index = mesh.geometry.index;
    for (const name in mesh.geometry.attributes) geometry.setAttribute(name, mesh.geometry.attributes[name]);
    const opacity = new InstancedBufferAttribute(new Float32Array(capacity).fill(1), 1).setUsage(DynamicDrawUsage);
    geometry.setAttribute("opacity", opacity);
    const material = makeMaterial(mesh, { transparent, unlit, ground });
    material.wireframe = this.settings.wireframe;
    const object = new InstancedMesh(geometry, material, capacity);
    object.instanceMatrix.setUsage(DynamicDrawUsage);
    object.setColorAt(0, new Color(1, 1, 1));
    object.frustumCulled = false;
    object.castShadow = shadow && !unlit;
    object.receiveShadow = !unlit;
    object.renderOrder = transparent ? 1 : 0;
    const grown = { mesh, object, opacity, handles: new Float64Array(capacity), count: 0 };
    if (batch) {
      for (let slot = 0; slot < batch.count; slot++) {
        const matrix = new Matrix4(), color = new Color();
        batch.object.getMatrixAt(slot, matrix);
        batch.object.getColorAt(slot, color);
        object.setMatrixAt(slot, matrix);
        object.setColorAt(slot, color);
        opacity.array[slot] = batch.opacity.array[slot];
        grown.handles[slot] = batch.handles[slot];
      }
      grown.count = batch.count;
      this.drop(batch);
    }
    object.userData.batch = grown;
    this.batches.set(key, grown);
    this.scene.add(object);
    return grown;
  }

  setWireframe(on) {
    this.settings.wireframe = on;
    for (const batch of this.batches.values()) batch.object.material.wireframe = on;
  }

  setRestingTransparent(on) {
    this.settings.restingTransparent = on;
    this.done = false;
  }

  // The first body on a ray: its handle, the point in the world, and whether it can be pushed.
  pick(raycaster) {
    const objects = [...this.batches.values()].filter((batch) => batch.count > 0).map((batch) => batch.object);
    for (const found of raycaster.intersectObjects(objects, false)) {
      const handle = found.object.userData.batch.handles[found.instanceId];
      if (handle >= 0) return { handle, point: found.point, pushable: this.places.get(handle)?.pushable ?? false };
    }
    return null;
  }

  // Smallest box along the world's axes that holds what is drawn of a body.
  bounds(handle, low, high) {
    const { mesh, position, turn } = this.places.get(handle);
    const m = new Matrix4().makeRotationFromQuaternion(turn).elements;
    const p = mesh.positions;
    const l = [Infinity, Infinity, Infinity], h = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < p.length; i += 3) {
      for (let axis = 0; axis < 3; axis++) {
        const value = m[axis] * p[i] + m[axis + 4] * p[i + 1] + m[axis + 8] * p[i + 2];
        if (value < l[axis]) l[axis] = value;
        if (value > h[axis]) h[axis] = value;
      }
    }
    low.fromArray(l).add(position);
    high.fromArray(h).add(position);
  }
}
