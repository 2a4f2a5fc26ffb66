// The floor and the charts, drawn on canvas. World frame: X right, Y up, metres; theta counter-clockwise.

// A name of the style sheet's palette.
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

function ready(canvas) {
  const scale = devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return null;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "12px system-ui, sans-serif";
  return { pen, width, height };
}

function line(pen, points, ink, width = 2, dash = []) {
  pen.beginPath();
  pen.strokeStyle = ink;
  pen.lineWidth = width;
  pen.setLineDash(dash);
  let down = false;
  for (const [x, y] of points) {
    if (!Number.isFinite(x) || !Number.isFinite(y)) { down = false; continue; }
    if (down) pen.lineTo(x, y);
    else pen.moveTo(x, y);
    down = true;
  }
  pen.stroke();
  pen.setLineDash([]);
}

// floor: {fence: [x0, x1, y0, y1], start, reference, robot: [track_m, wheel_radius_m]}
// trail: rows of {x, y, theta, tx, ty, rx, ry}; sigma: [xx, xy, yy, tt] in m², rad²
export function drawFloor(canvas, floor, trail, sigma) {
  const place = ready(canvas);
  if (!place || !floor) return;
  const { pen, width, height } = place;
  const [x0, x1, y0, y1] = floor.fence;
  const margin = 38;
  const scale = Math.min((width - 2 * margin) / (x1 - x0), (height - 2 * margin) / (y1 - y0));
  const left = (width - scale * (x1 - x0)) / 2, low = (height + scale * (y1 - y0)) / 2;
  const at = (x, y) => [left + (x - x0) * scale, low - (y - y0) * scale];
  const [fx, fy] = at(x0, y1);
  pen.strokeStyle = colour("line");
  pen.lineWidth = 1;
  const step = [0.1, 0.25, 0.5, 1, 2, 5, 10].find((s) => (x1 - x0) / s <= 10) || 20;
  pen.fillStyle = colour("quiet");
  pen.textAlign = "center";
  for (let x = Math.ceil(x0 / step) * step; x <= x1 + 1e-9; x += step) {
    line(pen, [at(x, y0), at(x, y1)], colour("line"), 0.5);
    pen.fillText(`${+x.toFixed(2)}`, at(x, y0)[0], at(x, y0)[1] + 15);
  }
  pen.textAlign = "right";
  for (let y = Math.ceil(y0 / step) * step; y <= y1 + 1e-9; y += step) {
    line(pen, [at(x0, y), at(x1, y)], colour("line"), 0.5);
    pen.fillText(`${+y.toFixed(2)}`, at(x0, y)[0] - 4, at(x0, y)[1] + 4);
  }
  pen.strokeStyle = colour("fence");
  pen.lineWidth = 2;
  pen.strokeRect(fx, fy, scale * (x1 - x0), scale * (y1 - y0));
  line(pen, floor.reference.map(([x, y]) => at(x, y)), colour("ref"), 2, [6, 4]);
  line(pen, trail.map((row) => at(row.tx, row.ty)), colour("true"), 3);
  line(pen, trail.map((row) => at(row.x, row.y)), colour("est"), 1.6);
  const last = trail.at(-1);
  const goal = last && Number.isFinite(last.rx) ? [last.rx, last.ry] : floor.reference[0];
  const [gx, gy] = at(...goal);
  line(pen, [[gx - 7, gy], [gx + 7, gy]], colour("ref"), 2);
  line(pen, [[gx, gy - 7], [gx, gy + 7]], colour("ref"), 2);
  const [px, py, theta] = last ? [last.x, last.y, last.theta] : floor.start;
  robot(pen, at(px, py), theta, floor.robot[0] * scale, last ? colour("est") : colour("quiet"));
  if (sigma && last) ellipse(pen, at(px, py), sigma, scale);
}

function robot(pen, [x, y], theta, track, ink) {
  const size = Math.max(track, 14);
  pen.save();
  pen.translate(x, y);
  pen.rotate(-theta);
  pen.strokeStyle = ink;
  pen.fillStyle = `${ink}33`;
  pen.lineWidth = 2;
  pen.beginPath();
  pen.rect(-size * 0.55, -size * 0.42, size * 1.1, size * 0.84);
  pen.fill();
  pen.stroke();
  pen.beginPath();
  pen.moveTo(size * 0.55, 0);
  pen.lineTo(size * 0.15, -size * 0.25);
  pen.lineTo(size * 0.15, size * 0.25);
  pen.closePath();
  pen.fillStyle = ink;
  pen.fill();
  pen.restore();
}

// Ten standard deviations: one is a millimetre or two.
function ellipse(pen, [x, y], [xx, xy, yy], scale) {
  const mean = (xx + yy) / 2, half = Math.hypot((xx - yy) / 2, xy);
  const major = 10 * Math.sqrt(Math.max(mean + half, 0)) * scale, minor = 10 * Math.sqrt(Math.max(mean - half, 0)) * scale;
  pen.strokeStyle = colour("right");
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.ellipse(x, y, Math.max(major, 2), Math.max(minor, 2), -0.5 * Math.atan2(2 * xy, xx - yy), 0, 2 * Math.PI);
  pen.stroke();
}

// lines: [{values: [[t, value], ...], ink, dash?}], from `begin` to `end` s; the range grows with what is seen and holds zero.
export function drawChart(canvas, lines, end, unit, begin = 0) {
  const place = ready(canvas);
  if (!place) return;
  const { pen, width, height } = place;
  let low = 0, high = 0;
  for (const { values } of lines) for (const [, v] of values) if (Number.isFinite(v)) { low = Math.min(low, v); high = Math.max(high, v); }
  if (high === low) high = 1;
  const left = 46, bottom = height - 18, top = 8, right = width - 8;
  const px = (t) => left + (right - left) * ((t - begin) / Math.max(end - begin, 1e-9));
  const py = (v) => bottom - (bottom - top) * ((v - low) / (high - low));
  pen.fillStyle = colour("quiet");
  pen.textAlign = "right";
  for (const v of [low, (low + high) / 2, high]) {
    line(pen, [[left, py(v)], [right, py(v)]], colour("line"), 0.5);
    pen.fillText(short(v), left - 4, py(v) + 4);
  }
  pen.fillText(`${short(end)} s`, right, height - 4);
  pen.textAlign = "left";
  pen.fillText(unit, left, height - 4);
  for (const { values, ink, dash } of lines) line(pen, values.map(([t, v]) => [px(t), py(v)]), colour(ink), 1.5, dash || []);
}

function short(value) {
  const size = Math.abs(value);
  return size === 0 ? "0" : size >= 100 ? value.toFixed(0) : size >= 1 ? value.toFixed(1) : value.toPrecision(2);
}

// The camera's picture with what was found in it.
export function drawPicture(canvas, bitmap, seen, size) {
  canvas.width = bitmap.width;
  canvas.height = bitmap.height;
  const pen = canvas.getContext("2d");
  pen.drawImage(bitmap, 0, 0);
  const scale = bitmap.width / size[0];
  pen.lineWidth = 2;
  for (const [mark, ink] of [["front", "#00e5ff"], ["rear", "#ffea00"]]) {
    const u = seen[`${mark}_u_px`], v = seen[`${mark}_v_px`];
    if (u === null || v === null) continue;
    pen.strokeStyle = ink;
    pen.beginPath();
    pen.arc(u * scale, v * scale, 9, 0, 2 * Math.PI);
    pen.stroke();
  }
}
