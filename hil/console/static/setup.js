// The Set-up page: doctor, and a camera calibrated from given pictures: lens, floor, colours.
import { ask, byId, el, fill, send, tried, whileBusy } from "./core.js";
import * as bringup from "./bringup.js";
import * as camera from "./camera.js";

const clicks = { floor: [], colours: [] };

export function make(place) {
  fill(place,
    el("div", { class: "card" }, el("div", { class: "row" }, el("h2", {}, "Doctor"), el("button", { id: "s-doctor", type: "button", on: { click: tried(doctor) } }, "Look at this machine")), el("div", { id: "s-doctor-said" })),
    bringup.make(),
    camera.make(refresh),
    el("div", { class: "card" }, el("h2", {}, "Camera, step 1: lens"),
      el("p", { class: "help" }, "10 to 30 pictures of a board held in all parts of the image, near and far, tilted by 20 to 40 degrees both ways. `hil calibrate board --out board.pdf` prints one."),
      pictures("lens", true),
      el("label", { for: "s-board" }, "Board"), el("input", { id: "s-board", value: "charuco:8x6:30:22", spellcheck: false }),
      el("p", { class: "help" }, "charuco:COLUMNSxROWS:SQUARE_MM:MARKER_MM or chess:COLUMNSxROWS:SQUARE_MM, counted in squares"),
      el("button", { id: "s-lens", type: "button", class: "main", on: { click: tried(lens) } }, "Calibrate the lens"), el("div", { id: "s-lens-said" })),
    el("div", { class: "card" }, el("h2", {}, "Camera, step 2: floor"),
      el("p", { class: "help" }, "One picture from where the camera hangs. Click points whose place on the floor you know, and give X and Y in metres; 8 or more, well spread."),
      pictures("floor", false), clicked("floor", floorPoint), el("ul", { class: "plain", id: "s-floor-points" }),
      el("label", { class: "check" }, el("input", { type: "checkbox", id: "s-fit" }), "No lens calibrated: fit the lens along with the pose"),
      el("label", { for: "s-height" }, "Height of the camera over the floor, m (with a lens to fit)"), el("input", { id: "s-height", type: "number", min: 0.1, max: 50, step: "any" }),
      el("button", { id: "s-floor", type: "button", class: "main", on: { click: tried(floor) } }, "Calibrate the floor"), el("div", { id: "s-floor-said" })),
    el("div", { class: "card" }, el("h2", {}, "Camera, step 3: colours of the marks"),
      el("p", { class: "help" }, "One picture of the robot under the light it will run in. Click first into the front mark, then into the rear mark."),
      pictures("colours", false), clicked("colours", colourPoint), el("p", { id: "s-colours-points", role: "status" }),
      el("button", { id: "s-colours", type: "button", class: "main", on: { click: tried(colours) } }, "Learn the colours"), el("div", { id: "s-colours-said" })),
    el("div", { class: "card" }, el("h2", {}, "Camera file"), el("p", { class: "help", id: "s-file-said" }), el("pre", { id: "s-file", tabIndex: 0, hidden: true })));
  tried(bringup.refresh)();
  tried(camera.refresh)();
  for (const set of ["lens", "floor", "colours"]) tried(() => refresh(set))();
}

function pictures(set, multiple) {
  return el("div", {}, el("label", { for: `s-${set}-files` }, multiple ? "Pictures" : "Picture"),
    el("input", { id: `s-${set}-files`, type: "file", multiple, accept: "image/*", on: { change: tried((event) => give(set, event.target)) } }),
    el("div", { class: "row" }, el("span", { class: "quiet", id: `s-${set}-have`, role: "status" }), el("button", { type: "button", on: { click: tried(async () => { await send("/api/clear-pictures", { set }); byId(`s-${set}-files`).value = ""; await refresh(set); }) } }, "Clear")));
}

const named = (file) => file.name.replace(/[^A-Za-z0-9 _.()+-]/g, "_").replace(/^[^A-Za-z0-9_]+/, "p");

async function give(set, input) {
  if (!input.multiple) await send("/api/clear-pictures", { set });
  let done = 0;
  for (const file of input.files) {
    byId(`s-${set}-have`).textContent = `sending ${++done} of ${input.files.length}`;
    await send("/api/picture", file, { set, name: named(file) });
  }
  await refresh(set);
}

async function refresh(set) {
  const found = await ask("/api/pictures", { set });
  byId(`s-${set}-have`).textContent = found.pictures.length ? `${found.pictures.length} here: ${found.pictures.slice(0, 4).join(", ")}${found.pictures.length > 4 ? ", …" : ""}` : "none yet";
  showFile(found);
  if (set !== "lens") await showClicked(set, found.pictures[0]);
}

function showFile({ camera_file, text }) {
  byId("s-file-said").textContent = camera_file ? `${camera_file} in the records folder. In a run: change the value camera.file to ${camera_file}, or --set camera.file=… at a terminal.` : "none yet; step 1 makes it";
  byId("s-file").hidden = !text;
  byId("s-file").textContent = text;
}

function clicked(set, act) {
  return el("canvas", { id: `s-${set}-picture`, class: "clicked", hidden: true, role: "img", "aria-label": "Picture to click on", on: { click: (event) => {
    const canvas = event.target, box = canvas.getBoundingClientRect();
    act([((event.clientX - box.left) * canvas.width) / box.width, ((event.clientY - box.top) * canvas.height) / box.height]);
  } } });
}

const shownPictures = {};
async function showClicked(set, name) {
  const canvas = byId(`s-${set}-picture`);
  canvas.hidden = !name;
  if (shownPictures[set]?.name !== name) clicks[set] = [];
  if (!name) { shownPictures[set] = undefined; return; }
  const response = await fetch(`/api/set-up-file?${new URLSearchParams({ name: `pictures/${set}/${name}` })}`);
  shownPictures[set] = { name, bitmap: await createImageBitmap(await response.blob()) };
  paint(set);
}

function paint(set) {
  const canvas = byId(`s-${set}-picture`), { bitmap } = shownPictures[set];
  canvas.width = bitmap.width;
  canvas.height = bitmap.height;
  const pen = canvas.getContext("2d");
  pen.drawImage(bitmap, 0, 0);
  pen.font = `${Math.max(bitmap.width / 45, 12)}px system-ui`;
  clicks[set].forEach(({ at: [u, v] }, k) => {
    pen.lineWidth = 2;
    for (const [ink, radius] of [["#000", 9], ["#ffea00", 7]]) {
      pen.strokeStyle = ink;
      pen.beginPath();
      pen.arc(u, v, radius, 0, 2 * Math.PI);
      pen.stroke();
    }
    pen.fillStyle = "#ffea00";
    pen.fillText(String(k + 1), u + 10, v - 10);
  });
}

function floorPoint(at) {
  clicks.floor.push({ at, x: "", y: "" });
  paint("floor");
  listPoints();
  byId("s-floor-points").lastChild.querySelector("input").focus();
}

function listPoints() {
  fill(byId("s-floor-points"), ...clicks.floor.map((point, k) => el("li", { class: "row" }, `${k + 1}: pixel (${point.at[0].toFixed(1)}, ${point.at[1].toFixed(1)})`,
    ...["x", "y"].map((axis) => el("input", { type: "number", step: "any", value: point[axis], placeholder: `${axis.toUpperCase()} in m`, "aria-label": `Point ${k + 1}, ${axis.toUpperCase()} in m`, on: { input: (event) => { point[axis] = event.target.value; } } })),
    el("button", { type: "button", "aria-label": `Remove point ${k + 1}`, on: { click: () => { clicks.floor.splice(k, 1); paint("floor"); listPoints(); } } }, "Remove"))));
}

function colourPoint(at) {
  if (clicks.colours.length >= 2) clicks.colours = [];
  clicks.colours.push({ at });
  paint("colours");
  byId("s-colours-points").textContent = clicks.colours.map(({ at: [u, v] }, k) => `${["front", "rear"][k]} mark at pixel (${u.toFixed(1)}, ${v.toFixed(1)})`).join("; ");
}

async function doctor() {
  const { findings } = await whileBusy(byId("s-doctor"), () => ask("/api/doctor"));
  const kinds = { ok: "good", missing: "bad", note: "warn" };
  fill(byId("s-doctor-said"), el("div", { class: "scroll" }, el("table", {}, el("tbody", {}, ...findings.map((item) => el("tr", {},
    el("td", {}, item.group), el("td", {}, item.name), el("td", {}, el("span", { class: `pill ${kinds[item.state]}` }, item.state)), el("td", {}, item.detail, item.hint ? el("p", { class: "help" }, item.hint) : null)))))));
}

async function lens() {
  const made = await whileBusy(byId("s-lens"), () => send("/api/calibrate", { step: "lens", board: byId("s-board").value.trim() }));
  const f = made.found;
  fill(byId("s-lens-said"),
    el("p", { class: "banner good" }, `focal length ${f.lens.fx_px?.toFixed(1) ?? Object.values(f.lens)[0].toFixed(1)} px; residual ${f.error_px.toFixed(3)} px, on views held out ${f.held_out_px.toFixed(3)} px; image covered ${(100 * f.coverage_ratio).toFixed(0)} %`),
    el("ul", {}, ...f.advice.map((text) => el("li", {}, `To make it better: ${text}`)), f.not_seen.length ? el("li", {}, `Board not seen in ${f.not_seen.join(", ")}`) : null),
    drawing(made.picture, "Corners found and how they cover the image"),
    el("details", {}, el("summary", {}, `${f.views.length} views`), el("div", { class: "scroll" }, el("table", {}, el("tbody", {}, ...f.views.map((view) => el("tr", {}, el("td", {}, view.name), el("td", {}, `${view.corners} corners`), el("td", {}, `${view.error_px.toFixed(3)} px`), el("td", {}, `tilt ${view.tilt_deg.toFixed(0)}°`), el("td", {}, view.dropped ? "dropped" : ""))))))));
  showFile(made);
}

const drawing = (name, text) => el("img", { src: `/api/set-up-file?${new URLSearchParams({ name, at: Date.now() })}`, alt: text, width: 640 });

async function floor() {
  const points = clicks.floor.map(({ at, x, y }) => [parseFloat(x), parseFloat(y), ...at]);
  const bitmap = shownPictures.floor?.bitmap;
  const body = { step: "floor", points };
  if (byId("s-fit").checked && bitmap) Object.assign(body, { fit_lens: `${bitmap.width}x${bitmap.height}`, height_m: parseFloat(byId("s-height").value) || null });
  const made = await whileBusy(byId("s-floor"), () => send("/api/calibrate", body));
  fill(byId("s-floor-said"), el("p", { class: "banner good" }, `${made.found.points} points; ${made.found.rms_mm.toFixed(1)} mm RMS, each point left out in turn ${made.found.held_out_rms_mm.toFixed(1)} mm`),
    el("ul", {}, ...made.found.advice.map((text) => el("li", {}, text))), drawing(made.picture, "The floor as the camera is now believed to see it"));
  showFile(made);
}

async function colours() {
  const [front, rear] = clicks.colours.map(({ at }) => at);
  const made = await whileBusy(byId("s-colours"), () => send("/api/calibrate", { step: "colours", picture: shownPictures.colours?.name, front, rear }));
  fill(byId("s-colours-said"), el("p", { class: "banner good" }, `separation of the marks d' = ${made.found.separation.toFixed(1)} (6 or more is wanted)`));
  showFile(made);
}
