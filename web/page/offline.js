// Keeps the page for times without a network: what the server has counts, and what it had if it is not reached.
const KEPT = "raystone-web";
const FILES = ["./", "report.css", "web.css", "view.js", "choices.js", "moves.js", "files.js", "pixel.js", "motion.js", "view-worker.js", "app.js", "adapter.js", "results.js", "worker.js", "raystone_web.js", "raystone_web_bg.wasm"];

addEventListener("install", (event) => event.waitUntil(caches.open(KEPT).then((cache) => cache.addAll(FILES))));

addEventListener("fetch", (event) => {
  if (event.request.method !== "GET") return;
  event.respondWith(fresh(event.request));
});

async function fresh(request) {
  const cache = await caches.open(KEPT);
  try {
    const answer = await fetch(request);
    if (answer.ok) await cache.put(request, answer.clone());
    return answer;
  } catch (error) {
    const kept = await cache.match(request, { ignoreSearch: true });
    if (kept) return kept;
    throw error;
  }
}
