// The form of a run: what to run, where, and which values are changed, with their bounds, units and meaning.
import { ask, byId, el, fill, say, suggest, tried, who } from "./core.js";

let choices = null;
let described = null;
let overrides = new Map();
let changed = () => {};

const field = (id, label, input, help) => el("div", {}, el("label", { for: id }, label), Object.assign(input, { id }),
  help ? el("p", { class: "help", id: `${id}-help` }, help) : null);

export function make(place, whenChanged) {
  changed = whenChanged;
  const scenario = el("select", { on: { change: tried(load) } });
  const law = el("select");
  const target = el("input", { value: "twin", list: "targets", spellcheck: false, on: { input: () => { simulatedOnly(); dispatchEvent(new Event("target-changed")); } } });
  fill(place,
    field("scenario", "Scenario", scenario), el("p", { class: "help", id: "scenario-said" }),
    el("div", { class: "fields" },
      field("law", "Outer law", law),
      field("inner", "Wheel law", el("select")),
      field("target", "Target", target),
      field("camera", "Camera", el("input", { placeholder: "as the scenario says", list: "cameras", spellcheck: false })),
      field("seed", "Seed", el("input", { type: "number", min: 0, max: 2147483647, value: 1, required: true }))),
    el("datalist", { id: "targets" }), el("datalist", { id: "cameras" }),
    el("label", { class: "check" }, el("input", { type: "checkbox", id: "real-time", checked: true }), "Watch a simulated run at real speed"),
    el("label", { class: "check" }, el("input", { type: "checkbox", id: "dead-man" }), "Dead man: stop when this page is gone for 1 s"),
    el("details", { id: "changes" }, el("summary", { id: "changes-title" }, "Change values"),
      el("ul", { class: "plain", id: "overrides" }),
      field("setting", "Name of the value", el("input", { list: "settings", placeholder: "type a part of it, for example mass", spellcheck: false, on: { input: showSetting } })),
      el("datalist", { id: "settings" }),
      el("div", { id: "setting-said" })));
}

export async function refresh() {
  choices = await ask("/api/choices");
  options(byId("scenario"), choices.scenarios, "scenario-1");
  options(byId("law"), [{ name: "", summary: "as the scenario says" }, ...choices.laws]);
  options(byId("inner"), choices.inner.map((name) => ({ name, summary: "" })));
  fill(byId("targets"), ...choices.targets.map((item) => el("option", { value: item.name }, item.summary)));
  suggest(byId("target"), choices.target);
  if (byId("target").value === "twin") byId("target").value = choices.target;
  suggest(byId("camera"), choices.camera);
  const cameras = [["pose", "no pictures, drawn errors"], ["rendered", "pictures"], ["0", "first camera"], ...choices.served.map((item) => [item.camera, item.summary])];
  fill(byId("cameras"), ...cameras.map(([value, text]) => el("option", { value }, text)));
  simulatedOnly();
  dispatchEvent(new Event("target-changed"));
  await load();
  return choices;
}

function options(select, items, preferred) {
  const kept = select.value || preferred;
  fill(select, ...items.map((item) => el("option", { value: item.name, title: item.summary || "" },
    item.name ? (item.summary && item.name.length < 20 ? `${item.name} – ${item.summary}`.slice(0, 90) : item.name) : item.summary)));
  if (items.some((item) => item.name === kept)) select.value = kept;
}

async function load() {
  described = await ask("/api/scenario", { name: byId("scenario").value });
  byId("scenario-said").textContent = described.description;
  fill(byId("settings"), ...described.values.filter((item) => item.meaning).map((item) => el("option", { value: item.key }, item.meaning)));
  if (!byId("setting-said").childElementCount) showSetting(); // its name was typed while this was on its way
  changed(described);
}

function simulatedOnly() {
  const served = choices?.served.find((item) => item.name === byId("target").value);
  if (served) suggest(byId("camera"), served.camera);
  byId("real-time").disabled = !["twin", "pil"].includes(byId("target").value);
}

function showSetting() {
  const key = byId("setting").value.trim();
  const found = described?.values.find((item) => item.key === key);
  const place = byId("setting-said");
  if (!found) { fill(place); return; }
  const is = typeof found.value;
  const now = overrides.get(key) ?? (found.value === null ? "" : String(found.value));
  let input;
  if (found.choices?.length) {
    input = el("select", { id: "setting-value" }, ...found.choices.map((word) => el("option", { value: word, selected: word === now }, word)));
  } else if (is === "boolean") {
    input = el("select", { id: "setting-value" }, ...["true", "false"].map((word) => el("option", { value: word, selected: word === now }, word)));
  } else if (is === "number") {
    input = el("input", { id: "setting-value", type: "number", step: "any", value: now, required: true });
    if (found.low !== null && found.low !== undefined) input.min = found.low;
    if (found.high !== null && found.high !== undefined) input.max = found.high;
  } else {
    input = el("input", { id: "setting-value", value: now });
  }
  input.setAttribute("aria-describedby", "setting-help");
  const add = () => {
    if (!input.checkValidity()) {
      say(`${key} = ${input.value} ${found.unit}: allowed is ${found.bounds}`);
      return;
    }
    overrides.set(key, input.value);
    byId("setting").value = "";
    say("");
    list();
    fill(place);
  };
  input.addEventListener("keydown", (event) => { if (event.key === "Enter") { event.preventDefault(); add(); } });
  fill(place,
    el("p", { class: "help", id: "setting-help" }, [found.meaning, found.bounds && `allowed: ${found.bounds} ${found.unit}`, found.source && `source: ${found.source}`].filter(Boolean).join("; ")),
    el("div", { class: "row" }, el("label", { for: "setting-value" }, found.unit || "value"), input,
      el("button", { type: "button", id: "setting-add", on: { click: add } }, "Change")));
}

function list() {
  byId("changes-title").textContent = overrides.size ? `Change values (${overrides.size} changed)` : "Change values";
  fill(byId("overrides"), ...[...overrides].map(([key, value]) => el("li", { class: "override" },
    el("code", {}, `${key} = ${value}`),
    el("button", { type: "button", "aria-label": `Undo ${key}`, on: { click: () => { overrides.delete(key); list(); } } }, "Undo"))));
}

export function order() {
  const value = (id) => byId(id).value.trim();
  if (!byId("seed").checkValidity()) throw new Error("seed: a whole number from 0 to 2147483647");
  return {
    scenario: value("scenario"), law: value("law"), inner: value("inner"), target: value("target"), camera: value("camera"),
    seed: Number(value("seed")), overrides: [...overrides].map(([key, text]) => `${key}=${text}`),
    real_time: byId("real-time").checked, dead_man: byId("dead-man").checked,
  };
}

export function lock(on) {
  for (const input of document.querySelectorAll("#run-form input, #run-form select, #run-form button")) input.disabled = on || !who.operator;
  if (!on && who.operator) simulatedOnly();
}
