// Tuning in the run that is on: values of board and law, steps of the goal and the response to them, undo, the robot's file.
import { byId, command, el, fill, number, send, tried, when, whileBusy, who } from "./core.js";
import { drawChart } from "./draw.js";

// A step of the goal is a jump of this much between two ticks; what is shown of the response.
const STEP_M = 0.01, SHOWN_S = 6, KEPT = 3;
let tunables = [], values = {}, changes = [], phase = "idle", run = -1, wheelLaw = "";
let responses = [], last = null;

export function make() {
  return el("details", { id: "tune", on: { toggle: () => paint() } }, el("summary", {}, "Tune this run"),
    el("p", { class: "help", id: "tune-said" }),
    el("div", { class: "two" },
      el("div", {},
        el("label", { for: "tune-filter" }, "Values, by a part of their name or meaning"), el("input", { id: "tune-filter", spellcheck: false, on: { input: list } }),
        el("div", { class: "tunables", id: "tunables", tabIndex: 0, role: "group", "aria-label": "Values that may be changed" })),
      el("div", {},
        el("h3", {}, "Response to a step of the goal"),
        el("canvas", { class: "chart", id: "chart-step", role: "img", "aria-label": "Share of the step that is made, over time" }),
        el("ul", { class: "plain", id: "step-figures" }),
        el("div", { class: "row" }, el("label", { for: "step-x" }, "X, m"), el("input", { id: "step-x", type: "number", step: "any", value: 0.1, min: -1, max: 1 }),
          el("label", { for: "step-y" }, "Y, m"), el("input", { id: "step-y", type: "number", step: "any", value: 0, min: -1, max: 1 }),
          el("button", { id: "step", type: "button", on: { click: tried(step) } }, "Step")),
        el("h3", {}, "Changes"), el("ul", { class: "plain log", id: "tune-changes", tabIndex: 0, "aria-label": "Changes" }),
        el("div", { class: "row" },
          el("button", { id: "tune-undo", type: "button", on: { click: () => command({ do: "undo" }) } }, "Undo the last"),
          el("button", { id: "tune-start", type: "button", on: { click: atStart } }, "All as at the start"),
          el("button", { id: "tune-write", type: "button", class: "main", on: { click: tried(write) } }, "Write to the robot's file")),
        el("div", { id: "tune-written", role: "status" }))));
}

function step() {
  command({ do: "step", x_m: byId("step-x").valueAsNumber, y_m: byId("step-y").valueAsNumber });
  byId("step-x").value = -byId("step-x").value; // and back the next time
  byId("step-y").value = -byId("step-y").value;
}

function atStart() {
  for (const item of tunables) if ((values[item.key] ?? item.value) !== item.value) command({ do: "tune", key: item.key, value: item.value });
}

async function write() {
  const made = await whileBusy(byId("tune-write"), () => send("/api/write-tuned", {}));
  fill(byId("tune-written"), el("p", { class: "help" }, `${made.file} in the records folder. In a run: change the value robot.file to ${made.file}, or name it in a scenario's [robot] table.`), el("pre", { tabIndex: 0 }, made.text));
}

when("state", (state) => {
  phase = state.phase;
  if (state.run !== run) { run = state.run; responses = []; last = null; fill(byId("tune-written")); }
  const begun = state.begin?.tunables || [];
  wheelLaw = state.begin?.scenario ? (state.command.match(/--inner (\S+)/)?.[1] || "asg-ism") : "";
  ({ values, changes } = state.tuned || { values: {}, changes: [] });
  if (begun.length !== tunables.length || begun.some((item, k) => item.key !== tunables[k].key || item.value !== tunables[k].value)) { tunables = begun; list(); }
  told();
});
when("tuned", (message) => { ({ values, changes } = message); told(); });
when("who", told);

const may = () => who.operator && phase === "running";
// Without a filter: the law, and the board's parameters of the wheel law that runs.
function shown(item, word) {
  if (word) return `${item.key} ${item.meaning}`.toLowerCase().includes(word);
  return item.key.startsWith("law.") || item.key.startsWith(wheelLaw === "pid" ? "board.PID_" : "board.ISM_") || item.key.startsWith("board.FF_");
}

function list() {
  const word = byId("tune-filter").value.trim().toLowerCase();
  fill(byId("tunables"), ...tunables.filter((item) => shown(item, word)).map((item) => {
    const input = el("input", { type: "number", step: "any", "data-key": item.key, value: values[item.key] ?? item.value, "aria-label": `${item.key}, ${item.unit}`,
      title: `${item.meaning}; ${item.bounds} ${item.unit}`, on: { change: (event) => change(item, event.target) } });
    if (item.low !== null) input.min = item.low;
    if (item.high !== null) input.max = item.high;
    const turn = (sign, text) => el("button", { type: "button", "aria-label": `${item.key} ${text}`, on: { click: () => { input.value = Number(((input.valueAsNumber || 0) * (1 + 0.1 * sign)).toPrecision(4)); change(item, input); } } }, sign > 0 ? "+" : "−");
    return el("div", { class: "tunable" }, el("span", {}, el("code", {}, item.key), ` ${item.unit}`), turn(-1, "10 % less"), input, turn(1, "10 % more"), el("p", { class: "help" }, `${item.meaning}; ${item.bounds}`));
  }));
  told();
}

function change(item, input) {
  if (!input.checkValidity() || !Number.isFinite(input.valueAsNumber)) { byId("tune-said").textContent = `${item.key} = ${input.value} ${item.unit}: allowed is ${item.bounds}`; return; }
  command({ do: "tune", key: item.key, value: input.valueAsNumber });
}

function told() {
  if (!byId("tune")) return;
  byId("tune-said").textContent = !tunables.length ? "Start a run; its values are here then. For a long one change duration_s, up to 3600 s."
    : may() ? "A value counts at once, within its bounds; each change is in the record, and a replay makes it again. What is fixed while the robot is armed is not here."
      : "Values are changed by the operator while a run is on.";
  for (const input of document.querySelectorAll("#tunables input")) {
    const item = tunables.find((one) => one.key === input.dataset.key);
    const now = values[item.key] ?? item.value;
    if (document.activeElement !== input) input.value = now;
    input.classList.toggle("changed", now !== item.value);
  }
  for (const part of document.querySelectorAll("#tunables button, #tunables input, #step, #tune-start")) part.disabled = !may();
  byId("tune-undo").disabled = !may() || !changes.length;
  byId("tune-write").disabled = !who.operator || !Object.keys(values).length;
  fill(byId("tune-changes"), ...changes.map(([key, before, after]) => el("li", {}, `${key}: ${Number(before.toPrecision(5))} → ${Number(after.toPrecision(5))}`)));
  byId("tune-changes").scrollTop = 1e6;
}

// row: {t, ex, ey: error, rx, ry: goal}; called for each new tick
export function took(row) {
  if (last && Math.hypot(row.rx - last.rx, row.ry - last.ry) > STEP_M && row.t - last.t < 0.3) {
    const since = responses.length ? responses.at(-1).changes : 0;
    responses.push({ t: row.t, dx: row.rx - last.rx, dy: row.ry - last.ry, points: [], changes: changes.length, after: changes.length - since });
    responses = responses.slice(-KEPT);
  }
  last = row;
  const now = responses.at(-1);
  if (now && row.t - now.t <= SHOWN_S) now.points.push([row.t - now.t, 1 + (row.ex * now.dx + row.ey * now.dy) / (now.dx ** 2 + now.dy ** 2)]);
}

export function paint() {
  if (!byId("tune")?.open) return;
  const inks = ["quiet", "right", "est"].slice(-responses.length);
  drawChart(byId("chart-step"), [{ ink: "ref", dash: [4, 4], values: [[0, 1], [SHOWN_S, 1]] }, ...responses.map((one, k) => ({ ink: inks[k], values: one.points }))], SHOWN_S, "of the step");
  fill(byId("step-figures"), ...responses.map((one, k) => {
    const made = one.points.find(([, v]) => v >= 0.9)?.[0], most = Math.max(0, ...one.points.map(([, v]) => v));
    const out = one.points.findLastIndex(([, v]) => Math.abs(v - 1) > 0.05);
    const settled = out >= 0 && out < one.points.length - 1 ? one.points[out + 1][0] : null;
    const mark = el("span", { class: "key" });
    mark.style.background = `var(--${inks[k]})`;
    return el("li", {}, mark, `at ${number(one.t, 1)} s, after ${one.changes} change${one.changes === 1 ? "" : "s"}: 90 % in ${made === undefined ? "–" : number(made, 2)} s, overshoot ${number(100 * Math.max(most - 1, 0), 0)} %, within 5 % from ${settled === null ? "–" : number(settled, 2)} s`);
  }));
}
