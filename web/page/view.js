// The view: sends what is chosen and how the camera moves to its worker, and draws what comes back.
import { adapterTrouble } from "./adapter.js";
import { isMeasuring } from "./app.js";
import { adopt, axisField, listModels, offer, overridesOf } from "./choices.js";
import { visitorsFiles } from "./files.js";
import { adoptMotion, dragsObjects, motionFields, motionOverrides, showFrame, takeObject } from "./motion.js";
import { canvasMoves } from "./moves.js";
import { inspect, marks, pixelPanel, refresh, screenChanged, takeFound, togglePath } from "./pixel.js";

const at = (id) => document.getElementById(id);
const parameters = new URLSearchParams(location.search);
// What a link or a test may ask for: settings to begin with, two images, and where on this server to leave what is finished.
const isStill = matchMedia("(prefers-reduced-motion: reduce)");
const asked = { set: parameters.getAll("set").filter((set) => !isStill.matches || !set.startsWith("window.play")), post: parameters.get("start") === null && parameters.get("post") };
const SIDES = ["a", "b"];
const OF_SIDE = ["accel", "sequence", "decorrelation", "integrator", "organisation"];

let worker = null;
let figures = null;
// What the last change took.
let said = "";
// Why a link's settings are not shown, until the visitor changes something.
let leftOut = "";
// Of a test, once it asks for them.
let images = null;

function trouble(text) {
  at("view-trouble").textContent = text;
  at("view-trouble").hidden = !text;
}

async function open() {
  const refused = await adapterTrouble();
  if (refused) return end(refused);
  trouble("");
  at("view-status").textContent = "opening the adapter";
  worker = new Worker("view-worker.js", { type: "module" });
  worker.onmessage = ({ data }) => take(data);
  worker.onerror = (event) => end(`The view broke off: ${event.message || "its worker could not be started"}.`);
}

function end(reason) {
  worker?.terminate();
  worker = null;
  at("view-status").textContent = "";
  at("again").hidden = false;
  trouble(reason);
  post({ trouble: reason });
}

function ask(request, restarts = false, files = []) {
  worker?.postMessage({ ask: request, restarts, files }, files);
}

// Files of the visitor: until they are shown or refused, nothing else can be chosen.
function openFiles(names, files) {
  if (!worker || !figures) return trouble("The view is not there yet: open the files again in a moment.");
  trouble("");
  at("view-status").textContent = `opening ${names.length === 1 ? names[0] : `${names.length} files`}`;
  enable(false);
  ask({ open: { names, still: isStill.matches } }, true, files);
}

function enable(is) {
  for (const control of document.querySelectorAll("#view fieldset, #view button")) control.disabled = !is;
}

function take(news) {
  if (news.picture) return draw(news);
  if (news.opened) return opened(news.opened);
  if (news.ended) return end(news.ended);
  if (news.shown) adoptScreen(news);
  if (news.trouble) {
    at("view-status").textContent = "";
    trouble(news.trouble);
    post({ trouble: news.trouble });
    if (!figures && asked.set.length > 0) {
      // Nothing is on screen, and what the link asks for cannot be.
      leftOut = `${news.trouble} The link's settings are left out.`;
      asked.set = [];
      show();
    }
  } else if ("status" in news) {
    at("view-status").textContent = news.status || said;
  } else if ("done" in news) {
    trouble(leftOut);
    leftOut = "";
    said = news.done?.join("; ") ?? said;
    at("view-status").textContent = said;
    // Controls say what a link asked for, and from then on have the last word.
    if (asked.set.length > 0) ask("adopt");
    at("notes").textContent = news.notes.join(" ");
    if (!news.stays) finished.spp = null;
    screenChanged(news);
  } else if (takeFound(news) || takeObject(news)) {
    return;
  } else if (news.experiment) {
    copy(news.experiment);
  } else if (news.bytes) {
    if (!asked.post) return download(news.name, new Blob([news.bytes]));
    images.push([...news.bytes]);
    if (images.length === figures.sides.length) post({ trouble: "", images, figures });
  } else if (news.idle) {
    finished();
  }
}

function finished() {
  const spp = figures?.sides[0]?.spp ?? 0;
  refresh(finished.spp !== spp);
  finished.spp = spp;
  if (!asked.post || images) return;
  images = [];
  figures.sides.forEach((_, side) => ask({ save: [side, "pfm"] }));
}

// Controls say what is on screen: after a link or the visitor opened something, or something else was refused.
function adoptScreen({ shown, models }) {
  if (models) listModels(models);
  asked.set = [];
  const [first, second = first] = shown.sides;
  adopt("scene", "", first.scene);
  at("split").checked = shown.sides.length > 1;
  for (const [side, of] of [["a", first], ["b", second]]) {
    if (side === "b" && !at("split").checked) break;
    for (const axis of OF_SIDE.filter((axis) => of[axis])) adopt(axis, side, of[axis]);
  }
  offer(at("size"), shown.size.join(), shown.size.join(" × "));
  offer(at("spp"), String(shown.spp));
  for (const [id, value] of [["size", shown.size.join()], ["spp", shown.spp], ["map", shown.map]]) at(id).value = value;
  for (const id of ["exposure", "swipe"]) adoptRange(at(id), shown[id]);
  at("error").checked = shown.error;
  adoptMotion(shown);
  showSides();
  enable(true);
}

// A range takes what is on screen, also beyond its ends and between its steps: else the next change would round it.
function adoptRange(range, shown) {
  // Of f32, as it was written.
  const value = Number(shown.toPrecision(7));
  [range.min, range.max] = [Math.min(range.min, value), Math.max(range.max, value)];
  range.value = value;
  if (Number(range.value) === value) return;
  range.step = "any";
  range.value = value;
}

// Only on this server, and once.
async function post(told) {
  if (!asked.post) return;
  const address = new URL(asked.post, location.origin).pathname;
  asked.post = null;
  await fetch(address, { method: "POST", body: JSON.stringify(told) });
}

// The choices are those of the program: the page knows none by heart.
function opened({ adapter, software, axes, model }) {
  at("view-adapter").textContent = adapter || "an adapter that the browser does not name";
  at("view-software").hidden = !software;
  if (!at("scene-field").firstChild) {
    at("scene-field").append(axisField("scene", "", axes.scene, show, model));
    for (const side of SIDES) {
      at(`side-${side}`).append(...OF_SIDE.map((axis) => axisField(axis, side, axes[axis], show)));
    }
    // A processor takes seconds where a GPU takes one.
    if (software) [at("size").value, at("spp").value] = ["320,240", "64"];
    // Two structures at first: they give the same image, and other maps.
    at("accel-b").value = "bvh";
    at("split").checked = parameters.has("split");
    at("accel-b").onchange();
    showSides();
  }
  enable(true);
}

function showSides() {
  const isSplit = at("split").checked;
  at("side-b").hidden = !isSplit;
  at("name-a").textContent = isSplit ? "A, left" : "Structure and sampler";
}

function show() {
  ask({ show: screen() }, true);
}

// Exposure, maps and the line between two images leave the samples.
function reshow() {
  ask({ show: screen() });
}

function screen() {
  const common = [
    `run.resolution=[${at("size").value}]`,
    `run.spp=[${at("spp").value}]`,
    `window.map=${JSON.stringify(at("map").value)}`,
    `window.exposure=${Number(at("exposure").value).toFixed(2)}`,
    `window.swipe=${Number(at("swipe").value).toFixed(3)}`,
    `window.error=${at("error").checked}`,
    ...overridesOf("scene", ""),
    ...motionOverrides(),
  ];
  const sides = at("split").checked ? SIDES : SIDES.slice(0, 1);
  return sides.map((side) => [...common, ...OF_SIDE.flatMap((axis) => overridesOf(axis, side)), ...asked.set]);
}

function draw({ figures: known, width, height, picture }) {
  const canvas = at("canvas");
  figures = known;
  if (picture.length > 0) {
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    canvas.getContext("2d").putImageData(new ImageData(picture, width, height), 0, 0);
  } else if (known.sides.some(({ fault }) => fault)) {
    // Nothing comes in place of what was there: a canvas that is given a size is empty.
    Object.assign(canvas, { width, height });
  }
  const { sides } = known;
  at("swipe-field").hidden = sides.length < 2;
  at("triangles").textContent = `${known.triangles.toLocaleString("en")} triangles`;
  at("scale").textContent = known.scale ? ` · colours from 0 to ${digits(known.scale)} ${at("map").selectedOptions[0].textContent}` : "";
  const faults = sides.map((side, index) => side.fault && `${sides.length > 1 ? `${"AB"[index]}: ` : ""}${side.fault}`);
  at("faults").textContent = faults.filter(Boolean).join(" ");
  at("faults").hidden = !faults.some(Boolean);
  showFrame(known);
  marks({ size: [width, height], trail: known.trail, sides: sides.length, samples: Number(at("spp").value), swipe: Number(at("swipe").value) });
  const rows = [
    ...timesOf(known.times),
    ["samples a pixel", (side) => (side.spp ? `${side.spp} of ${side.of}` : side.fault ? "–" : "coarse")],
    ["ms a sample", (side) => digits(side.sample_ms)],
    ["Mrays/s", (side) => digits(side.mrays_s)],
    ...sides[0].rays.map(([name], index) => [`${name} rays a sample`, (side) => raysOf(side.rays[index])]),
    ["mean of the map", (side) => digits(side.map_mean)],
    ["relMSE", (side) => digits(side.relmse)],
    ["FLIP", (side) => digits(side.flip)],
    ["nodes or cells", (side) => (side.nodes ? side.nodes.toLocaleString("en") : "–")],
    ["SAH cost", (side) => digits(side.sah_cost)],
    ["structure, KiB", (side) => digits(side.bytes ? side.bytes / 1024 : null)],
  ].map(([name, value]) => [name, ...sides.map((side, index) => value(side, index))]);
  const shown = rows.filter(([, ...values]) => values.some((value) => value !== "–"));
  const title = sides.length > 1 ? [["", "A", "B"]] : [];
  at("figures").replaceChildren(...[...title, ...shown].map((cells, row) => {
    const line = document.createElement("tr");
    line.append(...cells.map((text, column) => {
      const cell = document.createElement(column === 0 || (title.length > 0 && row === 0) ? "th" : "td");
      cell.textContent = text;
      return cell;
    }));
    return line;
  }));
}

// What the last frame took, while the scene moves.
function timesOf(times) {
  if (!times) return [];
  const of = (part) => (_, index) => digits(times.sides[index]?.[part]);
  const once = (value) => (_, index) => (index === 0 ? digits(value) : "–");
  return [
    ["frames a second", once(times.whole_ms && 1000 / times.whole_ms)],
    ["scene moved, ms", once(times.scene_ms)],
    ["structure updated, ms", of(0)],
    ["samples, ms", of(1)],
    ["rest, ms", once(times.rest_ms)],
  ];
}

function raysOf(ofClass) {
  return ofClass ? `${digits(ofClass[1])} (${digits(ofClass[2])} Mrays/s)` : "–";
}

function digits(value) {
  return value == null ? "–" : Number(value.toPrecision(3)).toLocaleString("en", { maximumSignificantDigits: 3 });
}

function download(name, blob) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    at("view-status").textContent = "copied: raystone view --experiment FILE shows it again, raystone run FILE measures it";
  } catch {
    download("raystone.toml", new Blob([text]));
  }
}

// One panel at a time, so that a view takes nothing from a measurement.
function turn(to) {
  for (const panel of ["view", "measure"]) {
    at(panel).hidden = panel !== to;
    at(`to-${panel}`).ariaPressed = String(panel === to);
  }
  if (to === "view" && !worker) open();
  pause();
}

function pause() {
  const rests = document.hidden || at("view").hidden || isMeasuring();
  worker?.postMessage({ pause: rests });
  at("resting").hidden = !isMeasuring();
}

at("to-view").onclick = () => turn("view");
at("to-measure").onclick = () => turn("measure");
at("again").onclick = () => location.reload();
for (const id of ["size", "spp", "error"]) at(id).onchange = show;
for (const id of ["map", "exposure", "swipe"]) at(id).oninput = reshow;
at("split").onchange = () => {
  showSides();
  show();
};
at("home").onclick = () => ask("home", true);
at("save-png").onclick = () => at("canvas").toBlob((blob) => download("raystone.png", blob));
at("save-pfm").onclick = () => ask({ save: [0, "pfm"] });
at("copy-experiment").onclick = () => ask("experiment");
pixelPanel(ask);
motionFields(show, () => figures?.frame ?? 0, (request) => ask(request, true));
visitorsFiles({ file: at("file"), folder: at("folder"), openFile: at("open-file"), openFolder: at("open-folder") }, openFiles, trouble);
canvasMoves(at("canvas"), (request) => ask(request, true), {
  o: () => at("open-file").click(),
  i: () => at("pixel-x").focus(),
  p: () => togglePath(),
  g: () => at("objects-drag").click(),
  " ": () => at("motion-play").click(),
  "+": () => expose(0.5),
  "=": () => expose(0.5),
  "-": () => expose(-0.5),
  b: () => at("split").click(),
  m: () => step(at("map"), 1),
  "[": () => swipe(-0.05),
  "]": () => swipe(0.05),
}, {
  click: ([x, y]) => figures && inspect([x * at("canvas").width, y * at("canvas").height]),
  drags: dragsObjects,
  grasp: (place) => {
    const { width, height } = at("canvas");
    ask({ grasp: [width, height].map((edge, axis) => Math.min(Math.max(Math.floor(place[axis] * edge), 0), edge - 1)) });
  },
});

function expose(stops) {
  at("exposure").value = Number(at("exposure").value) + stops;
  reshow();
}

function step(select, by) {
  select.selectedIndex = (select.selectedIndex + by) % select.options.length;
  reshow();
}

function swipe(by) {
  at("swipe").value = Number(at("swipe").value) + by;
  reshow();
}

document.addEventListener("visibilitychange", pause);
addEventListener("measuring", pause);
turn(parameters.has("start") || location.hash === "#measure" ? "measure" : "view");
