// Runs inside a page of a report, and tells what it found as JSON: see browser.rs.
(async () => {
  const found = {};
  const wait = (ms) => new Promise((done) => setTimeout(done, ms));
  const tell = () => parent.postMessage(JSON.stringify(found), "*");
  try {
    const all = (selector) => [...document.querySelectorAll(selector)];
    const WANTED = window.WANTED;
    found.width = innerWidth;
    found.dark = matchMedia("(prefers-color-scheme: dark)").matches;
    found.overflow = document.documentElement.scrollWidth - innerWidth;
    all("details").forEach((fold) => (fold.open = true));
    await wait(50);
    found.overflowUnfolded = document.documentElement.scrollWidth - innerWidth;
    found.widest = all("main *").filter((e) => e.getBoundingClientRect().right > innerWidth + 1 && !e.closest(".table, .plot, pre, .views")).slice(0, 3).map((e) => e.outerHTML.slice(0, 120));
    // Nothing that a name brought in.
    found.hostile = [window.hacked ?? null, all("img:not([src^='data:'])").length, all("main script, main iframe, [onerror], [onload]").length];

    const cellsOf = (table, column) => [...table.tBodies[0].rows].map((row) => [...row.cells[column].childNodes].filter((n) => n.nodeName !== "SMALL").map((n) => n.textContent).join(""));
    const table = document.createElement("div");
    // Sorting, on the first table of the page's own kind that is named.
    const named = all("table").find((t) => (t.getAttribute("aria-label") ?? "").startsWith(WANTED.table));
    found.table = Boolean(named);
    if (named) {
      const head = named.tHead.rows[0].cells[WANTED.column].querySelector("button");
      found.before = cellsOf(named, WANTED.column);
      head.click();
      found.ascending = cellsOf(named, WANTED.column);
      found.sortSaid = named.tHead.rows[0].cells[WANTED.column].getAttribute("aria-sort");
      head.click();
      found.descending = cellsOf(named, WANTED.column);
      head.click();
      found.after = cellsOf(named, WANTED.column);
    }
    const input = document.querySelector(".filter input");
    found.filter = Boolean(input);
    if (input) {
      const rows = [...input.closest(".filter").nextElementSibling.querySelectorAll("tbody tr")];
      const word = rows[rows.length - 1].cells[0].textContent.trim().toLowerCase();
      input.value = word;
      input.dispatchEvent(new Event("input"));
      const shown = rows.filter((row) => !row.hidden);
      found.filtered = [shown.length, rows.length, shown.every((row) => row.textContent.toLowerCase().includes(word))];
      input.value = "";
      input.dispatchEvent(new Event("input"));
      found.unfiltered = rows.filter((row) => row.hidden).length;
    }

    // The comparer: every mode, values under the pointer.
    const box = document.querySelector(".comparer");
    found.comparer = Boolean(box);
    if (box) {
      box.scrollIntoView();
      (box.previousElementSibling ?? box).scrollIntoView();
      // It wakes when a frame shows it, and frames come late on a busy machine: each turn asks for one.
      for (let i = 0; i < 4000 && !box.querySelector("canvas"); i++) {
        scrollBy(0, i % 2 ? 1 : -1);
        await Promise.race([new Promise(requestAnimationFrame), wait(50)]);
      }
      const canvas = box.querySelector("canvas");
      found.asleep = !canvas;
      const press = (mode) => box.querySelector(`button[data-mode=${mode}]`).click();
      const pixel = (x, y, of = canvas) => [...of.getContext("2d").getImageData(x, y, 1, 1).data].slice(0, 3);
      const point = (type, x, y, buttons = 0) => {
        const rect = canvas.getBoundingClientRect();
        const at = { clientX: rect.left + ((x + 0.5) / canvas.width) * rect.width, clientY: rect.top + ((y + 0.5) / canvas.height) * rect.height, buttons, bubbles: true };
        canvas.dispatchEvent(new PointerEvent(type, at));
      };
      const [x, y] = WANTED.pixel;
      press("flip");
      found.flipA = pixel(x, y);
      [...box.querySelectorAll("button")].find((b) => b.textContent.includes("⇄")).click();
      found.flipB = pixel(x, y);
      press("side");
      const views = [...box.querySelectorAll("figure")].filter((f) => !f.hidden).map((f) => f.querySelector("canvas"));
      found.side = views.map((view) => pixel(x, y, view));
      press("swipe");
      point("pointermove", 1, y, 1);
      found.swipeLeft = pixel(x, y);
      point("pointermove", canvas.width - 1, y, 1);
      found.swipeRight = pixel(x, y);
      press("error");
      found.error = pixel(x, y);
      point("pointermove", x, y);
      found.values = box.querySelector(".values").textContent;
      const exposure = box.querySelector("input[min='-8']");
      press("flip");
      const before = pixel(x, y);
      exposure.value = 2;
      exposure.dispatchEvent(new Event("input"));
      found.brighter = pixel(x, y).map((v, i) => v - before[i]);
      found.canvasRight = canvas.getBoundingClientRect().right - innerWidth;
    }

    // Values of the points of plots.
    const plot = all(".plot").find((p) => p.querySelector(".spots circle"));
    found.plot = Boolean(plot);
    if (plot) {
      plot.scrollIntoView();
      const circle = plot.querySelector(".spots circle").getBoundingClientRect();
      plot.dispatchEvent(new PointerEvent("pointermove", { clientX: circle.left + circle.width / 2, clientY: circle.top + circle.height / 2, bubbles: true }));
      found.tip = document.getElementById("tip").textContent;
      found.tipHidden = document.getElementById("tip").hidden;
      plot.dispatchEvent(new PointerEvent("pointerleave"));
    }
    found.links = all("a[href^='#']").filter((a) => !document.getElementById(decodeURIComponent(a.getAttribute("href").slice(1)))).map((a) => a.getAttribute("href"));
    found.images = all("img").filter((img) => !img.alt).length;
    if (window.axe) {
      const ran = await axe.run(document, { resultTypes: ["violations"] });
      found.axe = ran.violations.filter((v) => ["serious", "critical"].includes(v.impact)).map((v) => `${v.id}: ${v.nodes.length} × ${v.nodes[0].html.slice(0, 160)} ${v.nodes[0].failureSummary?.slice(0, 200)}`);
      found.axeRules = ran.passes?.length ?? 0;
    }
    found.done = true;
  } catch (error) {
    found.thrown = `${error} ${error.stack}`;
  }
  tell();
})();
