// The Records page: the list with verdicts, filters, report, compare, replay, export, and the bin.
import { ask, byId, el, fill, say, send, tried, whileBusy } from "./core.js";

const PAGE = 100;
let offset = 0, chosen = new Set(), typing = 0;
const VERDICTS = { held: ["good", "held"], failed: ["bad", "failed"], fault: ["bad", "fault"], interrupted: ["warn", "stopped"], running: ["warn", "under way or cut off"], damaged: ["bad", "damaged"] };

export function make(place) {
  const filter = (id, label, input) => el("div", {}, el("label", { for: id }, label), Object.assign(input, { id }));
  const again = () => { offset = 0; tried(load)(); };
  const later = () => { clearTimeout(typing); typing = setTimeout(again, 200); };
  fill(place,
    el("div", { class: "card" }, el("div", { class: "two" },
      filter("f-text", "Words", el("input", { type: "search", on: { input: later } })),
      filter("f-scenario", "Scenario", el("select", { on: { change: again } })),
      filter("f-law", "Law", el("select", { on: { change: again } })),
      filter("f-verdict", "Outcome", el("select", { on: { change: again } }, el("option", { value: "" }, "any"), ...Object.entries(VERDICTS).map(([value, [, text]]) => el("option", { value }, text)))),
      filter("f-since", "From", el("input", { type: "date", on: { change: again } })),
      filter("f-until", "To", el("input", { type: "date", on: { change: again } })))),
    el("div", { class: "card" },
      el("div", { class: "row" },
        el("button", { id: "r-report", type: "button", class: "main", on: { click: report } }, "Report"),
        el("button", { id: "r-compare", type: "button", on: { click: report } }, "Compare"),
        el("button", { id: "r-replay", type: "button", on: { click: tried(replay) } }, "Replay"),
        ...["csv", "mcap", "ulog"].map((form) => el("button", { class: "r-export", type: "button", on: { click: tried((event) => exported(event.target, form)) } }, `Export ${form}`)),
        el("button", { id: "r-delete", type: "button", on: { click: tried(remove) } }, "Delete"),
        el("span", { id: "r-count", class: "quiet", role: "status" })),
      el("div", { id: "r-undo" }),
      el("div", { class: "scroll" }, el("table", { class: "cards" },
        el("thead", {}, el("tr", {}, ...["", "Record", "Outcome", "Scenario", "Law", "On", "Seed", "Begun (UTC)"].map((text) => el("th", { scope: "col" }, text)))),
        el("tbody", { id: "r-rows" }))),
      el("div", { class: "row" }, el("button", { id: "r-back", type: "button", on: { click: () => { offset = Math.max(offset - PAGE, 0); tried(load)(); } } }, "Newer"),
        el("button", { id: "r-on", type: "button", on: { click: () => { offset += PAGE; tried(load)(); } } }, "Older"))),
    el("pre", { id: "r-said", hidden: true, tabIndex: 0 }),
    el("div", { class: "card", id: "r-report-box", hidden: true }, el("div", { class: "row" }, el("h2", { id: "r-report-title" }), el("a", { id: "r-report-link", target: "_blank", rel: "noopener" }, "in a page of its own")), el("iframe", { id: "r-frame", title: "Report" })),
    el("details", { class: "card" }, el("summary", {}, "Bin"), el("ul", { class: "plain", id: "r-bin" })));
  buttons();
}

export function shown() { tried(load)(); }

async function load() {
  const value = (id) => byId(`f-${id}`).value;
  const found = await ask("/api/records", { text: value("text"), scenario: value("scenario"), law: value("law"), verdict: value("verdict"), since: value("since"), until: value("until"), offset, limit: PAGE });
  options("f-scenario", found.scenarios);
  options("f-law", found.laws);
  const last = Math.min(offset + PAGE, found.found);
  byId("r-count").textContent = found.found ? `${offset + 1} to ${last} of ${found.found}${found.found < found.total ? ` (of ${found.total} in all)` : ""}` : found.total ? "none like this" : "no records yet: make one on the Run page";
  fill(byId("r-rows"), ...found.items.map(row));
  byId("r-back").disabled = offset === 0;
  byId("r-on").disabled = last >= found.found;
  fill(byId("r-bin"), ...(found.bin.length ? found.bin.map((name) => el("li", { class: "override" }, el("code", {}, name),
    el("button", { type: "button", on: { click: tried(async () => { await send("/api/restore", { names: [name] }); await load(); }) } }, "Put back"))) : [el("li", { class: "quiet" }, "empty")]));
  buttons();
}

function options(id, names) {
  const select = byId(id), kept = select.value;
  fill(select, el("option", { value: "" }, "any"), ...names.map((value) => el("option", { value }, value || "(none)")));
  select.value = names.includes(kept) ? kept : "";
}

function row(item) {
  const [kind, text] = VERDICTS[item.verdict] || ["", item.verdict];
  const box = el("input", { type: "checkbox", checked: chosen.has(item.name), "aria-label": `Choose ${item.name}`, on: { change: () => { if (box.checked) chosen.add(item.name); else chosen.delete(item.name); buttons(); } } });
  const open = el("a", { href: `#records`, on: { click: (event) => { event.preventDefault(); show([item.name]); } } }, item.name);
  const why = item.verdict === "failed" ? item.failed.join(", ") : item.verdict === "held" ? "" : item.detail;
  return el("tr", {}, el("td", {}, box), el("td", {}, open), el("td", {}, el("span", { class: `pill ${kind}` }, text), why ? el("span", { class: "help" }, ` ${why}`) : null),
    el("td", {}, item.scenario), el("td", {}, item.law), el("td", {}, item.target), el("td", {}, String(item.seed)), el("td", {}, item.start.slice(0, 19).replace("T", " ")));
}

function buttons() {
  byId("r-report").disabled = byId("r-replay").disabled = chosen.size !== 1;
  for (const button of document.querySelectorAll(".r-export")) button.disabled = chosen.size !== 1;
  byId("r-compare").disabled = chosen.size < 2;
  byId("r-delete").disabled = chosen.size < 1;
}

function report() { show([...chosen]); }

function show(names) {
  const address = `/api/report?${new URLSearchParams(names.map((name) => ["name", name]))}`;
  byId("r-report-title").textContent = names.length === 1 ? names[0] : `${names.length} runs side by side`;
  byId("r-report-link").href = byId("r-frame").src = address;
  byId("r-report-box").hidden = false;
  byId("r-report-box").scrollIntoView({ block: "start" });
}

async function replay() {
  const said = await whileBusy(byId("r-replay"), () => send("/api/replay", { name: [...chosen][0] }));
  byId("r-said").hidden = false;
  byId("r-said").textContent = said.text;
}

async function exported(button, form) {
  const name = [...chosen][0];
  await whileBusy(button, async () => {
    const response = await fetch(`/api/export?${new URLSearchParams({ name, to: form })}`);
    if (!response.ok) throw new Error((await response.json()).error);
    const file = /filename="?([^";]+)/.exec(response.headers.get("content-disposition") || "")?.[1] || `record.${form}`;
    const link = el("a", { href: URL.createObjectURL(await response.blob()), download: file });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  });
}

async function remove() {
  const { binned } = await send("/api/delete", { names: [...chosen] });
  chosen = new Set();
  const undo = el("button", { type: "button", on: { click: tried(async () => { await send("/api/restore", { names: binned }); fill(byId("r-undo")); await load(); }) } }, "Undo");
  fill(byId("r-undo"), el("p", { class: "row" }, `${binned.length} moved to the bin. `, undo));
  say("");
  await load();
}
