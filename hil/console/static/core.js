// What every page uses: elements, requests, the socket, and who the operator is.
// Texts of others (names, records, errors) go in as text only, never as markup.

export function el(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === "on") for (const [event, act] of Object.entries(value)) made.addEventListener(event, act);
    else if (name === "class") made.className = value;
    else if (name.includes("-") || name === "for" || name === "list" || name === "colspan") made.setAttribute(name, value);
    else made[name] = value;
  }
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

export function fill(parent, ...children) {
  parent.replaceChildren(...children.filter((child) => child !== null && child !== undefined));
}

export const byId = (id) => document.getElementById(id);
// A first value for a field that is empty, and never under the hands of the one who is typing there.
export function suggest(field, value) {
  if (!field.value && document.activeElement !== field) field.value = value;
}
export const number = (value, digits = 2) => (Number.isFinite(value) ? value.toFixed(digits) : "–");

function ownKey() {
  let key = sessionStorage.getItem("page");
  if (!key) {
    key = [...crypto.getRandomValues(new Uint8Array(12))].map((b) => b.toString(16).padStart(2, "0")).join("");
    sessionStorage.setItem("page", key);
  }
  return key;
}
export const PAGE = ownKey();

export async function ask(path, query = {}) {
  return answered(await fetch(`${path}?${new URLSearchParams(query)}`));
}
export async function send(path, body, query = {}) {
  const raw = body instanceof Blob;
  const response = await fetch(`${path}?${new URLSearchParams(query)}`, {
    method: "POST",
    headers: { "X-Console-Page": PAGE, ...(raw ? {} : { "Content-Type": "application/json" }) },
    body: raw ? body : JSON.stringify(body),
  });
  return answered(response);
}
async function answered(response) {
  let tree;
  try {
    tree = await response.json();
  } catch {
    throw new Error(`the console answered ${response.status}`);
  }
  if (!response.ok) throw new Error(tree.error || `the console answered ${response.status}`);
  return tree;
}

let hide;
export function say(text) {
  const place = byId("said");
  place.textContent = text;
  place.hidden = !text;
  clearTimeout(hide);
  if (text) hide = setTimeout(() => { place.hidden = true; }, 15000);
}
export function tried(act) {
  return async (...given) => {
    try {
      say("");
      return await act(...given);
    } catch (error) {
      say(error.message);
    }
  };
}
export async function whileBusy(button, act) {
  const text = button.textContent;
  button.disabled = true;
  button.textContent = `${text} …`;
  try {
    return await act();
  } finally {
    button.disabled = false;
    button.textContent = text;
  }
}

const listeners = {};
export function when(kind, act) {
  (listeners[kind] ||= []).push(act);
}
function tell(kind, message) {
  for (const act of listeners[kind] || []) act(message);
}

let socket;
export const who = { operator: false, taken: false, pages: 0 };

export function command(message) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
  else byId("lost").hidden = false;
}

function heard(event) {
  if (event.data instanceof ArrayBuffer) {
    const size = new DataView(event.data).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(event.data, 4, size)));
    tell(head.which === "camera" ? "camera-picture" : "picture", { seen: head, jpeg: new Blob([new Uint8Array(event.data, 4 + size)], { type: "image/jpeg" }) });
    return;
  }
  const message = JSON.parse(event.data);
  if (message.kind === "who") Object.assign(who, message);
  if (message.kind === "said") say(message.error);
  tell(message.kind, message);
}

export function connect() {
  socket = new WebSocket(`ws://${location.host}/ws?page=${PAGE}`);
  socket.binaryType = "arraybuffer";
  socket.addEventListener("open", () => { byId("lost").hidden = true; tell("open", {}); });
  socket.addEventListener("message", heard);
  socket.addEventListener("close", () => {
    byId("lost").hidden = false;
    tell("closed", {});
    setTimeout(connect, 500);
  });
}
