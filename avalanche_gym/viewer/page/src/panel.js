// The panel: selectors, buttons, toggles, counters, and the keys that stand for them.

const element = (id) => document.getElementById(id);
const TOGGLES = ["boxes", "contacts", "cells", "resting", "wireframe", "gravity", "follow"];
const KEYS = {
  b: "boxes", c: "contacts", h: "cells", r: "resting", w: "wireframe", g: "gravity", f: "follow",
  " ": "pause", ".": "step", 0: "reset", p: "screenshot",
};

const MEANING = {
  resting: "bodies that have stood still for half a second",
  "energy drift": "what stepping alone added since the reset: friction and impacts make it fall, only a driven ground or an engine may make it rise",
  "solver residual": "worst relative residual of the contact problem in the last frame",
  "step time": "processor time that the steps of a frame take",
};

export class Panel {
  // `wish` sends to the simulation; `toggled` hears of every toggle.
  constructor(wish, toggled, screenshot) {
    Object.assign(this, { wish, toggled, screenshot });
    this.paused = false;
    element("show").onchange = () => this.open(element("show").value, "");
    element("level").onchange = () => this.open(element("show").value, element("level").value);
    element("driver").onchange = () => wish("driver", { name: element("driver").value });
    element("pause").onclick = () => {
      // Not left to the answer, which may come after the next press.
      this.paused = !this.paused;
      wish("pause", { on: this.paused });
    };
    element("step").onclick = () => wish("step");
    element("reset").onclick = () => wish("reset");
    element("screenshot").onclick = () => screenshot();
    element("speed").oninput = () => {
      const value = 2 ** Number(element("speed").value);
      element("speed-value").value = speedText(value);
      wish("speed", { value });
    };
    element("fold").onclick = () => {
      const folded = element("panel").classList.toggle("folded");
      element("fold").textContent = folded ? "+" : "–";
    };
    for (const name of TOGGLES) element(name).onchange = () => toggled(name, element(name).checked);
    // After a choice by mouse, keys mean the scene again.
    for (const control of document.querySelectorAll("select")) control.addEventListener("change", () => control.blur());
    element("speed").addEventListener("pointerup", () => element("speed").blur());
    addEventListener("keydown", (event) => this.key(event));
  }

  open(show, level) {
    this.wish("open", { show, level });
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey || event.target.matches?.("select, input[type=range]")) return;
    const name = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!name) return;
    // Space would scroll, or press the button that was used last.
    event.preventDefault();
    if (event.repeat && name !== "step") return;
    const control = element(name);
    if (control.closest("label")?.hidden) return;
    control.click();
  }

  setShow(show) {
    element("title").textContent = show.title;
    element("description").textContent = element("description").title = show.description;
    const groups = { demo: "Demos", environment: "Environments" };
    element("show").replaceChildren(
      ...Object.entries(groups).map(([kind, label]) => {
        const group = document.createElement("optgroup");
        group.label = label;
        group.append(...show.catalogue.filter((entry) => entry.kind === kind).map((entry) => option(entry.name, entry.title)));
        return group;
      }),
    );
    element("show").value = show.name;
    this.fill("level", show.levels, show.level);
    this.fill("driver", show.drivers, "");
    element("gravity-row").hidden = !show.hasPointGravity;
    element("follow-row").hidden = !show.cameraMoves;
  }

  fill(id, names, chosen) {
    element(id).replaceChildren(...names.map((name) => option(name, name)));
    element(id).hidden = names.length === 0;
    if (chosen) element(id).value = chosen;
  }

  setStatus({ counters, more, settings, server, note }) {
    this.paused = settings.paused;
    element("pause").setAttribute("aria-pressed", String(settings.paused));
    element("pause").firstElementChild.textContent = settings.paused ? "Go on" : "Pause";
    if (document.activeElement !== element("speed")) {
      element("speed").value = String(Math.round(Math.log2(settings.speed)));
      element("speed-value").value = speedText(settings.speed);
    }
    if (settings.driver) element("driver").value = settings.driver;
    element("gravity").checked = settings.pointGravity === true;
    const rows = [
      ["frames", String(counters.frames)],
      ["bodies", String(counters.bodies)],
      ["resting", String(counters.resting)],
      ["contacts", String(counters.contacts)],
      ["energy", `${significant(counters.energy)} J`],
      ["energy drift", `${significant(counters["energy change"])} J`],
      ["solver residual", counters.residual === null ? "–" : counters.residual.toExponential(1)],
      ["step time", `${(1000 * counters["step time"]).toFixed(2)} ms`],
      ...Object.entries(more).map(([name, value]) => [name, String(value)]),
    ];
    if (server.pages > 1) rows.push(["pages", String(server.pages)]);
    if (server.malformed + server.refused > 0) rows.push(["ignored messages", String(server.malformed + server.refused)]);
    const list = element("counters");
    while (list.childElementCount > 2 * rows.length) list.lastElementChild.remove();
    rows.forEach(([name, value], index) => {
      const term = list.children[2 * index] ?? list.appendChild(document.createElement("dt"));
      const data = list.children[2 * index + 1] ?? list.appendChild(document.createElement("dd"));
      if (term.textContent !== name) term.textContent = name;
      if (data.textContent !== value) data.textContent = value;
      data.className = value === "success" ? "good" : value === "failed" ? "bad" : "";
      data.dataset.name = name;
      term.title = MEANING[name] ?? "";
    });
    element("note").textContent = note;
  }

  // [pixels] that the panel hides of the scene.
  width() {
    const box = element("panel").getBoundingClientRect();
    return element("panel").classList.contains("folded") ? 0 : box.right;
  }

  setToggle(name, on) {
    element(name).checked = on;
  }
}

function option(value, text) {
  const made = document.createElement("option");
  made.value = value;
  made.textContent = text;
  return made;
}

function speedText(value) {
  return value >= 1 ? `${value}×` : `1/${Math.round(1 / value)}×`;
}

function significant(value) {
  if (value === null) return "–";
  return Math.abs(value) >= 1e5 || (value !== 0 && Math.abs(value) < 1e-3) ? value.toExponential(2) : value.toPrecision(4);
}
