// Camera moves, which are accumulated between animation frames and sent together.

import { sendCommand } from "/link.js";

const FLY_SPEED = 0.7; // flight speed: distances to the look-at point per second
const FAST_FACTOR = 4; // speed multiplier while Shift is held

// Flight directions of the keys: right, up, forward.
const FLIGHT = {
  KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyE: [0, 1, 0], KeyQ: [0, -1, 0],
};

const noMoves = () => ({ orbit: [0, 0], pan: [0, 0], dolly: 0, look: [0, 0], fly: [0, 0, 0] });

export const isFlightKey = (code) => code in FLIGHT;

export class Motion {
  constructor() {
    this.pending = noMoves();
    this.held = new Set(); // flight keys that are down
    this.speed = 1;
    this.flying = false;
  }

  // Sends the collected moves, one message per kind.
  send() {
    const { orbit, pan, dolly, look, fly } = this.pending;
    if (orbit[0] || orbit[1]) sendCommand({ move: { orbit } });
    if (pan[0] || pan[1]) sendCommand({ move: { pan } });
    if (dolly) sendCommand({ move: { dolly } });
    if (look[0] || look[1]) sendCommand({ move: { look } });
    if (fly.some((v) => v)) sendCommand({ move: { fly } });
    this.pending = noMoves();
  }

  // Flies while flight keys are held.
  press(code, fast) {
    if (!this.held.size) sendCommand("grab");
    this.held.add(code);
    this.fast = fast;
    if (this.flying) return;
    let last = performance.now();
    const step = (now) => {
      const distance = ((now - last) / 1000) * FLY_SPEED * this.speed * (this.fast ? FAST_FACTOR : 1);
      last = now;
      for (const code of this.held) FLIGHT[code].forEach((v, i) => (this.pending.fly[i] += v * distance));
      this.flying = this.held.size > 0;
      if (this.flying) requestAnimationFrame(step);
      this.send();
    };
    this.flying = true;
    requestAnimationFrame(step);
  }

  release(code) {
    this.held.delete(code);
  }

  stop() {
    this.held.clear();
  }
}
