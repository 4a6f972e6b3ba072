// Moves of the camera by mouse, fingers and keys, gathered so that no more than one of a kind is sent a frame.

const TURN = 0.12;
const FLY = 0.1;
// A mouse and a finger that move no farther click, pixels.
const STILL = { mouse: 4, touch: 12 };
const KEYS = {
  ArrowLeft: { orbit: [-TURN, 0] },
  ArrowRight: { orbit: [TURN, 0] },
  ArrowUp: { orbit: [0, TURN] },
  ArrowDown: { orbit: [0, -TURN] },
  PageUp: { approach: Math.exp(-FLY) },
  PageDown: { approach: Math.exp(FLY) },
  w: { fly: [0, 0, FLY] },
  s: { fly: [0, 0, -FLY] },
  a: { fly: [-FLY, 0, 0] },
  d: { fly: [FLY, 0, 0] },
  q: { fly: [0, -FLY, 0] },
  e: { fly: [0, FLY, 0] },
  Home: "home",
};

// `send` takes requests of the view; `others` are what further keys do; `click` and `grasp` take a place, shares of the width and
// height; `drags` says whether a drag without Alt moves objects, too.
export function canvasMoves(canvas, send, others, { click, drags, grasp }) {
  let pending = {};
  const add = (kind, by) => {
    if (Object.keys(pending).length === 0) requestAnimationFrame(flush);
    pending[kind] = (pending[kind] ?? [0, 0]).map((value, axis) => value + by[axis]);
  };
  const flush = () => {
    const { near, ...moves } = pending;
    pending = {};
    for (const move of Object.entries(moves)) send(Object.fromEntries([move]));
    if (near) send({ approach: Math.exp(near[0]) });
  };
  const held = new Map();
  const spread = () => {
    const [one, other] = [...held.values()];
    return { x: (one.x + other.x) / 2, y: (one.y + other.y) / 2, far: Math.hypot(one.x - other.x, one.y - other.y) };
  };
  const place = ({ clientX: x, clientY: y }) => ({ x, y });
  // Where a lone pointer went down, until it moves or another joins it.
  let pressed = null;
  // An object is dragged, not the camera.
  let isObject = false;
  const share = ({ x, y }) => {
    const { left, top, width, height } = canvas.getBoundingClientRect();
    return [(x - left) / width, (y - top) / height];
  };
  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, place(event));
    pressed = held.size === 1 && event.button === 0 ? place(event) : null;
    isObject = pressed !== null && (event.altKey || drags());
  };
  canvas.onpointercancel = (event) => held.delete(event.pointerId);
  canvas.onpointerup = (event) => {
    held.delete(event.pointerId);
    if (!pressed) return;
    pressed = null;
    click(share(place(event)));
  };
  canvas.onpointermove = (event) => {
    const before = held.get(event.pointerId);
    if (!before) return;
    if (pressed && Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) < (STILL[event.pointerType] ?? STILL.mouse)) return;
    if (pressed && isObject) grasp(share(pressed));
    pressed = null;
    const { clientWidth: width, clientHeight: height } = canvas;
    const was = held.size === 2 ? spread() : before;
    held.set(event.pointerId, place(event));
    const now = held.size === 2 ? spread() : place(event);
    const [x, y] = [(now.x - was.x) / height, (now.y - was.y) / height];
    if (held.size === 2) {
      add("pan", [-x, y]);
      add("near", [Math.log(was.far / Math.max(now.far, 1)), 0]);
    } else if (isObject) {
      add("drag", [(now.x - was.x) / width, y]);
    } else if (event.shiftKey || event.buttons === 2) {
      add("pan", [-x, y]);
    } else if (event.ctrlKey || event.metaKey || event.buttons === 4) {
      add("turn", [(x * Math.PI) / 2, (-y * Math.PI) / 2]);
    } else {
      add("orbit", [-x * Math.PI, y * Math.PI]);
    }
  };
  canvas.oncontextmenu = (event) => event.preventDefault();
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    add("near", [event.deltaY / 400, 0]);
  }, { passive: false });
  canvas.onkeydown = (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (!KEYS[key] && !others[key]) return;
    event.preventDefault();
    if (KEYS[key]) send(KEYS[key]);
    else others[key]();
  };
}
