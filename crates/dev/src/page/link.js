// The WebSocket to the program: passes incoming messages to listeners, and matches answers to requests.

const RETRY_DELAY = 500; // milliseconds before a reconnection attempt
const HTTP_TIMEOUT = 2000; // timeout in milliseconds of an HTTP request to the program
const ANSWERS = ["asked", "refused", "pixel", "object", "objects"]; // messages that answer a request
const listeners = { state: [], frame: [], link: [], refused: [] };
const messageListeners = new Map(); // listeners for all other messages, by message name
let socket = null;
let state = null;
let answers = []; // pending requests, {isCommand, resolve}: answers arrive in the order of the requests
let lastCommand = 0; // the number of the last command that was accepted
let [received, drawn] = [0, 0]; // frame counters, so that a frame decoded late does not replace a newer one

export const element = (id) => document.getElementById(id);

export const onState = (f) => listeners.state.push(f); // f(state, isCurrent)
export const onFrame = (f) => listeners.frame.push(f); // f(header, images by name)
export const onLink = (f) => listeners.link.push(f); // f(isConnected, isFull)
export const onRefused = (f) => listeners.refused.push(f); // f(text)
export const onMessage = (name, f) => messageListeners.set(name, [...(messageListeners.get(name) ?? []), f]); // f(value)

const emit = (name, ...values) => listeners[name].forEach((f) => f(...values));
const isOpen = () => socket?.readyState === WebSocket.OPEN;

// Resolves to the answer, or to null if the request is refused or the connection is closed.
function send(message, isCommand) {
  if (!isOpen()) return Promise.resolve(null);
  socket.send(JSON.stringify(message));
  return new Promise((resolve) => answers.push({ isCommand, resolve }));
}

// Sends a command; resolves to its number.
export const sendCommand = (command) => send(command, true);

// Sends a read-only request. The answer is also passed to the listeners of its message.
export const sendQuery = (query) => send(query, false);

// Resolves to the values of a pixel: {x, y, values}.
export const queryPixel = (pixel) => sendQuery({ pixel });

// Returns true if the program has executed all commands of this page. Until then, the program's state must not replace
// newer input.
export const isUpToDate = () => !answers.some(({ isCommand }) => isCommand) && state !== null && state.executed >= lastCommand;
export const lastState = () => state;

export function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`);
  socket.binaryType = "arraybuffer";
  let wasOpened = false;
  socket.onopen = () => {
    [lastCommand, wasOpened] = [0, true];
    emit("link", true, false);
  };
  socket.onmessage = ({ data }) => (typeof data === "string" ? handleMessage(JSON.parse(data)) : showFrame(data));
  socket.onclose = async () => {
    for (const { resolve } of answers) resolve(null);
    answers = [];
    emit("link", false, !wasOpened && (await isServed()));
    setTimeout(connect, RETRY_DELAY);
  };
}

// Returns true if the program answers HTTP requests. If the program answers, but closes the socket, the maximum number
// of viewers is reached.
async function isServed() {
  try {
    return (await fetch("/", { signal: AbortSignal.timeout(HTTP_TIMEOUT) })).ok;
  } catch {
    return false;
  }
}

function handleMessage(message) {
  if (message.state) {
    state = message.state;
    emit("state", state, isUpToDate());
    return;
  }
  const [[name, value]] = Object.entries(message);
  if (ANSWERS.includes(name)) {
    const { isCommand, resolve } = answers.shift();
    if (name === "asked") lastCommand = value;
    if (name === "refused") emit("refused", value);
    resolve(name === "refused" ? null : value);
    if (isCommand && isUpToDate()) emit("state", state, true);
  }
  messageListeners.get(name)?.forEach((f) => f(value));
}

// Decodes and shows a frame. A frame consists of the header length, the header as JSON, and the PNG files that the
// header lists.
async function showFrame(data) {
  const [order, source] = [++received, socket];
  const length = new DataView(data).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  let offset = 4 + length;
  const decoded = header.parts.map(async ([name, size]) => {
    const blob = new Blob([new Uint8Array(data, offset, size)], { type: "image/png" });
    offset += size;
    return [name, await createImageBitmap(blob, { colorSpaceConversion: "none" })];
  });
  try {
    const images = new Map(await Promise.all(decoded));
    if (order < drawn) return;
    drawn = order;
    emit("frame", header, images);
  } finally {
    acknowledge(source, header.number); // also if decoding fails, because the program waits for this frame
  }
}

const acknowledged = new WeakMap(); // the last acknowledged number of each connection

// Acknowledges a frame, and all earlier frames, once the browser has drawn it. The program keeps few frames in flight,
// so that newer frames are not delayed on a slow connection. An earlier frame may be decoded later.
function acknowledge(source, number) {
  requestAnimationFrame(() => {
    if (source.readyState !== WebSocket.OPEN || acknowledged.get(source) > number) return;
    acknowledged.set(source, number);
    source.send(JSON.stringify({ shown: number }));
  });
}
