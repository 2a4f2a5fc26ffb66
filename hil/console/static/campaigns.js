// The Campaigns page: start, watch rows and maps fill, stop, go on.
import { ask, byId, el, fill, send, tried, when, whileBusy } from "./core.js";

let items = [], chosen = "", mapped = 0;

export function make(place) {
  fill(place,
    el("div", { class: "card" }, el("h2", {}, "Start a campaign"),
      el("div", { class: "row" }, el("label", { for: "c-file" }, "Campaign"), el("select", { id: "c-file" }), el("button", { id: "c-start", type: "button", class: "main", on: { click: tried(start) } }, "Start")),
      el("p", { class: "help" }, "Every combination of values in a campaign's file, on the twin, on all cores of this machine. It can be stopped and gone on with at any time.")),
    el("div", { class: "card" }, el("h2", {}, "Campaigns here"), el("ul", { class: "plain", id: "c-list" })),
    el("div", { class: "card", id: "c-map-box", hidden: true }, el("h2", { id: "c-map-title" }), el("p", { class: "help", id: "c-map-said" }), el("div", { id: "c-maps", class: "two" }),
      el("iframe", { id: "c-frame", title: "Report of the campaign", hidden: true })));
}

export function shown() {
  tried(async () => {
    const found = await ask("/api/choices");
    const kept = byId("c-file").value;
    fill(byId("c-file"), ...found.campaigns.map((item) => el("option", { value: item.name }, `${item.name} – ${item.summary}`.slice(0, 100))));
    if (kept) byId("c-file").value = kept;
    items = (await ask("/api/campaigns")).items;
    list();
  })();
}

when("campaigns", (message) => {
  items = message.items;
  if (!byId("c-list")) return;
  list();
  const item = items.find((one) => one.name === chosen);
  if (item && (item.done !== mapped || !item.on)) tried(map)();
});

async function start() {
  const { name } = await whileBusy(byId("c-start"), () => send("/api/campaign-start", { campaign: byId("c-file").value }));
  chosen = name;
}

const time = (s) => (s === null || s === undefined ? "?" : s > 90 ? `${Math.round(s / 60)} min` : `${Math.round(s)} s`);

function list() {
  fill(byId("c-list"), ...(items.length ? items.map((item) => el("li", { class: "card" },
    el("div", { class: "row" }, el("strong", {}, item.name), el("span", { class: `pill ${item.on ? "good" : item.finished ? "" : "warn"}` }, item.on ? "on" : item.finished ? "done" : "stopped"),
      el("button", { type: "button", on: { click: tried(() => { chosen = item.name; return map(); }) } }, "Show"),
      item.on ? el("button", { type: "button", on: { click: tried(() => send("/api/campaign-stop", { name: item.name })) } }, "Stop the campaign") : null,
      !item.on && !item.finished && item.here ? el("button", { type: "button", on: { click: tried(() => send("/api/campaign-go-on", { name: item.name })) } }, "Go on") : null),
    el("progress", { max: Math.max(item.total, 1), value: item.done, "aria-label": `Rows done of ${item.name}` }),
    el("p", { class: "help" }, `${item.done} of ${item.total || "?"} rows on disk${item.on ? `, ${item.rate_hz.toFixed(1)} a second, ${time(item.left_s)} left` : ""}`),
    item.said ? el("p", { class: "banner bad" }, item.said) : null)) : [el("li", { class: "quiet" }, "none yet")]));
}

// One map for each law: share of runs that met every requirement, at each pair of values.
async function map() {
  const item = items.find((one) => one.name === chosen);
  if (!item) return;
  mapped = item.done;
  const found = await ask("/api/campaign-map", { name: chosen });
  byId("c-map-box").hidden = false;
  byId("c-map-title").textContent = chosen;
  byId("c-map-said").textContent = `Share of runs that met every requirement over ${found.axes.join(" (across) and ") || "nothing varied"} (up)`;
  const laws = [...new Set(found.rows.map((row) => row.at(-2)))];
  fill(byId("c-maps"), ...laws.map((law) => {
    const rows = found.rows.filter((row) => row.at(-2) === law);
    const held = rows.filter((row) => row.at(-1)).length;
    const canvas = el("canvas", { class: "chart", role: "img", "aria-label": `${law}: ${held} of ${rows.length} held` });
    requestAnimationFrame(() => paint(canvas, rows, found.axes.length));
    return el("div", {}, el("h3", {}, `${law}: ${held} of ${rows.length} held`), canvas);
  }));
  byId("c-frame").hidden = !item.finished;
  if (item.finished) byId("c-frame").src = `/api/campaign-report?${new URLSearchParams({ name: chosen })}`;
}

function paint(canvas, rows, axes) {
  canvas.width = canvas.clientWidth || 300;
  canvas.height = canvas.clientHeight || 136;
  const pen = canvas.getContext("2d");
  const places = [0, 1].map((k) => (axes > k ? [...new Set(rows.map((row) => row[k]))].sort((a, b) => (a > b ? 1 : -1)) : [0]));
  const cells = new Map();
  for (const row of rows) {
    const key = [0, 1].map((k) => (axes > k ? places[k].indexOf(row[k]) : 0)).join();
    const cell = cells.get(key) || [0, 0];
    cells.set(key, [cell[0] + (row.at(-1) ? 1 : 0), cell[1] + 1]);
  }
  const width = canvas.width / Math.max(places[0].length, 1), height = canvas.height / Math.max(places[1].length, 1);
  for (const [key, [held, all]] of cells) {
    const [i, j] = key.split(",").map(Number);
    const share = held / all;
    pen.fillStyle = `hsl(${210 - 190 * (1 - share)} 70% ${35 + 25 * share}%)`;
    pen.fillRect(i * width, canvas.height - (j + 1) * height, Math.max(width - 1, 1), Math.max(height - 1, 1));
  }
}
