// The pixel that was chosen: its radiance, hit, work, path and points, as the view tells them; nothing is computed here.

const at = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
const RESTS = 300;

let send;
let pixel = null;
let size = [1, 1];
let sides = 1;
let samples = 1;
let trail = [];
let swipe = 0.5;
let hasPath = false;
// The image changed since the pixel was inspected.
let isStale = false;
let timer = 0;

const side = () => (sides > 1 ? Number(at("pixel-side").value) : 0);
const number = (id) => Number(at(id).value);

// `ask` takes requests of the view.
export function pixelPanel(ask) {
  send = ask;
  at("inspect").onclick = () => inspect([number("pixel-x"), number("pixel-y")]);
  for (const id of ["pixel-x", "pixel-y", "pixel-sample"]) {
    at(id).onkeydown = ({ key }) => {
      if (key !== "Enter") return;
      if (id === "pixel-sample") togglePath(true);
      else at("inspect").click();
    };
  }
  at("pixel-path").onclick = () => togglePath();
  at("pixel-trace").onclick = () => pixel && send({ explain: [side(), pixel] });
  at("pixel-ray").onclick = () => navigator.clipboard.writeText(at("pixel-ray").dataset.ray).catch(() => refuse("the browser does not let this page copy"));
  at("pixel-side").onchange = () => {
    if (hasPath) togglePath(true);
    askPoints();
  };
  for (const id of ["pixel-points", "pixel-first", "pixel-second"]) at(id).onchange = askPoints;
}

export function inspect(chosen) {
  pixel = chosen.map((place, axis) => Math.min(Math.max(Math.floor(place), 0), size[axis] - 1));
  [at("pixel-x").value, at("pixel-y").value] = pixel;
  at("pixel-trouble").hidden = true;
  forget();
  if (hasPath) togglePath(false);
  isStale = false;
  send({ inspect: pixel });
  askPoints();
  mark();
}

// Asks for the path of the sample, or hides it.
export function togglePath(isWanted = !hasPath) {
  if (!pixel) return refuse("click the image, or choose a pixel here");
  if (!at("pixel-sample").reportValidity()) return;
  send({ path: isWanted ? [side(), pixel, number("pixel-sample")] : null });
}

function askPoints() {
  const isWanted = at("pixel-points").checked;
  at("pixel-plot").hidden = !isWanted || !pixel;
  const dimensions = ["pixel-first", "pixel-second"];
  if (!isWanted || !pixel || !dimensions.every((id) => at(id).reportValidity())) return;
  send({ points: [side(), pixel, dimensions.map(number)] });
}

// The screen is another one, or the same shown otherwise.
export function screenChanged({ stays, trail }) {
  if (!trail) showPath(null);
  if (stays) return;
  at("pixel-trace-text").hidden = true;
  isStale = pixel !== null;
  clearTimeout(timer);
  // Not at each step of a camera that is dragged.
  timer = setTimeout(refresh, RESTS);
}

// What is known of the pixel once more, if the image changed.
export function refresh(isLast = false) {
  if (!pixel || !(isStale || isLast)) return;
  if (pixel.some((place, axis) => place >= size[axis])) {
    pixel = null;
    ["pixel-x", "pixel-y"].forEach((id, axis) => { at(id).value = Math.min(number(id), size[axis] - 1); });
    forget();
    askPoints();
    return mark();
  }
  isStale = false;
  send({ inspect: pixel });
  askPoints();
}

function forget() {
  at("pixel-rows").replaceChildren();
  at("pixel-ray").hidden = true;
  at("pixel-trace-text").hidden = true;
  at("pixel-hint").hidden = pixel !== null;
}

function refuse(reason) {
  at("pixel-trouble").textContent = reason;
  at("pixel-trouble").hidden = false;
}

// Takes what the view found; true if it was of the pixel.
export function takeFound(news) {
  if (news.refused) refuse(news.refused);
  else if (news.inspected) showRows(news.inspected);
  else if ("path" in news) showPath(news.path);
  else if (news.explained) {
    at("pixel-trouble").hidden = true;
    at("pixel-trace-text").hidden = false;
    at("pixel-trace-text").lastElementChild.textContent = news.explained;
  } else if (news.points) drawPoints(news.points);
  else return false;
  return true;
}

function element(name, text) {
  return Object.assign(document.createElement(name), { textContent: text });
}

function showRows({ pixel: [x, y], ray, sides: seen }) {
  if (!pixel || x !== pixel[0] || y !== pixel[1]) return;
  at("pixel-trouble").hidden = true;
  at("pixel-hint").hidden = true;
  at("pixel-ray").hidden = false;
  at("pixel-ray").dataset.ray = ray;
  const names = [...new Set(seen.flatMap((rows) => rows.map(([name]) => name)))];
  const head = seen.length > 1 ? [["", "A", "B"]] : [];
  const rows = names.map((name) => [name, ...seen.map((of) => of.find(([known]) => known === name)?.[1] ?? "–")]);
  at("pixel-rows").replaceChildren(...[...head, ...rows].map((cells, row) => {
    const line = document.createElement("tr");
    line.append(...cells.map((text, column) => {
      const title = row < head.length ? "col" : column === 0 ? "row" : "";
      return Object.assign(element(title ? "th" : "td", text), title && { scope: title });
    }));
    return line;
  }));
}

function showPath(lines) {
  hasPath = lines !== null;
  at("pixel-path").ariaPressed = String(hasPath);
  at("pixel-path-text").hidden = !hasPath;
  if (!hasPath) return;
  at("pixel-trouble").hidden = true;
  at("pixel-path-text").lastElementChild.replaceChildren(...(lines.length > 0 ? lines : ["It leaves the scene at once."]).map((line) => element("li", line)));
}

function drawPoints({ purpose, points, star }) {
  const plot = at("pixel-canvas");
  const context = plot.getContext("2d");
  const edge = plot.width;
  const radius = Math.min(Math.max(48 / Math.sqrt(points.length), 3), 8);
  context.clearRect(0, 0, edge, edge);
  context.fillStyle = getComputedStyle(plot).color;
  for (const [x, y] of points) {
    context.beginPath();
    context.arc(x * edge, (1 - y) * edge, radius, 0, 2 * Math.PI);
    context.fill();
  }
  at("pixel-purpose").textContent = purpose;
  at("pixel-star").textContent = `${points.length} ${points.length === 1 ? "point" : "points"}, D* ${star === null ? "–" : star.toFixed(5)}`;
  plot.ariaLabel = `${points.length} points of the sampler in dimensions ${number("pixel-first")} and ${number("pixel-second")}: ${purpose}`;
}

// What is drawn over the image: a frame around the pixel, and the path.
export function marks(known) {
  ({ size, sides, samples, trail, swipe } = known);
  at("pixel-side").parentElement.hidden = sides < 2;
  mark();
}

function mark() {
  [at("pixel-x").max, at("pixel-y").max] = size.map((edge) => edge - 1);
  at("pixel-sample").max = samples - 1;
  const overlay = at("overlay");
  overlay.setAttribute("viewBox", `0 0 ${size[0]} ${size[1]}`);
  const shape = (name, attributes) => {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    return made;
  };
  const shapes = [];
  if (sides > 1) {
    const x = swipe * size[0];
    for (const name of ["outer", "inner"]) shapes.push(shape("line", { class: `${name} swipe`, x1: x, y1: 0, x2: x, y2: size[1] }));
    // As large on every screen, whatever the image's size.
    const letter = (14 * size[0]) / Math.max(at("canvas").clientWidth, 1);
    for (const [name, place, anchor] of [["A", x - letter / 2, "end"], ["B", x + letter / 2, "start"]]) {
      const text = shape("text", { x: place, y: 1.3 * letter, "font-size": letter, "text-anchor": anchor });
      text.textContent = name;
      shapes.push(text);
    }
  }
  if (pixel) {
    // As large as can be seen, whatever the image's size.
    const around = Math.max(0.5, (5 * size[0]) / Math.max(at("canvas").clientWidth, 1));
    const [x, y] = pixel.map((place) => place + 0.5 - around);
    for (const name of ["outer", "inner"]) shapes.push(shape("rect", { class: name, x, y, width: 2 * around, height: 2 * around }));
  }
  for (const name of ["outer", "inner"]) {
    trail.forEach((to, place) => {
      const from = trail[place - 1];
      if (from && to) shapes.push(shape("line", { class: name, x1: from[0], y1: from[1], x2: to[0], y2: to[1] }));
    });
    // A line of no length with round ends: a dot of so many pixels of the screen.
    for (const dot of trail.filter(Boolean)) shapes.push(shape("line", { class: `${name} dot`, x1: dot[0], y1: dot[1], x2: dot[0], y2: dot[1] }));
  }
  overlay.replaceChildren(...shapes);
}
