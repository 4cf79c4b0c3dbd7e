/* Puts the page together. */

function openHelp() {
  const dialog = byId("help");
  if (!dialog.childElementCount)
    dialog.append(h("h2", {id: "help-title"}, "Keyboard"),
      h("dl", {class: "keys"}, KEYS.map(([keys, what]) => [h("dt", {}, keys.map(k => h("kbd", {}, k))), h("dd", {}, what)])),
      h("form", {method: "dialog"}, h("button", {autofocus: true}, "Close")));
  dialog.showModal();
}

function facts(metrics, page) {
  const captures = metrics.captures || [], over = (metrics.thresholds || []).reduce((n, t) => n + (t.over || []).length, 0);
  const failed = page.frames.filter(f => f.error).length, cost = metrics.cost, list = [];
  for (const c of captures) list.push(`${c.name}: ${plural((c.frames || []).length, "frame")}, ${c.width}\u00d7${c.height}`);
  list.push(plural((metrics.variants || []).length, "variant"));
  const seeds = cost ? cost.variants - (metrics.variants || []).length : 0; /* variants with other seeds cost too */
  if (cost && typeof cost.factor === "number")
    list.push(`${fixed(cost.factor, 2)}\u00d7 the cost of one` + (seeds > 0 ? `, with ${seeds} more seeds` : ""));
  const items = list.map(x => h("li", {}, x));
  if ((metrics.thresholds || []).length) items.push(h("li", {class: over ? "bad" : "good"}, over ? "thresholds exceeded" : "within thresholds"));
  if (failed) items.push(h("li", {class: "bad"}, `${plural(failed, "frame")} failed`));
  byId("facts").append(...items);
}

(function start() {
  const metrics = JSON.parse(byId("metrics").textContent), page = JSON.parse(byId("page").textContent);
  for (const key of ["variants", "pairs", "captures", "metrics"]) metrics[key] ||= [];
  byId("help-open").addEventListener("click", openHelp);
  byId("theme").addEventListener("click", switchTheme);
  facts(metrics, page);
  const viewer = new Viewer(byId("viewer"), metrics, page);
  const sections = new Sections(metrics, page, viewer).all();
  byId("sections").append(...sections);
  byId("nav").append(...[{id: "viewer", title: "Viewer"}, ...sections.map(x => ({id: x.id, title: x.querySelector("h2").textContent}))]
    .map(x => h("a", {href: "#" + x.id}, x.title)));
  byId("footer").append(h("p", {class: "small"}, h("code", {}, metrics.command || ""), h("br"),
    `relit ${metrics.relit || ""}` + (metrics.images ? `; compared: ${metrics.images.linear}; ${metrics.images.display}` : "")));
})();
