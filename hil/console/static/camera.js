// A camera looked at live: corners and coverage of a board, tags, the robot; views taken and rejected; what is in force.
import { ask, byId, command, el, fill, number, suggest, tried, when, who } from "./core.js";

let state = { on: false }, refreshSet = () => {};
const FIND = [["board", "a calibration board"], ["tags", "tags"], ["robot", "the robot, with the camera file below"], ["nothing", "nothing"]];
const CONTROLS = [["exposure", "Exposure"], ["gain", "Gain"], ["white_balance_k", "White balance, K"], ["focus", "Focus"], ["width_px", "Width, px"], ["height_px", "Height, px"], ["rate_hz", "Rate, Hz"]];

export function make(whenTaken) {
  refreshSet = whenTaken;
  return el("div", { class: "card", id: "camera-live" }, el("h2", {}, "Camera, live"),
    el("div", { class: "fields" },
      el("div", {}, el("label", { for: "c-source" }, "Camera"), el("input", { id: "c-source", list: "cameras", placeholder: "0, a video file, or twin:SOCKET", spellcheck: false })),
      el("div", {}, el("label", { for: "c-find" }, "Look for"), el("select", { id: "c-find" }, ...FIND.map(([value, text]) => el("option", { value }, text)))),
      el("div", {}, el("label", { for: "c-dictionary" }, "Dictionary of the tags"), el("input", { id: "c-dictionary", value: "DICT_4X4_50", spellcheck: false }))),
    el("details", {}, el("summary", {}, "Exposure, white balance and the rest: locked at these values; empty: at what the camera chooses"),
      el("div", { class: "fields" }, ...CONTROLS.map(([name, text]) => el("div", {}, el("label", { for: `c-${name}` }, text), el("input", { id: `c-${name}`, type: "number", step: "any" }))))),
    el("div", { class: "row" }, el("button", { id: "c-open", type: "button", class: "main", on: { click: open } }, "Look"), el("button", { id: "c-close", type: "button", on: { click: () => command({ do: "look", what: "close" }) } }, "Let it go")),
    el("p", { id: "c-refused", class: "banner bad", role: "alert", hidden: true }),
    el("div", { id: "c-live", hidden: true },
      el("div", { class: "two" },
        el("div", {}, el("canvas", { id: "c-picture", role: "img", "aria-label": "Camera picture with what was found" }), el("p", { class: "help", id: "c-said" }),
          el("div", { class: "row" }, el("button", { id: "c-take", type: "button", on: { click: () => command({ do: "look", what: "take" }) } }, "Take this view"),
            el("button", { type: "button", id: "c-floor", on: { click: () => command({ do: "look", what: "picture", set: "floor" }) } }, "Use for step 2"),
            el("button", { type: "button", id: "c-colours", on: { click: () => command({ do: "look", what: "picture", set: "colours" }) } }, "Use for step 3")),
          el("label", { class: "check", id: "c-auto-box" }, el("input", { type: "checkbox", id: "c-auto", checked: true, on: { change: (event) => command({ do: "look", what: "auto", wanted: event.target.checked }) } }), "Take views by itself when the board is held still in a new place")),
        el("div", {}, el("div", { id: "c-controls" }), el("div", { id: "c-views-box" }, el("h3", {}, "Views taken"), el("ul", { id: "c-hints" }), el("ul", { class: "plain", id: "c-views" }))))));
}

export async function refresh() {
  const { camera, served } = await ask("/api/choices");
  suggest(byId("c-source"), camera || served[0]?.camera || "0");
  told();
}

function open() {
  const controls = {};
  for (const [name] of CONTROLS) if (byId(`c-${name}`).value) controls[name] = byId(`c-${name}`).valueAsNumber;
  command({ do: "look", what: "open", camera: { source: byId("c-source").value.trim(), find: byId("c-find").value, board: byId("s-board").value.trim(), dictionary: byId("c-dictionary").value.trim(), auto: byId("c-auto").checked, controls } });
}

when("camera", (message) => { state = message; told(); });
when("who", told);
when("picture-taken", ({ set }) => { if (byId("camera-live")) tried(() => refreshSet(set))(); });

let views = -1;
function told() {
  if (!byId("camera-live")) return;
  byId("c-open").disabled = !who.operator;
  byId("c-close").disabled = !who.operator || !state.on;
  byId("c-refused").hidden = !state.refused;
  byId("c-refused").textContent = state.refused || "";
  byId("c-live").hidden = !state.source;
  for (const id of ["c-take", "c-floor", "c-colours", "c-auto"]) byId(id).disabled = !who.operator || !state.on;
  const board = state.find === "board";
  byId("c-take").hidden = byId("c-auto-box").hidden = byId("c-views-box").hidden = !board;
  fill(byId("c-hints"), ...(state.hints || []).map((text) => el("li", {}, text)));
  fill(byId("c-views"), ...(state.views || []).map((view) => el("li", { class: "override" }, `${view.name}: ${view.corners} corners`,
    el("button", { type: "button", disabled: !who.operator || !state.on, "aria-label": `Reject ${view.name}`, on: { click: () => command({ do: "look", what: "drop", name: view.name }) } }, "Reject"))));
  if (board && (state.views || []).length !== views) { views = (state.views || []).length; if (state.views) tried(() => refreshSet("lens"))(); }
  controls();
}

function controls() {
  const list = state.controls;
  if (!list) { fill(byId("c-controls")); return; }
  const value = (v) => (v === null || v === undefined ? "–" : String(Number(v.toPrecision(6))));
  fill(byId("c-controls"), el("h3", {}, "Exposure and the like, as set and as in force"),
    list.length ? el("table", {}, el("thead", {}, el("tr", {}, ...["", "asked", "in force", ""].map((text) => el("th", {}, text)))), el("tbody", {}, ...list.map((item) => el("tr", {}, el("td", {}, item.name), el("td", {}, value(item.asked)), el("td", {}, value(item.in_force)),
      el("td", {}, el("span", { class: `pill ${item.refused || item.state !== "locked" ? "warn" : "good"}` }, item.refused ? "another than asked" : item.state))))))
      : el("p", { class: "help" }, "This source has no controls: only a live camera has."),
    state.note ? el("p", { class: "help" }, state.note) : null);
}

when("camera-picture", async ({ seen, jpeg }) => {
  if (!byId("camera-live") || !jpeg.size || byId("part-setup").hidden) return;
  const bitmap = await createImageBitmap(jpeg), canvas = byId("c-picture");
  canvas.width = bitmap.width;
  canvas.height = bitmap.height;
  const pen = canvas.getContext("2d"), scale = bitmap.width / seen.size[0];
  pen.drawImage(bitmap, 0, 0);
  uncovered(pen, canvas);
  const ring = (u, v, ink) => {
    for (const [colour, width] of [["#000", 4], [ink, 2]]) {
      pen.strokeStyle = colour;
      pen.lineWidth = width;
      pen.beginPath();
      pen.arc(u * scale, v * scale, 4, 0, 2 * Math.PI);
      pen.stroke();
    }
  };
  for (const [u, v] of seen.corners || []) ring(u, v, "#00e5ff");
  (seen.marks || []).forEach(([u, v], k) => ring(u, v, k ? "#ffea00" : "#00e5ff"));
  for (const tag of seen.tags || []) {
    pen.strokeStyle = "#ff3df2";
    pen.lineWidth = 3;
    pen.beginPath();
    tag.corners.forEach(([u, v], k) => (k ? pen.lineTo(u * scale, v * scale) : pen.moveTo(u * scale, v * scale)));
    pen.closePath();
    pen.stroke();
    const [u, v] = tag.corners[0];
    pen.font = "bold 15px system-ui, sans-serif";
    pen.fillStyle = "#000";
    pen.fillRect(u * scale - 2, v * scale - 19, pen.measureText(tag.id).width + 6, 18);
    pen.fillStyle = "#fff";
    pen.fillText(tag.id, u * scale + 1, v * scale - 5);
  }
  const found = seen.corners?.length ? `${seen.corners.length} corners` : "";
  byId("c-said").textContent = [found, seen.tags?.length ? `tags ${seen.tags.map((tag) => tag.id).join(", ")}` : "", seen.said, seen.took ? "taken" : "", `${seen.size[0]} × ${seen.size[1]} px`, seen.rate_hz ? `${number(seen.rate_hz, 1)} Hz` : ""].filter(Boolean).join("; ");
});

// Cells of the picture in which no corner was seen yet are darker.
function uncovered(pen, canvas) {
  const rows = state.find === "board" ? state.covered || [] : [];
  rows.forEach((row, j) => row.forEach((seen, i) => {
    if (seen) return;
    pen.fillStyle = "rgba(0, 0, 0, 0.4)";
    pen.fillRect((i * canvas.width) / row.length, (j * canvas.height) / rows.length, canvas.width / row.length, canvas.height / rows.length);
  }));
}
