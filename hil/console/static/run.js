// The Run page: order, arm, start, watch, and the report at the end.
import { byId, command, el, fill, number, tried, when, who } from "./core.js";
import * as form from "./form.js";
import { drawChart, drawFloor, drawPicture } from "./draw.js";
import * as tuning from "./tuning.js";

// In the order in which the console sends a tick.
const T = 0, X = 1, Y = 2, TH = 3, TX = 4, TY = 5, RX = 6, RY = 7, DX = 8, DY = 9, SX = 10, SY = 11, EPS = 12,
  WCL = 13, WCR = 14, WL = 15, WR = 16, PL = 17, PR = 18;
const ROWS = 4000, LONG_S = 60, WINDOW_S = 30;
let state = { phase: "idle" };
let floor = null, planned = [], trail = [], sigma = null, requirements = [], now = null, shownReport = "", drawn = false, armTimer = 0;

const CHARTS = [
  ["error", "Error", "mm", [["est", "distance to the reference", (r) => 1e3 * Math.hypot(r[DX] ?? NaN, r[DY] ?? NaN)]]],
  ["sliding", "Sliding variable and layer", "m/s²", [["est", "‖s‖", (r) => (r[SX] === null ? NaN : Math.hypot(r[SX], r[SY]))], ["ref", "boundary layer", (r) => r[EPS] ?? NaN, [5, 4]]]],
  ["wheels", "Wheel speeds", "rad/s", [["left", "left", (r) => r[WL] ?? NaN], ["right", "right", (r) => r[WR] ?? NaN], ["left", "left wanted", (r) => r[WCL] ?? NaN, [3, 4]], ["right", "right wanted", (r) => r[WCR] ?? NaN, [3, 4]]]],
  ["pwm", "PWM", "counts", [["left", "left", (r) => r[PL] ?? NaN], ["right", "right", (r) => r[PR] ?? NaN]]],
];
const FACTS = [
  ["battery_v", "Battery", (v) => `${number(v)} V`],
  ["est_eta1_m_s", "Speed", (v) => `${number(v, 3)} m/s`],
  ["est_theta_dot_rad_s", "Turn rate", (v) => `${number(v, 2)} rad/s`],
  ["rtt_s", "Link, round trip", (v) => `${number(1e3 * v, 1)} ms`],
  ["link_lost", "Frames lost", (v) => number(v, 0)],
  ["camera_latency_s", "Camera latency", (v) => `${number(1e3 * v, 0)} ms`],
  ["exposure_to_actuation_s", "Exposure to actuation", (v) => `${number(1e3 * v, 0)} ms`],
  ["pose_quality", "Pose quality", (v) => number(v, 2)],
  ["in_layer", "In the layer", (v) => (v === null ? "–" : v ? "yes" : "no")],
  ["saturated", "Held back by a limit", (v) => (v === null ? "–" : v ? "yes" : "no")],
  ["deadline_misses", "Deadlines missed", (v) => number(v, 0)],
];

export function make(place) {
  const runForm = el("form", { id: "run-form", on: { submit: (event) => event.preventDefault() } });
  fill(place, el("div", { class: "columns" },
    el("div", {},
      el("div", { class: "card" }, el("h2", {}, "1. What to run"), runForm),
      el("div", { class: "card" }, el("h2", { id: "arm-title" }, "2. Arm, then start"),
        el("p", { id: "arm-said", class: "help" }),
        el("div", { class: "row" },
          el("button", { id: "arm", type: "button", on: { click: arm } }, "Arm"),
          el("button", { id: "start", type: "button", class: "main", on: { click: tried(start) } }, "Start")),
        el("p", { id: "command", class: "help" }))),
    el("div", {},
      el("div", { class: "card", id: "live" },
        el("div", { class: "row" }, el("h2", {}, "Live"), el("span", { id: "phase", class: "pill", role: "status" })),
        el("p", { id: "outcome", class: "banner", role: "status", hidden: true }),
        el("div", { class: "two" },
          el("div", {}, el("canvas", { class: "floor", id: "floor", role: "img", "aria-label": "Floor with fence, reference, path and robot" }),
            el("div", { class: "legend" }, key("fence", "fence"), key("ref", "reference"), key("est", "believed"), key("true", "true (simulated)"), key("right", "10 σ of the pose")),
            el("p", { class: "help", id: "pose" }),
            el("div", { class: "charts" }, ...CHARTS.map(([id, title, , lines]) => el("div", {}, el("h3", {}, title),
              el("canvas", { class: "chart", id: `chart-${id}`, role: "img", "aria-label": title }),
              el("div", { class: "legend" }, ...lines.map(([ink, name, , dash]) => key(ink, dash ? `${name} (dashed)` : name))))))),
          el("div", {},
            el("div", { id: "picture-box", hidden: true }, el("div", { class: "picture" }, el("canvas", { id: "picture", role: "img", "aria-label": "Camera picture with marks found" })),
              el("p", { class: "help", id: "picture-said" })),
            el("h3", {}, "Requirements, as things stand"), el("ul", { class: "plain", id: "requirements" }),
            el("h3", {}, "Robot and link"), el("dl", { class: "facts", id: "facts" }),
            el("h3", {}, "Events"), el("ul", { class: "plain log", id: "events", tabIndex: 0, "aria-label": "Events" }))),
        tuning.make()),
      el("div", { class: "card", id: "report-box", hidden: true }, el("div", { class: "row" }, el("h2", {}, "Report"), el("a", { id: "report-link", target: "_blank", rel: "noopener" }, "in a page of its own")),
        el("iframe", { id: "report", title: "Report of the run" })))));
  form.make(runForm, (described) => {
    planned = described.requirements;
    if (!isOn() && !trail.length) { floor = described.floor; requirements = []; }
    showRequirements();
    draw();
  });
  tried(form.refresh)();
  addEventListener("target-changed", buttons);
  for (const event of ["resize", "themed"]) addEventListener(event, draw);
}

export function shown() { draw(); }

const key = (ink, text) => {
  const mark = el("span", { class: "key" });
  mark.style.background = `var(--${ink})`;
  return el("span", {}, mark, text);
};
const isOn = () => ["starting", "ready", "running", "stopping"].includes(state.phase);
const simulated = () => ["twin", "pil"].includes(byId("target").value) || byId("target").value.startsWith("replay:");

function arm() { command({ do: "arm", wanted: state.phase === "ready" || !(state.armed_s > 0) }); }
function start() {
  command({ do: "start", order: form.order() });
  if (innerWidth <= 800) byId("live").scrollIntoView();
}

function buttons() {
  // A simulated robot is armed before its start; a real one is found first, shown, and then armed.
  const armed = state.armed_s > 0 && !isOn(), ready = state.phase === "ready", first = simulated();
  byId("arm-title").textContent = first ? "2. Arm, then start" : "2. Connect, look, then arm";
  byId("arm").disabled = !who.operator || !(ready || (first && !isOn()));
  byId("arm").textContent = armed ? "Armed – lay down" : first ? "Arm" : "Arm: the robot moves";
  byId("arm").setAttribute("aria-pressed", String(armed));
  byId("arm").classList.toggle("main", ready);
  byId("arm").style.order = first ? "0" : "2";
  byId("start").textContent = first ? "Start" : "Connect";
  byId("start").disabled = !who.operator || isOn() || (first && !armed);
  byId("arm-said").textContent = !who.operator ? "You watch. Everybody may press STOP; only the operator starts."
    : ready ? "The robot is found and at rest. Is it where the picture shows it, and the floor clear? Arm moves it. STOP ends the run here."
    : isOn() ? "A run is on. STOP, or the space bar, stops the robot at any time."
      : armed ? "Armed for 30 s: Start will move the robot."
        : first ? "Arm, then Start; on a simulated robot nothing real moves."
          : "Connect finds the robot and moves nothing; it is armed after that.";
  form.lock(isOn());
  byId("command").textContent = state.command ? `The same at a terminal: ${state.command}` : "";
}

when("who", buttons);
when("state", (message) => {
  const before = state;
  state = message;
  clearTimeout(armTimer);
  if (state.armed_s > 0) armTimer = setTimeout(() => { state.armed_s = 0; buttons(); }, 1e3 * state.armed_s);
  if (state.run !== before.run || (state.phase === "starting" && before.phase !== "starting")) forget();
  if (state.begin?.floor) floor = state.begin.floor;
  const words = { idle: "nothing runs", starting: "starting", ready: "found, not armed", running: "running", stopping: "stopping", ended: "ended" };
  byId("phase").textContent = words[state.phase];
  byId("phase").className = `pill ${{ running: "good", stopping: "warn", starting: "warn", ready: "warn" }[state.phase] || ""}`;
  outcome();
  buttons();
  draw();
});
when("found", (found) => {
  state.found = found;
  if (state.phase !== "ready") return;
  const [x, y, theta] = found.pose;
  byId("pose").textContent = `robot found at x ${number(x, 3)} m, y ${number(y, 3)} m, heading ${number((theta * 180) / Math.PI, 1)}°; battery ${number(found.battery_v, 2)} V; firmware ${found.firmware}`;
  draw();
});
when("closed", () => { byId("phase").textContent = "no connection"; });
when("history", (message) => {
  trail = message.trail;
  trail.forEach(tune);
  requirements = message.requirements;
  fill(byId("events"));
  message.events.forEach(addEvent);
  showRequirements();
  draw();
});
when("live", (message) => {
  for (const row of message.trail || []) { trail.push(row); tune(row); }
  if (trail.length > ROWS) trail = trail.filter((_, k) => k % 2 === 0 || k > trail.length - 300);
  (message.events || []).forEach(addEvent);
  if (message.now) now = message.now;
  if (message.sigma) sigma = message.sigma;
  if (message.requirements?.length) requirements = message.requirements;
  showFacts();
  showRequirements();
  draw();
});
when("picture", async ({ seen, jpeg }) => {
  if (!jpeg.size || !floor) return;
  const bitmap = await createImageBitmap(jpeg);
  byId("picture-box").hidden = false;
  drawPicture(byId("picture"), bitmap, seen, floor.camera);
  byId("picture-said").textContent = seen.seen ? `robot seen at (${number(seen.x_m, 3)}, ${number(seen.y_m, 3)}) m, quality ${number(seen.quality)}` : "robot not seen";
});

const tune = (r) => tuning.took({ t: r[T], ex: r[DX], ey: r[DY], rx: r[RX], ry: r[RY] });

function forget() {
  trail = []; sigma = null; requirements = []; now = null; shownReport = "";
  fill(byId("events"));
  fill(byId("facts"));
  byId("report-box").hidden = byId("picture-box").hidden = true;
  byId("pose").textContent = "";
}

function outcome() {
  const place = byId("outcome"), end = state.end || {};
  const refused = state.refused;
  place.hidden = !(end.outcome || refused);
  if (refused) { place.className = "banner bad"; place.textContent = refused; return; }
  if (!end.outcome) { place.textContent = ""; return; }
  requirements = end.requirements;
  showRequirements();
  const held = end.outcome === "complete" && end.requirements.every((item) => item.holds);
  place.className = `banner ${held ? "good" : "bad"}`;
  const how = { complete: held ? "Complete: every requirement holds." : "Complete, but a requirement does not hold.", interrupted: "Stopped.", fault: "Fault." }[end.outcome];
  place.textContent = [how, end.outcome === "fault" ? end.detail : "", ...end.diagnoses, `Record: ${end.record}`].filter(Boolean).join("\n");
  if (end.report && shownReport !== end.record) {
    shownReport = end.record;
    const address = `/api/report?${new URLSearchParams({ name: end.record })}`;
    byId("report").src = address;
    byId("report-link").href = address;
    byId("report-box").hidden = false;
  }
}

function addEvent([t, kind, text]) {
  const bad = ["fault", "stop"].includes(kind), warn = ["diagnosis", "operator", "interrupted"].includes(kind);
  const list = byId("events");
  list.append(el("li", { class: bad ? "bad" : warn ? "warn" : "" }, `${number(t, 2)} s  ${kind}${text ? `: ${text}` : ""}`));
  while (list.childElementCount > 300) list.firstChild.remove();
  list.scrollTop = list.scrollHeight;
}

function showRequirements() {
  const items = requirements.length ? requirements : planned.map((item) => ({ ...item, value: null, holds: null }));
  fill(byId("requirements"), ...items.map((item) => el("li", {},
    el("span", { class: `pill ${item.holds === null ? "" : item.holds ? "good" : "bad"}` }, item.holds === null ? "not yet" : item.holds ? "holds" : "fails"),
    ` ${item.text}`, item.value === null || item.value === undefined ? "" : ` (is ${Number(item.value).toPrecision(3)})`)));
}

function showFacts() {
  if (!now) return;
  fill(byId("facts"), ...FACTS.flatMap(([name, title, text]) => [el("div", {}, el("dt", {}, title), el("dd", {}, text(now[name])))]));
  const row = trail.at(-1);
  if (row) byId("pose").textContent = `x ${number(row[X], 3)} m, y ${number(row[Y], 3)} m, heading ${number((row[TH] * 180) / Math.PI, 1)}°` +
    (sigma ? `; σ ${number(1e3 * Math.sqrt(Math.max(sigma[0], 0)), 1)}, ${number(1e3 * Math.sqrt(Math.max(sigma[2], 0)), 1)} mm, ${number((180 / Math.PI) * Math.sqrt(Math.max(sigma[3], 0)), 2)}°` : "");
}

function draw() {
  if (drawn) return;
  drawn = true;
  setTimeout(() => requestAnimationFrame(paint), 60);
}

function paint() {
  drawn = false;
  const found = state.phase === "ready" && !trail.length && Number.isFinite(state.found?.pose?.[0]) ? state.found.pose : null;
  const seen = found && floor ? { ...floor, start: found } : floor;
  drawFloor(byId("floor"), seen, trail.map((r) => ({ x: r[X], y: r[Y], theta: r[TH], tx: r[TX] ?? NaN, ty: r[TY] ?? NaN, rx: r[RX], ry: r[RY] })), sigma);
  const newest = trail.at(-1)?.[T] || 0, all = floor ? Math.max(floor.duration_s, newest) : 1;
  // Of a long run the last half minute.
  const end = all > LONG_S ? Math.max(newest, WINDOW_S) : all, begin = all > LONG_S ? end - WINDOW_S : 0;
  tuning.paint();
  for (const [id, , unit, lines] of CHARTS) drawChart(byId(`chart-${id}`), lines.map(([ink, , of, dash]) => ({ ink, dash, values: trail.filter((r) => r[T] >= begin).map((r) => [r[T], of(r)]) })), end, unit, begin);
}
