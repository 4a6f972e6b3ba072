// Tables and verdicts from records.

// Scenes in order, each with its structures and the rates of its classes of rays.
export function rows(records) {
  const scenes = new Map();
  for (const { key, body } of records) {
    if (body.kind === "scene") {
      const name = label(key, "scene");
      scenes.set(name, { name, triangles: body.triangles, classes: [], most: {}, structures: [] });
    } else if (body.kind === "structure") {
      const scene = scenes.get(label(key, "scene"));
      const rates = Object.fromEntries(body.timings.map((t) => [t.class, t.mrays_s]));
      const failure = body.failure ?? "";
      const passed = Boolean(body.gate?.passed) && !failure;
      scene.structures.push({ name: label(key, "accel"), passed, failure, rates, build: body.build_ms });
      for (const [name, rate] of Object.entries(rates)) {
        if (!scene.classes.includes(name)) scene.classes.push(name);
        scene.most[name] = Math.max(scene.most[name] ?? 0, rate.value);
      }
    }
  }
  return [...scenes.values()];
}

function label(key, axis) {
  const value = key?.[axis];
  return typeof value === "string" ? value : (value?.label ?? value?.name ?? "");
}

// A winner for each class of rays where its interval lies above all others; if not, those within it.
export function verdicts(scene) {
  return scene.classes.map((name) => {
    const rated = scene.structures.filter((s) => s.rates[name]);
    rated.sort((a, b) => b.rates[name].value - a.rates[name].value);
    const [first, second] = rated;
    if (!second) return `${name}: ${first.name} alone`;
    const near = rated.slice(1).filter((s) => s.rates[name].high >= first.rates[name].low);
    if (near.length > 0) return `${name}: ${[first, ...near].map((s) => s.name).join(", ")}, too close to tell apart`;
    const ratio = first.rates[name].value / second.rates[name].value;
    return `${name}: ${first.name}, ${ratio.toFixed(2)} times as fast as ${second.name}`;
  });
}
