// The frame of the page: which part is shown, STOP, the operator, dark and light.
import { byId, command, connect, when, who } from "./core.js";
import * as run from "./run.js";
import * as records from "./records.js";
import * as setup from "./setup.js";
import * as campaigns from "./campaigns.js";

const parts = { run, records, setup, campaigns };
const made = new Set();
let phase = "idle", bringUp = false;

function show() {
  const [name] = (location.hash.slice(1) || "run").split("?");
  const chosen = parts[name] ? name : "run";
  for (const part of Object.keys(parts)) {
    byId(`part-${part}`).hidden = part !== chosen;
    const link = document.querySelector(`nav a[href="#${part}"]`);
    if (part === chosen) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  if (!made.has(chosen)) {
    made.add(chosen);
    parts[chosen].make(byId(`part-${chosen}`));
  }
  parts[chosen].shown?.();
  document.title = `${document.querySelector(`nav a[href="#${chosen}"]`).textContent} · hil console`;
}

const isOn = () => bringUp || ["starting", "ready", "running", "stopping"].includes(phase);
function stop() {
  command({ do: "stop" });
}
// At once, not when the button is let go.
byId("stop").addEventListener("pointerdown", stop);
byId("stop").addEventListener("click", stop);
document.addEventListener("keydown", (event) => {
  if (event.code !== "Space" || !isOn()) return; // a space is a space while nothing moves
  event.preventDefault();
  event.stopPropagation();
  stop();
}, true);

when("state", (state) => {
  phase = state.phase;
  byId("stop").classList.toggle("live", isOn());
});
when("bringup", (state) => {
  bringUp = state.on;
  byId("stop").classList.toggle("live", isOn());
});
when("who", () => {
  const others = who.pages > 1 ? `, ${who.pages} pages open` : "";
  byId("who").textContent = (who.operator ? "You operate" : who.taken ? "You watch: another page operates" : "Nobody operates") + others;
  byId("take").hidden = who.operator || who.taken;
  byId("release").hidden = !who.operator || who.pages < 2;
  document.body.classList.toggle("viewer", !who.operator);
});
byId("take").addEventListener("click", () => command({ do: "take" }));
byId("release").addEventListener("click", () => command({ do: "release" }));
setInterval(() => { if (who.operator && isOn()) command({ do: "beat" }); }, 250);

const root = document.documentElement;
const dark = matchMedia("(prefers-color-scheme: dark)");
function theme() {
  root.dataset.theme = localStorage.getItem("theme") || (dark.matches ? "dark" : "light");
  dispatchEvent(new Event("themed"));
}
dark.addEventListener("change", theme);
byId("theme").addEventListener("click", () => {
  localStorage.setItem("theme", root.dataset.theme === "dark" ? "light" : "dark");
  theme();
});

theme();
addEventListener("hashchange", show);
run.make(byId("part-run"));
made.add("run");
show();
connect();
