// The page: joins the connection with what is drawn and with the panel.

import "./page.css";
import { Vector3 } from "three";
import { Bodies } from "./bodies.js";
import { Connection } from "./connection.js";
import { Overlays } from "./overlays.js";
import { Panel } from "./panel.js";
import { Pointer } from "./pointer.js";
import { Stage } from "./stage.js";

const parameters = new URLSearchParams(location.search);
const stage = new Stage(document.getElementById("stage"), { shadows: parameters.get("shadows") !== "off" });
const bodies = new Bodies(stage.scene);
const overlays = new Overlays(stage.scene, bodies);
const state = { show: null, status: null, frames: 0, drawn: 0, screenshots: 0 };
let wantsScreenshot = false;

const connection = new Connection({
  connected(on) {
    document.getElementById("lost").hidden = on;
    // A simulation that was started anew counts its shows anew.
    if (on) {
      state.show = null;
      sendOverlays();
    }
  },
  show(show) {
    const again = state.show?.name === show.name && state.show?.level === show.level;
    bodies.clear();
    stage.setLight(show.light);
    if (!again) follow(true);
    state.show = show;
    state.frames = 0;
    panel.setShow(show);
  },
  status(status) {
    state.status = status;
    panel.setStatus(status);
  },
  mesh: (mesh) => bodies.addMesh(mesh),
  heights: ({ number, heights }) => bodies.setHeights(number, heights),
  frame(frame) {
    if (frame.show !== state.show?.number) return;
    const blended = bodies.setFrame(frame, performance.now());
    stage.setView(frame, blended);
    state.frames++;
  },
});

const panel = new Panel(
  (type, fields) => connection.send(type, fields),
  (name, on) => {
    if (name === "wireframe") bodies.setWireframe(on);
    else if (name === "resting") bodies.setRestingTransparent(on);
    else if (name === "gravity") connection.send("point_gravity", { on });
    else if (name === "follow") follow(on);
    else {
      overlays.shown[name] = on;
      sendOverlays();
    }
  },
  () => { wantsScreenshot = true; },
);

const pointer = new Pointer(stage, bodies, overlays, {
  kick: (body, point, velocity) => connection.send("kick", { body, point, velocity }),
  turn: () => follow(false),
});

function follow(on) {
  if (on) stage.begin();
  else stage.release();
  panel.setToggle("follow", on);
}

function sendOverlays() {
  const { contacts, cells } = overlays.shown;
  connection.send("overlays", { contacts, cells });
}

function saveScreenshot() {
  const link = document.createElement("a");
  link.download = `${(state.show?.name ?? "avalanche").replaceAll("/", "-")}-${bodies.frame?.number ?? 0}.png`;
  link.href = stage.canvas.toDataURL("image/png");
  link.click();
  state.screenshots++;
}

function draw(now) {
  requestAnimationFrame(draw);
  bodies.update(now);
  pointer.update();
  if (bodies.frame) overlays.update(bodies.frame, 0.02 * stage.scale);
  stage.setPanelWidth(panel.width());
  stage.render(bodies.share);
  state.drawn++;
  if (wantsScreenshot) {
    wantsScreenshot = false;
    saveScreenshot();
  }
}
requestAnimationFrame(draw);

// What tests in a browser wait for and ask.
window.viewer = {
  state,
  connection,
  stage,
  bodies,
  overlays,
  pointer,
  ready: () => state.show !== null && state.frames > 0 && bodies.places.size > 0,
  handles: () => [...bodies.places].filter(([, place]) => place.pushable).map(([handle]) => handle),
  screenPosition(handle) {
    const place = bodies.places.get(handle);
    if (!place) return null;
    const box = stage.canvas.getBoundingClientRect();
    const p = place.position.clone().project(stage.camera);
    return [box.left + (0.5 + 0.5 * p.x) * box.width, box.top + (0.5 - 0.5 * p.y) * box.height];
  },
  position: (handle) => bodies.places.get(handle)?.position.toArray() ?? null,
  project: (point) => new Vector3(...point).project(stage.camera).toArray(),
};
