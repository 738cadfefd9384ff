// The connection to the program: what it tells goes to whoever listens, what is asked gets its answer.

const RETRY = 500; // milliseconds
const ANSWER = 2000; // milliseconds in which a program that is there answers
const ANSWERS = ["asked", "refused", "pixel", "object", "objects"]; // the names of messages that answer
const listeners = { state: [], frame: [], link: [], refused: [] };
const named = new Map(); // who listens to other messages, by their names
let socket = null;
let state = null;
let answers = []; // what waits for an answer, {isCommand, resolve}: they come in the order of what was asked
let asked = 0; // the number of the last command that has one
let [received, drawn] = [0, 0]; // numbers of frames, so that a late one is not shown after a newer

export const element = (id) => document.getElementById(id);

export const onState = (f) => listeners.state.push(f); // f(state, heard)
export const onFrame = (f) => listeners.frame.push(f); // f(header, images by name)
export const onLink = (f) => listeners.link.push(f); // f(whether it is there, whether there is no place)
export const onRefused = (f) => listeners.refused.push(f); // f(text)
export const onMessage = (name, f) => named.set(name, [...(named.get(name) ?? []), f]); // f(value)

const tell = (name, ...values) => listeners[name].forEach((f) => f(...values));
const isOpen = () => socket?.readyState === WebSocket.OPEN;

// Resolves to the answer, or to null if it was refused or nobody is there.
function send(message, isCommand) {
  if (!isOpen()) return Promise.resolve(null);
  socket.send(JSON.stringify(message));
  return new Promise((resolve) => answers.push({ isCommand, resolve }));
}

// Asks for something; resolves to the command's number.
export const ask = (command) => send(command, true);

// Asks a question that changes nothing. What comes of it goes to those who listen for messages too.
export const put = (question) => send(question, false);

// What is known of a pixel: {x, y, values}.
export const askPixel = (pixel) => put({ pixel });

// Whether the program has followed all that was asked for here: what is older than a choice must not undo it.
export const isHeard = () => !answers.some(({ isCommand }) => isCommand) && state !== null && state.heard >= asked;
export const lastState = () => state;

export function connect() {
  socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`);
  socket.binaryType = "arraybuffer";
  let isIn = false;
  socket.onopen = () => {
    [asked, isIn] = [0, true];
    tell("link", true, false);
  };
  socket.onmessage = ({ data }) => (typeof data === "string" ? hear(JSON.parse(data)) : showFrame(data));
  socket.onclose = async () => {
    for (const { resolve } of answers) resolve(null);
    answers = [];
    tell("link", false, !isIn && (await isServed()));
    setTimeout(connect, RETRY);
  };
}

// Whether the program answers: if it lets nobody in, its places are taken.
async function isServed() {
  try {
    return (await fetch("/", { signal: AbortSignal.timeout(ANSWER) })).ok;
  } catch {
    return false;
  }
}

function hear(message) {
  if (message.state) {
    state = message.state;
    tell("state", state, isHeard());
    return;
  }
  const [[name, value]] = Object.entries(message);
  if (ANSWERS.includes(name)) {
    const { isCommand, resolve } = answers.shift();
    if (name === "asked") asked = value;
    if (name === "refused") tell("refused", value);
    resolve(name === "refused" ? null : value);
    if (isCommand && isHeard()) tell("state", state, true);
  }
  named.get(name)?.forEach((f) => f(value));
}

// A frame: the length of its header, the header as JSON, and the PNG files that it counts.
async function showFrame(data) {
  const number = ++received;
  const length = new DataView(data).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
  let at = 4 + length;
  const decoded = header.parts.map(async ([name, size]) => {
    const blob = new Blob([new Uint8Array(data, at, size)], { type: "image/png" });
    at += size;
    return [name, await createImageBitmap(blob, { colorSpaceConversion: "none" })];
  });
  const images = new Map(await Promise.all(decoded));
  if (number < drawn) return;
  drawn = number;
  tell("frame", header, images);
}
