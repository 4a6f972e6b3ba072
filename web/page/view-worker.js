// Renders the view: takes requests of the page, and gives it pictures and figures.
import init, { view } from "./raystone_web.js";
import { adapterName } from "./adapter.js";

let paused = false;
let wake = () => {};
let asks = [];
let taken;

onmessage = ({ data }) => {
  if ("pause" in data) {
    paused = data.pause;
  } else {
    // Of screens only the last counts.
    const others = data.ask.show ? asks.filter(({ ask }) => !ask.show) : asks;
    const restarts = data.restarts || asks.some((other) => other.restarts);
    asks = [...others, { ask: data.ask, files: data.files, restarts }];
  }
  wake();
};

// What went wrong inside, where no promise is rejected.
globalThis.raystoneFault = (text) => postMessage({ ended: `The view broke off by a fault of this page: ${text}` });
addEventListener("unhandledrejection", ({ reason }) => globalThis.raystoneFault(reason?.message ?? String(reason)));

try {
  const name = await adapterName();
  await init();
  const canvas = {
    ask: () => {
      taken = asks.shift();
      return taken && JSON.stringify(taken.ask);
    },
    // A screen that leaves the samples, once: it is drawn at once, and answered later.
    glance: () => {
      const next = asks.find(({ ask }) => ask.show);
      if (!next || next.glanced || asks.some(({ restarts }) => restarts)) return undefined;
      next.glanced = true;
      return JSON.stringify(next.ask);
    },
    file: (place) => new Uint8Array(taken.files[place]),
    overtaken: () => asks.some(({ restarts }) => restarts),
    allowed: async (idle) => {
      while (paused || (idle && asks.length === 0)) await new Promise((go) => { wake = go; });
    },
    tell: (news) => postMessage(JSON.parse(news)),
    draw: (figures, width, height, picture) => {
      const copy = new Uint8ClampedArray(picture);
      postMessage({ figures: JSON.parse(figures), width, height, picture: copy }, [copy.buffer]);
    },
    save: (name, bytes) => postMessage({ name, bytes: bytes.slice() }),
    adapter: () => name,
  };
  await view(canvas);
} catch (error) {
  postMessage({ ended: `The view broke off: ${typeof error === "string" ? error : error.message}` });
}
