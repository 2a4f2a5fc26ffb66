// Bring-up, guided: what to do, a picture of it, what was measured; the wheels are off at every question.
import { ask, byId, command, el, fill, number, suggest, when, who } from "./core.js";

let state = { on: false };
const FREE = "ALL wheels are off the ground; they will turn, up to full speed";
const SEEN = [["left forward", "Left, forward"], ["left backward", "Left, backward"], ["right forward", "Right, forward"], ["right backward", "Right, backward"], ["none", "None turned"], ["?", "Nobody looked"]];

export function make() {
  return el("div", { class: "card", id: "bring-up" }, el("h2", {}, "Bring-up of a robot"),
    el("p", { class: "help" }, "Link, battery, each side's motor and encoder, dead zone, top speed, counts a turn. Put the robot on blocks so that all wheels turn freely, a chalk mark on one tyre of each side, a hand on the battery switch."),
    el("div", { class: "fields" },
      el("div", {}, el("label", { for: "b-target" }, "Port"), el("input", { id: "b-target", list: "targets", placeholder: "serial:/dev/ttyACM0", spellcheck: false })),
      el("div", {}, el("label", { for: "b-robot" }, "Robot as believed"), el("select", { id: "b-robot" })),
      el("div", {}, el("label", { for: "b-turns" }, "Turns to count"), el("input", { id: "b-turns", type: "number", min: 0, max: 100, value: 10 }))),
    el("label", { class: "check" }, el("input", { type: "checkbox", id: "b-floor", on: { change: ready } }), "It stands on its floor: measure whether it turns there, and nothing else"),
    el("label", { class: "check" }, el("input", { type: "checkbox", id: "b-ready", on: { change: told } }), el("span", { id: "b-ready-said" }, FREE)),
    el("button", { id: "b-begin", type: "button", class: "main", on: { click: begin } }, "Begin"),
    el("div", { id: "b-live", hidden: true },
      el("div", { class: "two" },
        el("div", {}, el("div", { id: "b-ask", role: "status" }), el("canvas", { id: "b-picture", class: "robot", role: "img", "aria-label": "Robot from above" })),
        el("div", {}, el("h3", {}, "Checks"), el("ul", { class: "plain", id: "b-checks" }), el("div", { id: "b-end", role: "status" })))));
}

export async function refresh() {
  const { robots, target } = await ask("/api/choices");
  fill(byId("b-robot"), ...robots.map((item) => el("option", { value: item.name }, item.name)));
  byId("b-robot").value = "thesis-4wd";
  const now = byId("target")?.value || target;
  suggest(byId("b-target"), now.startsWith("serial:") ? now : "");
  ready();
  told();
}

function ready() {
  byId("b-ready").checked = false;
  byId("b-ready-said").textContent = byId("b-floor").checked ? "Half a metre around the robot is free; it will turn on the spot, up to full duty" : FREE;
  told();
}

function begin() {
  command({ do: "bring-up", order: { target: byId("b-target").value.trim(), robot: byId("b-robot").value, turns: byId("b-turns").valueAsNumber || 0, floor: byId("b-floor").checked, ready: byId("b-ready").checked } });
}

const answer = (value) => command({ do: "answer", value });

when("bringup", (message) => { state = message; told(); });
when("who", told);

function told() {
  if (!byId("bring-up")) return;
  byId("b-begin").disabled = !who.operator || state.on || !byId("b-ready").checked;
  for (const id of ["b-target", "b-robot", "b-turns", "b-floor", "b-ready"]) byId(id).disabled = !who.operator || state.on;
  byId("b-live").hidden = !state.checks;
  if (!state.checks) return;
  const kinds = { ok: ["good", "pass"], fail: ["bad", "FAIL"], note: ["warn", "note"], skipped: ["", "skipped"] };
  fill(byId("b-checks"), ...state.checks.map((check) => el("li", {}, el("span", { class: `pill ${kinds[check.state][0]}` }, kinds[check.state][1]), ` ${check.name}: ${check.text}`, check.remedy ? el("p", { class: "help" }, `→ ${check.remedy}`) : null)));
  fill(byId("b-ask"), ...question());
  draw();
  const done = state.done;
  fill(byId("b-end"), state.refused ? el("p", { class: "banner bad" }, state.refused)
    : done ? el("p", { class: `banner ${done.passed ? "good" : "bad"}` }, done.passed ? "All checks passed." : `Failed: ${done.checks.filter((check) => check.fault).map((check) => `${check.name} (${check.fault})`).join(", ")}`) : null,
  ...(state.text ? [el("p", { class: "help" }, `written: ${state.file} in the records folder. In a run: change the value robot.file to ${state.file}.`), el("pre", { tabIndex: 0 }, state.text)] : []));
}

function button(text, value, main) {
  return el("button", { type: "button", class: main ? "main" : "", disabled: !who.operator, "data-answer": String(value), on: { click: () => answer(value) } }, text);
}

function question() {
  const q = state.ask;
  if (!q) return [el("p", {}, !state.on ? "" : state.driving ? `Driving: ${state.driving}` : "Checking …")];
  if (q.what === "look") return [el("p", {}, `Next, ${q.text}. Look at the wheels; STOP, or the space bar, stops them.`), button("I look: go", "go", true)];
  if (q.what === "seen") return [el("p", {}, `The ${q.side} side was driven, forward. Which wheels turned, and which way?`), el("div", { class: "row" }, ...SEEN.map(([value, text]) => button(text, value)))];
  const input = el("input", { id: "b-counted", type: "number", step: 0.05, min: 0.05, "aria-label": "Turns counted" });
  return [el("p", {}, `How many turns did the ${q.side} wheels make, to a twentieth? The counts say ${number(q.believed)}.`),
    el("div", { class: "row" }, input, el("button", { type: "button", id: "b-counted-said", class: "main", disabled: !who.operator, on: { click: () => { if (input.valueAsNumber > 0) answer(input.valueAsNumber); } } }, "Turns"), button("Nobody counted", "?"))];
}

// The robot from above, front up: which wheels are driven and which way, found good or bad.
function draw() {
  const canvas = byId("b-picture"), scale = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width) return;
  canvas.width = width * scale;
  canvas.height = height * scale;
  const pen = canvas.getContext("2d"), ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  const x = width / 2, y = height / 2, half = Math.min(width / 4, height / 3.4);
  pen.lineWidth = 2;
  pen.strokeStyle = ink("quiet");
  pen.strokeRect(x - half * 0.7, y - half, half * 1.4, half * 2);
  pen.fillStyle = ink("quiet");
  pen.font = "13px system-ui, sans-serif";
  pen.textAlign = "center";
  pen.fillText("front", x, y - half * 0.75);
  const about = `${state.driving || ""} ${state.ask?.text || ""} ${state.ask?.side || ""}`.toLowerCase();
  const both = /both|full speed|left and right|spot/.test(about);
  for (const [side, sign] of [["left", -1], ["right", 1]]) {
    const found = state.checks.filter((check) => check.name.startsWith(side));
    const driven = both || about.includes(side);
    const colour = driven ? "accent" : found.some((check) => check.state === "fail") ? "bad" : found.some((check) => check.state === "ok") ? "good" : "quiet";
    for (const along of [-0.6, 0.6]) {
      pen.fillStyle = ink(colour);
      pen.fillRect(x + sign * half * 0.95 - half * 0.16, y + along * half - half * 0.3, half * 0.32, half * 0.6);
    }
    pen.fillStyle = ink("ink");
    pen.fillText(side, x + sign * half * 1.5, y + half * 0.1);
    if (driven) {
      pen.strokeStyle = ink("accent");
      pen.lineWidth = 3;
      pen.beginPath();
      pen.moveTo(x + sign * half * 1.5, y - half * 0.1);
      pen.lineTo(x + sign * half * 1.5, y - half * 0.9);
      pen.lineTo(x + sign * half * 1.5 - 7, y - half * 0.9 + 10);
      pen.moveTo(x + sign * half * 1.5, y - half * 0.9);
      pen.lineTo(x + sign * half * 1.5 + 7, y - half * 0.9 + 10);
      pen.stroke();
    }
  }
}
