// How the scene moves: an animation that plays, or stands at a frame.

const at = (id) => document.getElementById(id);
const FIELDS = ["amplitude", "wavelength", "frames", "frame-spp", "follow"];

let plays = false;

// `changed` is called when something else is chosen; `frame` tells the one that is shown.
export function motionFields(changed, frame) {
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

function draw() {
  const of = at("motion-of").value;
  at("motion-more").hidden = of === "";
  at("motion-wavelength").parentElement.hidden = of !== "deform";
  at("motion-frame").max = Number(at("motion-frames").value) - 1;
  at("motion-play").textContent = plays ? "Stop" : "Play";
  showFrame(Number(at("motion-frame").value));
}

// The frame that is shown, while frames follow one another.
export function showFrame(frame) {
  if (plays) at("motion-frame").value = frame;
  at("motion-number").textContent = `${at("motion-frame").value} of ${at("motion-frames").value}`;
}

export function motionOverrides() {
  const of = at("motion-of").value;
  if (of === "") return [];
  const value = (id) => at(`motion-${id}`).value;
  return [
    `animation.motion=${JSON.stringify(of)}`,
    `animation.frames=${value("frames")}`,
    `animation.amplitude=${value("amplitude")}`,
    `animation.wavelength=${value("wavelength")}`,
    `window.play=${plays}`,
    `window.frame=${value("frame")}`,
    `window.frame_spp=${value("frame-spp")}`,
    `window.follow=${JSON.stringify(value("follow"))}`,
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
