// Clicks and drags: a click kicks a body along the line of sight, a drag aims and says how hard; elsewhere they turn the view.

import { Matrix4, Plane, Raycaster, Vector2, Vector3 } from "three";

const CLICK_REACH = 4; // [pixels] a click moves less
const CLICK_KICK = 0.12; // [1/s] change of velocity of a click, in sizes of the view
const DRAG_KICK = 1.2; // [1/s] change of velocity for the length of the arrow

export class Pointer {
  constructor(stage, bodies, overlays, { kick, turn }) {
    Object.assign(this, { stage, bodies, overlays, kick, turn });
    this.raycaster = new Raycaster();
    this.held = null;
    const canvas = stage.canvas;
    // On its way down to the canvas, before the controls of the camera: these must not turn the view when a body is
    // dragged, and are made anew when the user takes the view over.
    addEventListener("pointerdown", (event) => event.target === canvas && this.down(event), { capture: true });
    addEventListener("wheel", (event) => event.target === canvas && turn(), { capture: true, passive: true });
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", () => this.letGo());
  }

  aim(event) {
    const box = this.stage.canvas.getBoundingClientRect();
    const x = (2 * (event.clientX - box.left)) / box.width - 1, y = 1 - (2 * (event.clientY - box.top)) / box.height;
    this.raycaster.setFromCamera(new Vector2(x, y), this.stage.camera);
    return this.raycaster;
  }

  down(event) {
    const found = event.button === 0 && event.isPrimary ? this.bodies.pick(this.aim(event)) : null;
    if (!found?.pushable) {
      this.turn();
      return;
    }
    event.stopImmediatePropagation();
    this.stage.canvas.setPointerCapture(event.pointerId);
    const place = this.bodies.places.get(found.handle);
    const inverse = new Matrix4().compose(place.position, place.turn, new Vector3(1, 1, 1)).invert();
    this.held = {
      handle: found.handle,
      local: found.point.clone().applyMatrix4(inverse), // the body moves on while the user aims
      start: [event.clientX, event.clientY],
      dragged: false,
      end: null,
      x: event.clientX,
      y: event.clientY,
    };
  }

  move(event) {
    const held = this.held;
    if (!held) return;
    held.x = event.clientX;
    held.y = event.clientY;
    if (Math.hypot(held.x - held.start[0], held.y - held.start[1]) >= CLICK_REACH) held.dragged = true;
    this.update();
  }

  // Draw the arrow from where the held point is now; null if the body is gone.
  update() {
    const held = this.held;
    if (!held) return null;
    const place = this.bodies.places.get(held.handle);
    if (!place) {
      this.letGo();
      return null;
    }
    const from = held.local.clone().applyQuaternion(place.turn).add(place.position);
    if (!held.dragged) return { from, to: from };
    // The arrow lies in the plane through the point that faces the camera.
    const facing = new Plane().setFromNormalAndCoplanarPoint(this.stage.camera.getWorldDirection(new Vector3()), from);
    const to = this.aim({ clientX: held.x, clientY: held.y }).ray.intersectPlane(facing, new Vector3());
    if (!to) return null;
    this.overlays.showArrow(from, to);
    return { from, to };
  }

  up(event) {
    const held = this.held;
    if (!held) return;
    held.x = event.clientX;
    held.y = event.clientY;
    const arrow = this.update();
    if (arrow) {
      const velocity = held.dragged
        ? arrow.to.clone().sub(arrow.from).multiplyScalar(DRAG_KICK)
        : this.aim(event).ray.direction.clone().multiplyScalar(CLICK_KICK * this.stage.scale);
      this.kick(held.handle, held.local.toArray(), velocity.toArray());
    }
    this.letGo();
  }

  letGo() {
    this.held = null;
    this.overlays.hideArrow();
  }
}
