/* The sections below the viewer, from metrics.json. */

class Sections {
  constructor(metrics, page, viewer) {
    Object.assign(this, {metrics, page, viewer});
    this.measures = new Measures(metrics);
    this.state = {capture: 0, pair: worstPair(metrics), stat: "mean"};
    this.hidden = new Set(); /* materials that the plots leave out */
    this.heldFrames = capture => new Set(viewer.held.filter(f => f.capture === capture).map(f => f.frame));
  }

  section(id, title, ...content) {
    return h("section", {id, "aria-labelledby": id + "-title"}, h("h2", {id: id + "-title"}, title), content);
  }

  all() {
    return [this.thresholds(), this.failures(), this.differences(), this.parameters(), this.graph(), this.energy(),
            this.cost(), this.files()].filter(Boolean);
  }

  /* A frame in the viewer; one that is not held: its files. */
  show(capture, frame, pair, metric) {
    const i = this.viewer.held.findIndex(f => f.capture === capture && f.frame === frame), p = this.metrics.pairs[pair];
    if (i < 0) {
      const row = this.openFiles(capture, frame);
      if (row) row.scrollIntoView({block: "center"});
      return;
    }
    const change = {frame: i};
    if (p) Object.assign(change, {a: p.reference === null ? -1 : p.reference, b: p.test});
    if (metric === "flip" || metric === "hdrflip") change.overlay = metric;
    this.viewer.set(change);
    this.viewer.root.scrollIntoView({block: "start"});
    this.viewer.canvas.focus({preventScroll: true});
    say(`frame ${frame} is shown`);
  }

  /* ---- thresholds, failures ---- */

  thresholds() {
    const list = this.metrics.thresholds || [], name = (many, i) => (many[i] || {}).name || "";
    const what = o => (this.metrics.pairs[o.pair] ? pairName(this.metrics, this.metrics.pairs[o.pair])
                                                  : [name(this.metrics.variants, o.variant), o.node].filter(Boolean).join(", "));
    const row = o => [name(this.metrics.captures, o.capture), what(o), this.frameButton(o.capture, o.frame, o.pair, `frame ${o.frame}`),
                      materialName(o.material), number(o.value, 4)];
    const rows = over => table("Values beyond the threshold", ["Capture", "What", "Frame", "Material", "#Value"], over.map(row));
    const verdict = t => {
      const over = t.over || [], bad = over.length > 0;
      const words = ` ${t.what} = ${t.limit}` + (bad ? `: ${plural(over.length, "value")} beyond it` : "");
      const more = over.length > 12 ? h("details", {}, h("summary", {}, `${over.length - 12} more`), rows(over.slice(12))) : null;
      return [h("p", {class: bad ? "verdict bad" : "verdict good"}, h("b", {}, bad ? "failed" : "passed"), words),
              bad ? rows(over.slice(0, 12)) : null, more];
    };
    return list.length ? this.section("thresholds", "Thresholds", list.map(verdict)) : null;
  }

  frameButton(capture, frame, pair, text) {
    return h("button", {type: "button", class: "link", onclick: () => this.show(capture, frame, pair)}, text);
  }

  failures() {
    const list = this.page.frames.filter(f => f.error);
    if (!list.length) return null;
    return this.section("failures", "Frames that failed", h("ul", {class: "plain"}, list.map(f =>
      h("li", {}, h("b", {}, `${(this.metrics.captures[f.capture] || {}).name || ""} frame ${f.frame}`), ": " + f.error))));
  }

  /* ---- differences ---- */

  differences() {
    if (!this.measures.list.length) return null;
    const m = this.metrics, st = this.state, change = c => { Object.assign(this.state, c); this.fill(); };
    const pairs = m.pairs.map((p, i) => ({value: i, label: pairName(m, p)}));
    const captures = m.captures.map((c, i) => ({value: i, label: c.name}));
    const pick = (label, id, options) => (options.length < 2 ? null
      : control(label, id, select({id}, options, st[id], v => change({[id]: Number(v)}))));
    this.box = h("div");
    this.fill();
    return this.section("differences", "Differences", h("div", {class: "controls"}, pick("Pair", "pair", pairs),
      pick("Capture", "capture", captures), segmented("Statistic over the pixels", STATS, st.stat, v => change({stat: v}))), this.box);
  }

  fill() {
    const st = this.state, color = i => (i === 0 ? "var(--ink)" : seriesColor(i - 1));
    const frames = this.measures.frames(st.capture, st.pair), materials = this.measures.materials(st.capture, st.pair);
    const names = this.measures.names.filter(x => st.stat === "mean" || x !== "psnr");
    const pair = this.metrics.pairs[st.pair], noisy = (this.metrics.null || []).length > 0;
    const words = (this.metrics.pairs.length === 1 ? pairName(this.metrics, pair) + ". " : "") +
      (frames.length > 1 ? "The mean over frames, and below it the worst frame. " : "") +
      (noisy ? this.chanceWords() : this.metrics.stochastic ? "No other seeds were compared: small differences may be chance." : "");
    this.box.replaceChildren(h("p", {class: "small"}, words),
      metricTable(this.measures, st, color, (...a) => this.show(...a)),
      frames.length > 1 ? this.lines(frames, materials, names, color) : "",
      materials.length > 1 ? this.byMaterial(materials, names, color) : "");
  }

  chanceWords() {
    const m = this.metrics, rate = m.false_positives;
    return `A dot marks a mean beyond chance: beyond all that other seeds of ${m.variants[0].name} make` +
      (m.seeds ? ` (${m.seeds} seeds)` : "") + "." +
      (rate > 0 ? ` Without a cause, a material and metric gets one in at most 1 of ${Math.round(1 / rate)} runs.` : "");
  }

  lines(frames, materials, names, color) {
    const st = this.state, held = this.heldFrames(st.capture), plots = h("div", {class: "multiples"});
    const legend = h("div", {class: "legend", role: "group", "aria-label": "Materials in the plots"});
    const chance = h("span");
    const draw = () => {
      const seen = materials.filter(m => !this.hidden.has(m)), main = seen.includes(null) || seen.length !== 1 ? null : seen[0];
      chance.textContent = `what chance makes, ${materialName(main)}`;
      plots.replaceChildren(...names.map(metric => new LinePlot({metric, frames, held,
        pick: f => this.show(st.capture, f, st.pair, metric),
        series: materials.map((m, i) => this.series(m, metric, color(i), m === main)).filter(x => seen.includes(x.m)).reverse()}).element));
    };
    materials.forEach((m, i) => {
      const button = h("button", {type: "button", "aria-pressed": String(!this.hidden.has(m)), onclick: () => {
        if (!this.hidden.delete(m)) this.hidden.add(m);
        button.setAttribute("aria-pressed", String(!this.hidden.has(m)));
        draw();
      }}, h("i", {class: "swatch", style: {background: color(i)}}), materialName(m));
      legend.append(button);
    });
    if ((this.metrics.null || []).length) legend.append(h("span", {class: "small"}, h("i", {class: "key chance"}), chance));
    draw();
    return h("div", {}, h("h3", {}, "Over frames"), legend, plots);
  }

  series(m, metric, color, main) {
    const st = this.state, rows = this.measures.rows(st.capture, st.pair, m, metric);
    return {m, name: materialName(m), color, main, bound: this.measures.bound(st.capture, m, metric, st.stat),
            values: new Map(rows.map(r => [r.frame, r[st.stat]]))};
  }

  byMaterial(materials, names, color) {
    const st = this.state, noisy = (this.metrics.null || []).length > 0;
    const row = (metric, m, i) => {
      const o = this.measures.over(st.capture, st.pair, m, metric, st.stat);
      return {name: materialName(m), color: color(i), value: o.mean, beyond: o.beyond > 0,
              bound: this.measures.bound(st.capture, m, metric, st.stat)};
    };
    return h("div", {}, h("h3", {}, "By material"),
      noisy ? h("p", {class: "small"}, h("i", {class: "key limit-key"}), "what chance makes, that material") : null,
      h("div", {class: "multiples"}, names.map(metric => barPlot(metric, materials.map((m, i) => row(metric, m, i))))));
  }

  /* ---- parameters, graph ---- */

  parameters() {
    const list = this.metrics.parameters || [], names = this.metrics.variants.map(v => v.name);
    const value = (v, first) => (v === null ? h("span", {class: "none"}, "not set") : h("code", {class: v === first ? null : "changed"}, v));
    return !list.length ? null : this.section("parameters", "Parameters", h("p", {class: "small"}, "What is not the same in all variants."),
      table("Parameters", ["Path", ...names], list.map(p => [h("code", {}, p.path), ...p.values.map(v => value(v, p.values[0]))]),
            {class: "parameters"}));
  }

  graph() {
    const list = this.metrics.graph || [], name = g => (this.metrics.captures[g.capture] || {}).name;
    const title = g => (list.length > 1 ? h("h3", {}, [name(g), g.reason].filter(Boolean).join(": ")) : null);
    return !list.length ? null : this.section("graph", "Graph",
      h("p", {class: "small"}, "All variants in one graph: what they share runs once."),
      list.map(g => [title(g), new GraphView(g, this.metrics).element]));
  }

  /* ---- energy ---- */

  /* Means over frames a pixel; a table a variant. */
  energy() {
    const list = this.metrics.energy || [], variants = [...new Set(list.map(r => r.variant))];
    if (!list.length) return null;
    const box = h("div"), draw = v => box.replaceChildren(this.energyTable(list.filter(r => r.variant === v)));
    const options = variants.map(v => ({value: v, label: (this.metrics.variants[v] || {}).name}));
    const pick = select({id: "energy-variant"}, options, variants[0], v => draw(Number(v)));
    draw(variants[0]);
    return this.section("energy", "Energy",
      variants.length > 1 ? h("div", {class: "controls"}, control("Variant", "energy-variant", pick)) : null,
      h("div", {}, h("p", {class: "small"}, "What passes take in and give out a pixel: the mean of red, green and blue, " +
                     (new Set(list.map(r => r.frame)).size > 1 ? "and of the frames" : "in frame " + list[0].frame) +
                     ". The rest are shares of what came in."), box));
  }

  energyTable(list) {
    const parts = Object.entries({border: "#At borders", off_screen: "#Off screen", clamped: "#Clamped", redistributed: "#Given back"})
      .filter(([k]) => list.some(r => r[k]));
    const mean = v => (v ? (v[0] + v[1] + v[2]) / 3 : 0), groups = new Map(), many = this.metrics.captures.length > 1;
    for (const r of list) {
      const key = JSON.stringify([r.capture, r.node, r.material]), g = groups.get(key) || {...r, pixels: 0, sums: {}};
      groups.set(key, g);
      g.pixels += r.pixels || 1;
      for (const k of ["in", "out", ...parts.map(p => p[0])]) g.sums[k] = (g.sums[k] || 0) + mean(r[k]);
    }
    const share = (g, v) => (g.sums.in > 0 ? fixed(100 * v / g.sums.in, 2) + THIN + "%" : NONE);
    let before = "";
    const rows = [...groups.values()].map(g => {
      const name = (many ? (this.metrics.captures[g.capture] || {}).name + " " : "") + g.node, again = name === before;
      before = name;
      return [again ? h("span", {class: "hidden"}, name) : [name, h("small", {}, " " + (g.pass || ""))], materialName(g.material),
              number(g.sums.in / g.pixels), number(g.sums.out / g.pixels), share(g, g.sums.out - g.sums.in),
              ...parts.map(([k]) => share(g, g.sums[k]))];
    });
    return table("Energy", ["Node", "Material", "#In", "#Out", "#Out \u2212 in", ...parts.map(p => p[1])], rows);
  }

  /* ---- cost ---- */

  cost() {
    const c = this.metrics.cost;
    return c ? this.section("cost", "Cost", h("p", {}, this.costWords(c)),
      h("div", {class: "multiples"}, this.costBars(c), this.nodeBars())) : null;
  }

  costWords(c) {
    const n = c.variants || this.metrics.variants.length, extra = n - this.metrics.variants.length;
    const predicted = typeof c.predicted === "number" ? `, predicted ${fixed(c.predicted, 2)}\u00d7` : "";
    return `${plural(n, "variant")} = ${fixed(c.factor, 2)}\u00d7 one (${c.measured ? "measured" : "predicted"}${predicted})` +
      (c.frames ? `; ${plural(c.frames, "frame")}` : "") + (typeof c.seconds === "number" ? ` in ${number(c.seconds)}\u00a0s` : "") +
      "." + (extra > 0 ? ` ${extra} of them are for chance alone.` : "");
  }

  costBars(c) {
    const n = c.variants || this.metrics.variants.length;
    const list = [["one variant", 1], [`these ${n}, together`, c.factor, "main"], [`these ${n}, one after the other`, c.sum]]
      .filter(b => typeof b[1] === "number"), most = Math.max(...list.map(b => b[1]));
    return bars("Against one variant", "", list.map(b => ({name: b[0], share: b[1] / most, class: b[2], value: fixed(b[1], 2) + "\u00d7"})));
  }

  nodeBars() {
    const nodes = (this.metrics.graph || []).flatMap(g => g.nodes).filter(x => typeof x.ms === "number").sort((a, b) => b.ms - a.ms);
    const total = nodes.reduce((t, x) => t + x.ms, 0);
    return nodes.length ? bars("Nodes", `${number(total)} ms a frame`, nodes.slice(0, 12).map(x => ({
      name: x.name, title: x.pass, share: x.ms / nodes[0].ms, class: x.varied ? "main" : "",
      value: [number(x.ms), h("small", {}, " ms")]}))) : null;
  }

  /* ---- files ---- */

  /* Rows are made when somebody looks: there can be thousands. */
  files() {
    this.written = this.page.frames.filter(f => f.files && f.files.some(x => x.length));
    if (!this.written.length) return null;
    this.fileRows = new Map();
    this.fileTable = h("div");
    this.details = h("details", {ontoggle: () => this.listFiles()},
      h("summary", {}, `${plural(this.written.length, "frame")}, as written`), this.fileTable);
    return this.section("files", "Images", this.details);
  }

  listFiles() {
    if (this.fileRows.size) return;
    const several = this.metrics.captures.length > 1, name = f => (several ? (this.metrics.captures[f.capture] || {}).name + " " : "") + f.frame;
    const links = list => list.map(p => [h("a", {href: pathUrl(p)}, p.split("/").pop()), " "]);
    const view = f => (this.viewer.held.includes(f) ? this.frameButton(f.capture, f.frame, undefined, "view") : "");
    const rows = this.written.map(f => ({tabindex: -1, cells: [name(f), view(f), ...f.files.map(links)]}));
    this.fileTable.replaceChildren(table("Images", ["Frame", "", ...this.metrics.variants.map(v => v.name)], rows, {class: "files"}));
    [...this.fileTable.querySelectorAll("tbody tr")].forEach((row, i) =>
      this.fileRows.set(`${this.written[i].capture} ${this.written[i].frame}`, row));
  }

  /* The row of a frame, or nothing. */
  openFiles(capture, frame) {
    if (!this.details) return null;
    this.details.open = true;
    this.listFiles();
    return this.fileRows.get(`${capture} ${frame}`);
  }
}
