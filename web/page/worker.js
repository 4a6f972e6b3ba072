// Measures: everything that takes long, so that the page stays alive.
import init, { measure } from "./raystone_web.js";
import { adapterName } from "./adapter.js";

let paused = false;
let waiting = [];

onmessage = ({ data }) => {
  if ("pause" in data) {
    paused = data.pause;
    if (!paused) waiting.splice(0).forEach((go) => go());
  } else {
    run(data);
  }
};

// What went wrong inside, where no promise is rejected.
globalThis.raystoneFault = (text) => postMessage({ trouble: `The measurement broke off by a fault of this page: ${text}` });
addEventListener("unhandledrejection", ({ reason }) => globalThis.raystoneFault(reason?.message ?? String(reason)));

async function run({ set, only }) {
  try {
    const name = await adapterName();
    await init();
    const page = {
      write: (line) => postMessage({ line }),
      say: (say, share) => postMessage({ say, share }),
      // Through the event loop in any case, so that messages arrive.
      allowed: () => new Promise((go) => (paused ? waiting.push(go) : setTimeout(go))),
      adapter: () => name,
      browser: () => navigator.userAgent,
    };
    await measure(page, set, only);
    postMessage({ done: true });
  } catch (error) {
    postMessage({ trouble: `The measurement broke off: ${typeof error === "string" ? error : error.message}` });
  }
}
