// A visitor of the page: opens files, inspects a pixel, lets the scene move; leaves what was seen at the server. Before this,
// FILES has contents (base64) by name, EXPERIMENT a text.
const at = (id) => document.getElementById(id);
const seen = { trouble: "" };
let saved = null;

// Downloads are kept, not made.
URL.createObjectURL = (blob) => {
  saved = blob;
  return "data:,";
};
HTMLAnchorElement.prototype.click = () => {};

// The last picture, as a sum, and when it came.
let [drawn, drawnAt] = [0, 0];
const { putImageData } = CanvasRenderingContext2D.prototype;
CanvasRenderingContext2D.prototype.putImageData = function put(image, ...at) {
  [drawn, drawnAt] = [image.data.reduce((sum, byte) => sum + byte, 0), performance.now()];
  return putImageData.call(this, image, ...at);
};

const pause = (ms) => new Promise((go) => setTimeout(go, ms));

async function wait(what, test) {
  for (let turn = 0; turn < 6000; turn += 1) {
    const found = test();
    if (found) return found;
    await pause(50);
  }
  throw new Error(`${what} does not come; trouble: ${at("view-trouble").textContent}; status: ${at("view-status").textContent}`);
}

const rows = (id) => Object.fromEntries([...at(id).rows].map(({ cells: [name, ...values] }) => [name.textContent, values.map((cell) => cell.textContent)]));
const figure = (name) => rows("figures")[name]?.[0];
const isFinished = (spp) => figure("samples a pixel") === `${spp} of ${spp}`;

async function finish(triangles, spp = 4) {
  await wait(`${triangles} triangles, ${spp} samples`, () => at("triangles").textContent === `${triangles} triangles` && isFinished(spp));
}

function transfer(names) {
  const moved = new DataTransfer();
  for (const name of names) {
    const bytes = Uint8Array.from(atob(FILES[name]), (letter) => letter.charCodeAt(0));
    moved.items.add(new File([bytes], name.split("/").at(-1)));
  }
  return moved;
}

// As of the dialog for folders: a script can choose files for an input, but give them no paths.
function choose(names) {
  const files = [...transfer(names).files];
  files.forEach((file, place) => Object.defineProperty(file, "webkitRelativePath", { value: names[place] }));
  Object.defineProperty(at("folder"), "files", { value: files, configurable: true });
  at("folder").dispatchEvent(new Event("change"));
}

function drop(names) {
  at("canvas").dispatchEvent(new DragEvent("drop", { dataTransfer: transfer(names), bubbles: true, cancelable: true }));
}

async function image() {
  saved = null;
  at("save-pfm").click();
  const blob = await wait("an image", () => saved);
  return [...new Uint8Array(await blob.arrayBuffer())];
}

async function refused(names) {
  at("view-trouble").textContent = "";
  drop(names);
  const sentence = await wait(`a sentence on ${names}`, () => at("view-trouble").textContent);
  await wait("controls", () => !at("map").disabled);
  return [sentence, at("triangles").textContent, at("scene").value];
}

const press = (key) => at("canvas").dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));

function type(id, value) {
  at(id).value = value;
  at(id).dispatchEvent(new Event("change"));
}

async function inspect() {
  [at("pixel-x").value, at("pixel-y").value] = [24, 20];
  at("inspect").click();
  seen.pixel = await wait("a radiance", () => rows("pixel-rows").radiance && rows("pixel-rows"));
  seen.ray = at("pixel-ray").dataset.ray;
  at("pixel-trace").click();
  seen.trace = await wait("a trace", () => !at("pixel-trace-text").hidden && at("pixel-trace-text").lastElementChild.textContent);
  at("pixel-sample").value = 1;
  at("canvas").focus();
  press("p");
  const vertices = await wait("a path", () => !at("pixel-path-text").hidden && [...at("pixel-path-text").querySelectorAll("li")]);
  seen.path = vertices.map((line) => line.textContent);
  await wait("dots", () => at("overlay").querySelector(".dot"));
  seen.dots = at("overlay").querySelectorAll(".inner.dot").length;
  at("pixel-points").checked = true;
  type("pixel-second", 3);
  seen.star = await wait("points", () => at("pixel-star").textContent);
  // A click of the image inspects the pixel there, and moves nothing.
  const { left, top, width, height } = at("canvas").getBoundingClientRect();
  const [clientX, clientY] = [left + (10.5 / 48) * width, top + (30.5 / 36) * height];
  // No pointer is down that could be captured.
  at("canvas").setPointerCapture = () => {};
  for (const kind of ["pointerdown", "pointerup"]) {
    at("canvas").dispatchEvent(new PointerEvent(kind, { clientX, clientY, button: 0, pointerId: 1 }));
  }
  await wait("the clicked pixel", () => rows("pixel-rows").radiance && [at("pixel-x").value, at("pixel-y").value].join() === "10,30");
  seen.clicked = isFinished(4);
  press("p");
}

// Maps of the model at hand: their means, and that of the counted rays, which that of bounces comes to with its last sample.
async function maps() {
  seen.maps = { counted: figure("bounce rays a sample").split(" ")[0] };
  for (const map of ["bounces", "cycles"]) {
    at("map").value = map;
    at("map").dispatchEvent(new Event("input"));
    const words = at("map").selectedOptions[0].textContent;
    await wait(`the map of ${map}`, () => at("scale").textContent.endsWith(words) && figure("mean of the map") && isFinished(4));
    if (map === "bounces") await wait("all of its samples", () => figure("mean of the map") === seen.maps.counted);
    seen.maps[map] = figure("mean of the map");
  }
  type("map", "none");
  at("map").dispatchEvent(new Event("input"));
}

// A model has the parameters of every scene; a wrong one is a sentence, and the controls go back.
async function parameters() {
  // They stand on a ground of two.
  type("scene-copies", 3);
  await finish(8);
  type("scene-environment", "sky.hdr");
  const sentence = await wait("a sentence on the environment", () => at("view-trouble").textContent);
  await wait("the controls", () => at("scene-environment").value === "");
  seen.parameters = [sentence, at("scene").value, at("scene-copies").value, at("triangles").textContent];
  type("scene-copies", 0);
  await finish(2);
}

// An object follows the pointer, stands where it is typed, and goes back.
async function drag() {
  type("scene", "instances");
  await finish("20,480");
  type("accel-a", "meta-bvh");
  await wait("the structure", () => at("view-status").textContent.includes("meta-bvh") && isFinished(4));
  seen.objects = { still: await image(), count: Number(at("object").max) + 1 };
  const { left, top, width, height } = at("canvas").getBoundingClientRect();
  at("canvas").setPointerCapture = () => {};
  at("objects-drag").click();
  const point = (kind, x, y) => at("canvas").dispatchEvent(new PointerEvent(kind, { clientX: left + x * width, clientY: top + y * height, button: 0, pointerId: 1 }));
  point("pointerdown", 0.5, 0.5);
  point("pointermove", 0.6, 0.45);
  point("pointermove", 0.7, 0.4);
  await wait("a way", () => !at("objects-back").hidden && Number(at("object-x").value) !== 0);
  point("pointerup", 0.7, 0.4);
  await wait("the image", () => isFinished(4));
  const way = ["x", "y", "z"].map((axis) => Number(at(`object-${axis}`).value));
  Object.assign(seen.objects, { way, moved: await image() });
  at("objects-drag").click();
  at("objects-back").click();
  await wait("all objects back", () => at("objects-back").hidden && isFinished(4));
  seen.objects.back = await image();
  // By numbers: the way that the pointer took.
  ["x", "y", "z"].forEach((axis, place) => { at(`object-${axis}`).value = way[place]; });
  type("object-z", way[2]);
  await wait("a typed way", () => !at("objects-back").hidden && isFinished(4));
  seen.objects.typed = await image();
  type("scene", "quad.glb");
  type("accel-a", "cwbvh");
  await finish(2);
  seen.objects.gone = at("objects").hidden;
}

async function move() {
  seen.still = await image();
  at("canvas").focus();
  type("motion-frames", 8);
  type("motion-of", "deform");
  // As a field takes it, and TOML does not.
  type("motion-amplitude", ".3");
  press(" ");
  await wait("frames", () => figure("frames a second") && Number(at("motion-frame").value) >= 2);
  press(" ");
  await wait("the end of the motion", () => at("motion-play").textContent === "Play" && !figure("frames a second") && isFinished(4));
  seen.frame = Number(at("motion-frame").value);
  seen.refitted = await image();
  // Another structure, which is built over the frame.
  type("accel-a", "bvh");
  await wait("a built structure", () => at("view-status").textContent.includes("bvh built"));
  await wait("its image", () => isFinished(4));
  seen.rebuilt = await image();
  type("motion-of", "");
  await wait("the scene at rest", () => isFinished(4) && at("view-status").textContent.includes("followed"));
}

// The time from another exposure to its picture, while one sample takes long.
async function expose() {
  type("map", "none");
  at("map").dispatchEvent(new Event("input"));
  type("spp", "64");
  type("size", "800,600");
  await wait("a long sample", () => at("canvas").width === 800 && Number(figure("samples a pixel")?.split(" ")[0]) >= 1);
  seen.waits = [];
  for (const stops of [1, -1, 2, 0, -2]) {
    await pause(Math.random() * 200);
    const [before, start] = [drawn, performance.now()];
    at("exposure").value = stops;
    at("exposure").dispatchEvent(new Event("input"));
    await wait("another exposure", () => drawn !== before);
    seen.waits.push(drawnAt - start);
  }
  seen.sample = Number(figure("ms a sample").replaceAll(",", ""));
}

async function visit() {
  await wait("the first image", () => at("triangles").textContent && isFinished(4));
  choose(["room/room.mtl", "room/maps/wall.png", "room/room.obj"]);
  await finish(4);
  seen.scenes = [at("scene").value, ...at("scene").querySelectorAll("optgroup option")].map((one) => one.value ?? one);
  seen.notes = at("notes").textContent;
  seen.obj = await image();
  await inspect();
  at("file").files = transfer(["quad.glb"]).files;
  at("file").dispatchEvent(new Event("change"));
  await finish(2);
  seen.glb = await image();
  seen.broken = await refused(["broken.glb"]);
  seen.missing = await refused(["missing.gltf"]);
  seen.unknown = await refused(["notes.txt"]);
  // What was shown before is still there, with its files.
  type("scene", "single-triangle");
  await finish(1);
  type("scene", "quad.glb");
  await finish(2);
  await maps();
  await parameters();
  await move();
  await drag();
  drop(["study.toml", "room/room.obj"]);
  await wait("the experiment", () => at("split").checked && isFinished(2));
  seen.controls = ["scene", "accel-a", "accel-a-leaf_size", "accel-b", "size", "spp", "map", "exposure"].map((id) => at(id)?.value);
  seen.faults = at("faults").textContent;
  at("split").click();
  await wait("one image", () => rows("figures")["samples a pixel"]?.length === 1 && isFinished(2));
  await expose();
}

addEventListener("load", async () => {
  try {
    await visit();
  } catch (error) {
    seen.trouble = `${error.message}\n${error.stack}`;
  }
  await fetch("/seen", { method: "POST", body: JSON.stringify(seen) });
});
