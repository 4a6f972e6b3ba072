// The page: starts the worker that measures, shows its progress and its records, and keeps these for download.
import { adapterTrouble } from "./adapter.js";
import { rows, verdicts } from "./results.js";

const at = (id) => document.getElementById(id);
const parameters = new URLSearchParams(location.search);
// What a link or a test may ask for: settings, filters, to start at once, and where on this server to leave the records.
const asked = { set: parameters.getAll("set"), only: parameters.getAll("only"), post: parameters.get("post") };

let worker = null;
let began = 0;
let records = [];

export function isMeasuring() {
  return worker !== null;
}

function trouble(text) {
  at("trouble").textContent = text;
  at("trouble").hidden = !text;
}

function filters() {
  if (asked.only.length > 0) return asked.only;
  return at("scenes").value === "small" ? ["scene=cornell-box,far-corners,triangle-soup"] : [];
}

async function start() {
  trouble("");
  at("start").disabled = true;
  const refused = await adapterTrouble();
  if (refused) {
    at("start").disabled = false;
    return end(refused);
  }
  records = [];
  at("scenes-measured").replaceChildren();
  at("result").hidden = true;
  at("progress").hidden = false;
  at("stop").hidden = false;
  at("scenes").disabled = true;
  at("status").textContent = "starting";
  at("bar").removeAttribute("value");
  began = performance.now();
  worker = new Worker("worker.js", { type: "module" });
  worker.onmessage = ({ data }) => take(data);
  worker.onerror = (event) => end(`The measurement broke off: ${event.message || "the worker could not be started"}.`);
  worker.postMessage({ set: asked.set.join("\n"), only: filters().join("\n") });
  worker.postMessage({ pause: document.hidden });
  dispatchEvent(new Event("measuring"));
}

function take(message) {
  if (message.line) {
    records.push(message.line);
    show(JSON.parse(message.line));
  } else if (message.trouble) {
    end(message.trouble);
  } else if (message.done) {
    end("");
  } else {
    say(message.say, message.share);
  }
}

function say(what, share) {
  at("bar").value = share;
  const seconds = (performance.now() - began) / 1000;
  // Known by what this adapter took so far; not by an adapter of ours.
  const eta = share > 0.03 ? ` · about ${duration((seconds * (1 - share)) / share)} left` : " · how long it takes is told soon";
  at("status").textContent = `${what}${share < 1 ? eta : ""}`;
}

function duration(seconds) {
  return seconds < 90 ? `${Math.ceil(seconds)} s` : `${Math.ceil(seconds / 60)} min`;
}

// Records that end without their last line say that something is missing.
function interrupted(reason) {
  const run = records[0] && JSON.parse(records[0]);
  if (!run) return;
  const wall_s = (performance.now() - began) / 1000;
  records.push(JSON.stringify({ schema: run.schema, body: { kind: "interrupted", reason, wall_s } }));
}

// `told`: what the visitor reads, where records say something else.
async function end(reason, told = reason) {
  worker?.terminate();
  if (worker && reason) interrupted(reason);
  worker = null;
  at("start").disabled = false;
  at("start").textContent = records.length > 0 ? "Measure again" : "Measure this GPU";
  at("stop").hidden = true;
  at("scenes").disabled = false;
  at("progress").hidden = true;
  trouble(told);
  if (records.length > 0) draw();
  dispatchEvent(new Event("measuring"));
  if (asked.post) {
    const body = JSON.stringify({ trouble: reason, records: records.join("\n") + "\n" });
    // Only on this server.
    await fetch(new URL(asked.post, location.origin).pathname, { method: "POST", body });
  }
}

function show(record) {
  if (record.body.kind === "run") {
    const { adapter, software, clock_step_ns: step, timestamps } = record.body.environment;
    const clock = !timestamps ? "timed by the wall clock, since the browser offers no timestamps"
      : step ? `timestamps in steps of ${step.toLocaleString("en")} ns` : "timestamps as exact as the adapter's";
    at("adapter").textContent = `${adapter || "An adapter that the browser does not name"}: ${clock}.`;
    at("software").hidden = !software;
    at("result").hidden = false;
  } else if (["structure", "scene", "failed"].includes(record.body.kind)) {
    draw();
  }
}

function draw() {
  const parsed = records.map((line) => JSON.parse(line));
  const scenes = rows(parsed);
  at("scenes-measured").replaceChildren(...scenes.flatMap((scene) => {
    const title = element("h3", `${scene.name}, ${scene.triangles.toLocaleString("en")} triangles`);
    if (scene.structures.length === 0) return [title, element("p", worker ? "being measured" : "not measured")];
    const list = element("ul");
    list.className = "verdicts";
    list.append(...verdicts(scene).map((text) => element("li", text)));
    return [title, list, table(scene)];
  }));
}

function element(name, text = "") {
  const made = document.createElement(name);
  made.textContent = text;
  return made;
}

function table(scene) {
  const frame = element("div");
  frame.className = "table";
  frame.tabIndex = 0;
  const made = element("table");
  const head = made.createTHead().insertRow();
  const titles = ["structure", "gate", ...scene.classes.map((c) => `${c}, Mrays/s`), "build, ms"];
  titles.forEach((title, column) => {
    const cell = element("th", title);
    cell.scope = "col";
    if (column < 2) cell.className = "text";
    head.append(cell);
  });
  const body = made.createTBody();
  for (const structure of scene.structures) {
    const row = body.insertRow();
    row.append(element("td", structure.name));
    row.cells[0].className = "text";
    const gate = row.insertCell();
    gate.textContent = structure.passed ? "passed" : "failed";
    gate.className = structure.passed ? "text good" : "text bad";
    if (structure.failure) gate.append(element("small", structure.failure));
    for (const name of scene.classes) row.append(rateCell(structure.rates[name], scene.most[name]));
    row.insertCell().textContent = structure.build.toFixed(structure.build < 10 ? 1 : 0);
  }
  frame.append(made);
  return frame;
}

function rateCell(rate, most) {
  const cell = element("td", rate ? "" : "–");
  if (!rate) return cell;
  const text = element("span", digits(rate.value));
  text.className = "rate";
  const bar = element("i");
  bar.ariaHidden = "true";
  bar.style.width = `${(100 * rate.value) / most}%`;
  text.append(bar);
  cell.append(text, element("small", `${digits(rate.low)} – ${digits(rate.high)}`));
  if (rate.value === most) cell.className = "best";
  return cell;
}

function digits(value) {
  return Number(value.toPrecision(3)).toLocaleString("en", { maximumSignificantDigits: 3 });
}

function download() {
  const link = element("a");
  link.href = URL.createObjectURL(new Blob([records.join("\n") + "\n"], { type: "application/jsonl" }));
  link.download = "records.jsonl";
  link.click();
  URL.revokeObjectURL(link.href);
}

async function copy() {
  try {
    await navigator.clipboard.writeText(records.join("\n") + "\n");
    at("copied").textContent = "copied";
  } catch {
    at("copied").textContent = "the browser does not let this page copy; download the file";
  }
}

at("start").onclick = start;
at("stop").onclick = () => end("stopped by the visitor", records.length > 0 ? "Stopped. What was measured until then is below." : "Stopped before anything was measured.");
at("download").onclick = download;
at("copy").onclick = copy;
document.addEventListener("visibilitychange", () => {
  worker?.postMessage({ pause: document.hidden });
  if (worker && document.hidden) at("status").textContent = "paused: the page is in the background";
});
if ("serviceWorker" in navigator && isSecureContext) navigator.serviceWorker.register("offline.js").catch(() => {}); // Without it the page needs its server.
const refused = await adapterTrouble();
if (refused) trouble(refused);
if (parameters.has("start")) start();
