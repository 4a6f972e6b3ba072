// What the page can do beyond being read: sort, filter, values under the pointer, comparing of images, dark mode.
// Nothing here makes markup of texts: they are set as text, so that a name stays a name.
"use strict";
(() => {
  const root = document.documentElement;
  root.classList.add("scripted");

  const make = (tag, text, attributes = {}) => {
    const element = document.createElement(tag);
    element.textContent = text;
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    return element;
  };
  const button = (text, act, attributes = {}) => {
    const made = make("button", text, { type: "button", ...attributes });
    made.addEventListener("click", act);
    return made;
  };

  // ---- Folds: what a link leads into opens, and all of it for print.
  const reveal = (target) => {
    for (let fold = target; fold; fold = fold.parentElement) if (fold.tagName === "DETAILS") fold.open = true;
  };
  const follow = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (target) {
      reveal(target);
      target.scrollIntoView();
    }
  };
  addEventListener("hashchange", follow);
  if (location.hash) follow();
  const folds = [...document.querySelectorAll("details")];
  let closed = [];
  addEventListener("beforeprint", () => {
    closed = folds.filter((fold) => !fold.open);
    closed.forEach((fold) => (fold.open = true));
  });
  addEventListener("afterprint", () => closed.forEach((fold) => (fold.open = false)));

  // ---- Navigation: where the reader is, dark mode, all folds at once.
  const nav = document.querySelector("nav");
  if (nav) {
    if (folds.length) {
      nav.append(
        button("Unfold all", (event) => {
          const open = folds.some((fold) => !fold.open);
          folds.forEach((fold) => (fold.open = open));
          event.target.textContent = open ? "Fold all" : "Unfold all";
        }, { class: "wide" }),
      );
    }
    nav.append(
      button("◐", () => {
        const dark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
        root.dataset.theme = dark ? "light" : "dark";
      }, { "aria-label": "Dark or light", title: "Dark or light" }),
    );
    const links = new Map([...nav.querySelectorAll("a")].map((link) => [link.getAttribute("href").slice(1), link]));
    const seen = new Set();
    const spy = new IntersectionObserver(
      (entries) => {
        for (const entry of entries) entry.isIntersecting ? seen.add(entry.target.id) : seen.delete(entry.target.id);
        const first = [...links.keys()].find((id) => seen.has(id));
        for (const [id, link] of links) id === first ? link.setAttribute("aria-current", "true") : link.removeAttribute("aria-current");
      },
      { rootMargin: "-10% 0px -60% 0px" },
    );
    document.querySelectorAll("main > section").forEach((section) => spy.observe(section));
  }

  // ---- Tables: sorted by a column, filtered by a text.
  const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";
  const UNITS = { B: 1, KiB: 2 ** 10, MiB: 2 ** 20, GiB: 2 ** 30, TiB: 2 ** 40, "%": 0.01 };
  const textOf = (cell) => (cell ? [...cell.childNodes].filter((n) => n.nodeName !== "SMALL").map((n) => n.textContent).join("") : "").trim();
  // The number that a cell begins with, with its unit; null for a dash or a word.
  const valueOf = (text) => {
    const plain = text
      .replace(/[⁰¹²³⁴⁵⁶⁷⁸⁹]/g, (c) => RAISED.indexOf(c))
      .replace(/[−⁻]/g, "-")
      .replace(/^[<>≤≥~±]\s*/, "")
      .replace(/(\d),(?=\d{3})/g, "$1")
      .replace(/\s*[·×]\s*10(?=-?\d)/, "e");
    const found = /^([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)\s*(B|KiB|MiB|GiB|TiB|%)?(?![\w.-])/.exec(plain);
    return found ? Number(found[1]) * (UNITS[found[2]] ?? 1) : null;
  };
  const sortable = (table) => {
    const body = table.tBodies[0];
    const original = [...body.rows];
    if (original.length < 2) return;
    [...table.tHead.rows[0].cells].forEach((head, column) => {
      const label = head.textContent;
      head.textContent = "";
      head.append(
        button(label, () => {
          const before = head.getAttribute("aria-sort");
          for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
          const next = before === null ? "ascending" : before === "ascending" ? "descending" : null;
          if (next) head.setAttribute("aria-sort", next);
          body.append(...(next ? sorted(original, column, next === "descending" ? -1 : 1) : original));
        }),
      );
    });
  };
  const sorted = (rows, column, sign) => {
    const keyed = rows.map((row) => {
      const text = textOf(row.cells[column]);
      return { row, text, value: valueOf(text) };
    });
    const numeric = keyed.some((k) => k.value !== null) && keyed.filter((k) => k.value !== null).length * 2 >= keyed.filter((k) => /\d/.test(k.text)).length;
    keyed.sort((a, b) => {
      if (!numeric) return sign * a.text.localeCompare(b.text, "en", { numeric: true });
      // What has no number stands at the end, whichever way.
      if (a.value === null || b.value === null) return (a.value === null) - (b.value === null);
      return sign * (a.value - b.value);
    });
    return keyed.map((k) => k.row);
  };
  const filterable = (region) => {
    const rows = [...region.querySelectorAll("tbody tr")];
    if (rows.length < 9) return;
    const told = make("span", "", { role: "status" });
    const input = make("input", "", { type: "search", "aria-label": `Filter: ${region.getAttribute("aria-label")}`, placeholder: "filter rows" });
    const texts = rows.map((row) => row.textContent.toLowerCase());
    input.addEventListener("input", () => {
      const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
      let shown = 0;
      rows.forEach((row, i) => {
        row.hidden = !words.every((word) => texts[i].includes(word));
        shown += !row.hidden;
      });
      told.textContent = words.length ? `${shown} of ${rows.length} rows` : "";
    });
    const bar = make("div", "", { class: "filter" });
    bar.append(input, told);
    region.before(bar);
  };
  for (const region of document.querySelectorAll(".table")) {
    filterable(region);
    sortable(region.querySelector("table"));
  }

  // ---- Plots: the values of the nearest point.
  const tip = make("div", "", { id: "tip", hidden: "" });
  document.body.append(tip);
  const REACH = 40;
  for (const plot of document.querySelectorAll(".plot")) {
    const spots = [...plot.querySelectorAll(".spots circle")].map((circle) => {
      const text = circle.querySelector("title").textContent;
      circle.querySelector("title").remove();
      return { text, x: circle.cx.baseVal.value, y: circle.cy.baseVal.value };
    });
    if (!spots.length) continue;
    const svg = plot.querySelector("svg");
    plot.addEventListener("pointermove", (event) => {
      const box = svg.getBoundingClientRect();
      const scale = box.width / svg.viewBox.baseVal.width;
      const far = (s) => Math.hypot(box.left + s.x * scale - event.clientX, box.top + s.y * scale - event.clientY);
      const near = spots.reduce((best, s) => (far(s) < far(best) ? s : best));
      tip.hidden = far(near) > REACH;
      tip.textContent = near.text;
      tip.style.left = `${Math.min(event.clientX + 14, innerWidth - tip.offsetWidth - 6)}px`;
      tip.style.top = `${Math.max(4, event.clientY - tip.offsetHeight - 10)}px`;
    });
    plot.addEventListener("pointerleave", () => (tip.hidden = true));
  }

  // ---- Images of one scene, pixel by pixel.
  const half = (bits) => {
    const [sign, exponent, fraction] = [bits & 0x8000 ? -1 : 1, (bits >> 10) & 31, bits & 1023];
    if (exponent === 31) return fraction ? NaN : sign * Infinity;
    return sign * (exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : 2 ** -14 * (fraction / 1024));
  };
  const decode = (base64) => {
    const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
    return Float32Array.from({ length: bytes.length / 2 }, (_, i) => half(bytes[2 * i] | (bytes[2 * i + 1] << 8)));
  };
  const srgb = (v) => (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055);
  // The tone mapping of the pictures (Reinhard et al. 2002, equation 4, white at 4).
  const shown = ([r, g, b], exposure) => {
    if (![r, g, b].every(Number.isFinite)) return [255, 0, 255];
    const bright = Math.max(0, 0.212671 * r + 0.71516 * g + 0.072169 * b) * exposure;
    const scale = (exposure * (1 + bright / 16)) / (1 + bright);
    return [r, g, b].map((v) => Math.round(255 * Math.min(1, Math.max(0, srgb(Math.max(0, v * scale))))));
  };
  const VIRIDIS = ["440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725"].map((hex) =>
    [0, 2, 4].map((i) => parseInt(hex.slice(i, i + 2), 16)),
  );
  const viridis = (t) => {
    if (!Number.isFinite(t)) return [255, 0, 255];
    const at = Math.min(1, Math.max(0, t)) * 8;
    const low = Math.min(7, Math.floor(at));
    return [0, 1, 2].map((c) => Math.round(VIRIDIS[low][c] + (VIRIDIS[low + 1][c] - VIRIDIS[low][c]) * (at - low)));
  };
  const relative = (a, b) => Math.sqrt([0, 1, 2].reduce((sum, c) => sum + (b[c] - a[c]) ** 2 / (a[c] ** 2 + 0.01), 0) / 3);
  const digits = (v) => (Number.isFinite(v) ? v.toPrecision(4) : String(v)).replace("-", "−");

  const comparer = (box) => {
    const [width, height] = [Number(box.dataset.width), Number(box.dataset.height)];
    const layers = [...box.querySelectorAll(".layer")].map((layer) => ({ name: layer.dataset.name, base64: layer.dataset.radiance }));
    const pixels = (layer) => (layer.linear ??= decode(layer.base64));
    const at = (layer, x, y) => [...pixels(layer).subarray(3 * (y * width + x), 3 * (y * width + x) + 3)];
    const state = { mode: "swipe", a: 0, b: Math.min(1, layers.length - 1), stops: 0, split: 0.5, flipped: false, top: 1, zoom: "fit" };
    const views = make("div", "", { class: "views" });
    const values = make("p", "Point at a pixel for its values.", { class: "values", role: "status" });
    const canvases = [0, 1].map((i) => {
      const canvas = make("canvas", "", { role: "img" });
      [canvas.width, canvas.height] = [width, height];
      const figure = make("figure", "");
      const caption = make("figcaption", "");
      const stage = make("div", "", { class: "stage" });
      const line = make("div", "", { class: "edge", hidden: "" });
      stage.append(canvas, line);
      figure.append(stage, caption);
      views.append(figure);
      return { canvas, figure, caption, line };
    });
    const paint = (canvas, colour) => {
      const context = canvas.getContext("2d", { willReadFrequently: true });
      const image = context.createImageData(width, height);
      for (let y = 0; y < height; y++) {
        for (let x = 0; x < width; x++) image.data.set([...colour(x, y), 255], 4 * (y * width + x));
      }
      context.putImageData(image, 0, 0);
    };
    const draw = () => {
      const exposure = Number(box.dataset.exposure) * 2 ** state.stops;
      const [a, b] = [layers[state.a], layers[state.b]];
      const [left, right] = canvases;
      const single = state.flipped ? b : a;
      const edge = state.split * width;
      const of = (layer) => (x, y) => shown(at(layer, x, y), exposure);
      right.figure.hidden = state.mode !== "side";
      left.line.hidden = state.mode !== "swipe";
      left.line.style.left = `${100 * state.split}%`;
      if (state.mode === "swipe") paint(left.canvas, (x, y) => of(x + 0.5 < edge ? a : b)(x, y));
      if (state.mode === "side") paint(left.canvas, of(a)), paint(right.canvas, of(b));
      if (state.mode === "flip") paint(left.canvas, of(single));
      if (state.mode === "error") paint(left.canvas, (x, y) => viridis(relative(at(a, x, y), at(b, x, y)) / state.top));
      const captions = {
        swipe: `left: ${a.name}; right: ${b.name}`,
        side: a.name,
        flip: single.name,
        error: `error of ${b.name} relative to ${a.name}: √ mean (B − A)² / (A² + 0.01), from 0 (violet) to ${state.top} and more (yellow)`,
      };
      left.caption.textContent = captions[state.mode];
      right.caption.textContent = b.name;
      for (const { canvas, caption } of canvases) {
        canvas.setAttribute("aria-label", caption.textContent);
        canvas.style.width = state.zoom === "fit" ? `min(${Math.max(1, Math.floor(560 / width)) * width}px, 100vw - 3.5rem)` : `${Number(state.zoom) * width}px`;
        canvas.style.maxWidth = state.zoom === "fit" ? "" : "none";
      }
      views.style.overflowX = state.zoom === "fit" ? "" : "auto";
      modes.forEach((made) => made.setAttribute("aria-pressed", made.dataset.mode === state.mode));
      split.parentElement.hidden = state.mode !== "swipe";
      flip.hidden = state.mode !== "flip";
      top.parentElement.hidden = state.mode !== "error";
      exposureText.textContent = `${state.stops > 0 ? "+" : ""}${String(state.stops).replace("-", "−")} EV`;
    };
    const tell = (canvas, event) => {
      const rect = canvas.getBoundingClientRect();
      const x = Math.floor(((event.clientX - rect.left) / rect.width) * width);
      const y = Math.floor(((event.clientY - rect.top) / rect.height) * height);
      if (x < 0 || y < 0 || x >= width || y >= height) return;
      const [a, b] = [layers[state.a], layers[state.b]];
      const line = (mark, layer) => `${mark} ${at(layer, x, y).map(digits).join("  ")}  ${layer.name}`;
      const error = digits(relative(at(a, x, y), at(b, x, y)));
      values.textContent = `pixel ${x}, ${y} (linear red, green, blue)\n${line("A", a)}\n${line("B", b)}\nrelative error of B against A: ${error}`;
    };
    for (const { canvas } of canvases) {
      canvas.addEventListener("pointermove", (event) => {
        tell(canvas, event);
        if (state.mode === "swipe" && event.buttons) {
          const rect = canvas.getBoundingClientRect();
          state.split = Math.min(1, Math.max(0, (event.clientX - rect.left) / rect.width));
          split.value = state.split;
          draw();
        }
      });
      canvas.addEventListener("pointerdown", (event) => tell(canvas, event));
    }
    const choose = (label, key) => {
      const select = make("select", "");
      layers.forEach((layer, i) => select.append(make("option", layer.name, { value: i })));
      select.value = state[key];
      select.addEventListener("change", () => ((state[key] = Number(select.value)), draw()));
      const made = make("label", label);
      made.append(select);
      return made;
    };
    const range = (label, attributes, act) => {
      const input = make("input", "", { type: "range", ...attributes });
      input.addEventListener("input", () => (act(Number(input.value)), draw()));
      const made = make("label", label);
      made.append(input);
      return input;
    };
    const modes = Object.entries({ swipe: "Swipe", side: "Side by side", flip: "Flip", error: "Error map" }).map(([mode, label]) =>
      button(label, () => ((state.mode = mode), draw()), { "data-mode": mode }),
    );
    const split = range("divide", { min: 0, max: 1, step: 0.01, value: 0.5 }, (v) => (state.split = v));
    const flip = button("A ⇄ B (F)", () => ((state.flipped = !state.flipped), draw()));
    const exposure = range("exposure", { min: -8, max: 8, step: 0.5, value: 0 }, (v) => (state.stops = v));
    const exposureText = make("output", "0 EV");
    exposure.after(exposureText);
    const top = range("top of scale", { min: -3, max: 1, step: 0.25, value: 0 }, (v) => (state.top = Number((10 ** v).toPrecision(2))));
    const zoom = make("select", "");
    for (const [value, label] of [["fit", "fit"], ["1", "1×"], ["2", "2×"], ["4", "4×"], ["8", "8×"]]) zoom.append(make("option", label, { value }));
    zoom.addEventListener("change", () => ((state.zoom = zoom.value), draw()));
    const zoomed = make("label", "zoom");
    zoomed.append(zoom);
    const controls = make("div", "", { class: "controls", role: "group", "aria-label": "Compare images" });
    controls.append(...modes, choose("A", "a"), choose("B", "b"), flip, exposure.parentElement, split.parentElement, top.parentElement, zoomed);
    box.addEventListener("keydown", (event) => {
      if (event.target.tagName === "SELECT" || event.ctrlKey || event.metaKey || event.altKey) return;
      const steps = { e: 0.5, E: -0.5 };
      if (event.key === "f") (state.mode = "flip"), (state.flipped = !state.flipped);
      else if (event.key in steps) exposure.value = state.stops = Math.min(8, Math.max(-8, state.stops + steps[event.key]));
      else if (/^[1-9]$/.test(event.key) && layers[event.key - 1]) (state.mode = "flip"), (state.flipped = true), (state.b = event.key - 1);
      else return;
      draw();
    });
    box.append(controls, views, values);
    box.hidden = false;
    draw();
  };
  const wake = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (!entry.isIntersecting) continue;
      wake.unobserve(entry.target);
      comparer(entry.target.nextElementSibling);
    }
  });
  for (const box of document.querySelectorAll(".comparer")) {
    // What is hidden is never in view: the caption before it stands for it.
    const mark = make("span", "");
    box.before(mark);
    wake.observe(mark);
  }
})();
