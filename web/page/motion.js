// How the scene moves: an animation that plays, or stands at a frame, and objects that are dragged.

const at = (id) => document.getElementById(id);
const FIELDS = ["amplitude", "wavelength", "frames", "frame-spp", "follow"];

const WAY = ["x", "y", "z"];

let plays = false;
// Ways of the objects that were moved, by number.
let dragged = new Map();

// `changed` is called when something else is chosen; `frame` tells the one that is shown; `send` takes requests of the view.
export function motionFields(changed, frame, send) {
  objectFields(send);
  at("motion-of").onchange = () => {
    at("motion-frame").value = 0;
    plays &&= at("motion-of").value !== "";
    draw();
    changed();
  };
  for (const id of FIELDS) {
    at(`motion-${id}`).onchange = () => {
      if (!at(`motion-${id}`).reportValidity()) return;
      draw();
      changed();
    };
  }
  at("motion-frame").oninput = () => {
    plays = false;
    draw();
    changed();
  };
  at("motion-play").onclick = () => {
    if (at("motion-of").value === "") at("motion-of").value = "deform";
    plays = !plays;
    at("motion-frame").value = frame();
    draw();
    changed();
  };
  draw();
}

function objectFields(send) {
  at("objects-drag").onclick = () => { at("objects-drag").ariaPressed = String(!dragsObjects()); };
  at("objects-back").onclick = () => send("put-back");
  at("object").onchange = () => at("object").reportValidity() && showWay();
  for (const axis of WAY) {
    at(`object-${axis}`).onchange = () => {
      const inputs = [at("object"), ...WAY.map((name) => at(`object-${name}`))];
      if (!inputs.every((input) => input.reportValidity())) return;
      const [object, ...way] = inputs.map((input) => Number(input.value));
      send({ place: [object, way] });
    };
  }
}

// Whether a drag without Alt moves objects.
export const dragsObjects = () => at("objects-drag").ariaPressed === "true" && !at("objects").hidden;

function showWay() {
  const way = dragged.get(Number(at("object").value)) ?? [0, 0, 0];
  WAY.forEach((axis, place) => { at(`object-${axis}`).value = Number(way[place].toPrecision(6)); });
}

// Takes what the view says of an object that is to be dragged; true if it was that.
export function takeObject(news) {
  const refused = news["refused-drag"];
  if (refused === undefined && news.grasped === undefined) return false;
  at("object-trouble").hidden = refused === undefined;
  at("object-trouble").textContent = refused ?? "";
  if (refused === undefined) at("object").value = news.grasped;
  return true;
}

function draw() {
  const of = at("motion-of").value;
  at("motion-more").hidden = of === "";
  at("motion-wavelength").parentElement.hidden = of !== "deform";
  at("motion-frame").max = Number(at("motion-frames").value) - 1;
  at("motion-play").textContent = plays ? "Stop" : "Play";
  showNumber();
}

// The frame that is shown, while frames follow one another, and the objects.
export function showFrame({ frame, objects, dragged: ways }) {
  if (plays) at("motion-frame").value = frame;
  showNumber();
  at("objects").hidden = objects === 0;
  at("object").max = Math.max(objects - 1, 0);
  at("objects-back").hidden = ways.length === 0;
  const isOther = JSON.stringify(ways) !== JSON.stringify([...dragged]);
  dragged = new Map(ways);
  if (isOther) showWay();
}

function showNumber() {
  at("motion-number").textContent = `${at("motion-frame").value} of ${at("motion-frames").value}`;
}

export function motionOverrides() {
  const of = at("motion-of").value;
  if (of === "") return [];
  const value = (id) => at(`motion-${id}`).valueAsNumber;
  return [
    `animation.motion=${JSON.stringify(of)}`,
    `animation.frames=${value("frames")}`,
    `animation.amplitude=${value("amplitude")}`,
    `animation.wavelength=${value("wavelength")}`,
    `window.play=${plays}`,
    `window.frame=${value("frame")}`,
    `window.frame_spp=${value("frame-spp")}`,
    `window.follow=${JSON.stringify(at("motion-follow").value)}`,
  ];
}

// Chooses what is on screen, without asking for it.
export function adoptMotion({ motion, play, frame, frame_spp: spp, follow }) {
  plays = play && motion !== null;
  at("motion-of").value = motion?.of ?? "";
  if (motion) {
    for (const id of ["frames", "amplitude", "wavelength"]) at(`motion-${id}`).value = motion[id];
    at("motion-frame").max = motion.frames - 1;
  }
  at("motion-frame").value = frame;
  at("motion-frame-spp").value = spp;
  at("motion-follow").value = follow;
  draw();
}
