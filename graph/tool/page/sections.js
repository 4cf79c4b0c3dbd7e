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
    const list = [this.thresholds(), this.failures(), this.differences(), this.parameters(), this.graph(), this.energy(), this.cost(), this.files()];
    return list.filter(Boolean);
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
    const list = this.metrics.thresholds || [];
    if (!list.length) return null;
    const where = o => {
      const capture = this.metrics.captures[o.capture], pair = this.metrics.pairs[o.pair];
      return h("tr", {}, h("td", {}, capture ? capture.name : ""), h("td", {}, pair ? pairName(this.metrics, pair) : [(this.metrics.variants[o.variant] || {}).name, o.node].filter(Boolean).join(", ")),
        h("td", {}, h("button", {type: "button", class: "link", onclick: () => this.show(o.capture, o.frame, o.pair)}, `frame ${o.frame}`)),
        h("td", {}, materialName(o.material)), h("td", {class: "num"}, number(o.value, 4)));
    };
    return this.section("thresholds", "Thresholds", list.map(t => {
      const over = t.over || [], head = h("p", {class: over.length ? "verdict bad" : "verdict good"},
        h("b", {}, over.length ? "failed" : "passed"), ` ${t.what} = ${number(t.limit, 4)}` + (over.length ? `: ${plural(over.length, "value")} beyond it` : ""));
      if (!over.length) return head;
      const table = rows => h("div", {class: "scroll"}, h("table", {}, h("thead", {}, h("tr", {}, ["Capture", "What", "Frame", "Material", "Value"].map(x =>
        h("th", {scope: "col", class: x === "Value" ? "num" : null}, x)))), h("tbody", {}, rows.map(where))));
      return [head, table(over.slice(0, 12)), over.length > 12 ? h("details", {}, h("summary", {}, `${over.length - 12} more`), table(over.slice(12))) : null];
    }));
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
    const control = (label, id, element) => h("div", {class: "control"}, h("label", {for: id}, label), element);
    this.box = h("div");
    const bar = h("div", {class: "controls"},
      m.pairs.length > 1 ? control("Pair", "pair", select({id: "pair"}, m.pairs.map((p, i) => ({value: i, label: pairName(m, p)})), st.pair, v => change({pair: Number(v)}))) : null,
      m.captures.length > 1 ? control("Capture", "capture", select({id: "capture"}, m.captures.map((c, i) => ({value: i, label: c.name})), st.capture, v => change({capture: Number(v)}))) : null,
      segmented("Statistic over the pixels", STATS, st.stat, v => change({stat: v})));
    this.fill();
    return this.section("differences", "Differences", bar, this.box);
  }

  fill() {
    const st = this.state, color = i => (i === 0 ? "var(--ink)" : seriesColor(i - 1));
    const frames = this.measures.frames(st.capture, st.pair), materials = this.measures.materials(st.capture, st.pair);
    const names = this.measures.names.filter(x => st.stat === "mean" || x !== "psnr");
    const pair = this.metrics.pairs[st.pair], noisy = (this.metrics.null || []).length > 0;
    const words = (this.metrics.pairs.length === 1 ? pairName(this.metrics, pair) + ". " : "") +
      (frames.length > 1 ? "The mean over frames, and below it the worst frame. " : "") +
      (noisy ? this.chanceWords() : this.metrics.stochastic ? "Some pass is stochastic, and no seeds were compared: small differences may be chance." : "");
    this.box.replaceChildren(h("p", {class: "small"}, words),
      metricTable(this.measures, st, color, (...a) => this.show(...a)),
      frames.length > 1 ? this.lines(frames, materials, names, color) : "", materials.length > 1 ? this.bars(materials, names, color) : "");
  }

  chanceWords() {
    const m = this.metrics, rate = m.false_positives;
    return `A dot marks a mean beyond chance: beyond all that other seeds of ${m.variants[0].name} make` + (m.seeds ? ` (${m.seeds} seeds)` : "") + "." +
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
        series: materials.map((m, i) => ({m, name: materialName(m), color: color(i), main: m === main, bound: this.measures.bound(st.capture, m, metric, st.stat),
          values: new Map(this.measures.rows(st.capture, st.pair, m, metric).map(r => [r.frame, r[st.stat]]))}))
          .filter(x => seen.includes(x.m)).reverse()}).element));
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

  bars(materials, names, color) {
    const st = this.state;
    const noisy = (this.metrics.null || []).length > 0;
    return h("div", {}, h("h3", {}, "By material"), noisy ? h("p", {class: "small"}, h("i", {class: "key limit-key"}), "what chance makes, that material") : null, h("div", {class: "multiples"}, names.map(metric => barPlot(metric, materials.map((m, i) => {
      const o = this.measures.over(st.capture, st.pair, m, metric, st.stat);
      return {name: materialName(m), color: color(i), value: o.mean, bound: this.measures.bound(st.capture, m, metric, st.stat), beyond: o.beyond > 0};
    })))));
  }

  /* ---- parameters, graph ---- */

  parameters() {
    const list = this.metrics.parameters || [], variants = this.metrics.variants || [];
    if (!list.length) return null;
    return this.section("parameters", "Parameters", h("p", {class: "small"}, "What is not the same in all variants."),
      h("div", {class: "scroll", tabindex: 0, role: "region", "aria-label": "Table of the parameters"}, h("table", {class: "parameters"},
        h("thead", {}, h("tr", {}, h("th", {scope: "col"}, "Path"), variants.map(v => h("th", {scope: "col"}, v.name)))),
        h("tbody", {}, list.map(p => h("tr", {}, h("th", {scope: "row"}, h("code", {}, p.path)), p.values.map(v =>
          h("td", {class: v === p.values[0] ? null : "changed"}, v === null ? h("span", {class: "none"}, "not set") : h("code", {}, v)))))))));
  }

  graph() {
    const list = this.metrics.graph || [];
    if (!list.length) return null;
    const many = list.length > 1;
    return this.section("graph", "Graph", h("p", {class: "small"}, "All variants in one graph: what they share runs once."), list.map(g => [
      many ? h("h3", {}, [(this.metrics.captures[g.capture] || {}).name, g.reason].filter(Boolean).join(": ")) : null,
      new GraphView(g, this.metrics).element]));
  }

  /* ---- energy ---- */

  /* Means over frames a pixel; a table a variant. */
  energy() {
    const list = this.metrics.energy || [], variants = [...new Set(list.map(r => r.variant))];
    if (!list.length) return null;
    const box = h("div", {class: "scroll", tabindex: 0, role: "region", "aria-label": "Table of the energy"});
    const draw = v => box.replaceChildren(this.energyTable(list.filter(r => r.variant === v)));
    draw(variants[0]);
    const bar = variants.length > 1 ? h("div", {class: "controls"}, h("div", {class: "control"}, h("label", {for: "energy-variant"}, "Variant"),
      select({id: "energy-variant"}, variants.map(v => ({value: v, label: (this.metrics.variants[v] || {}).name})), variants[0], v => draw(Number(v))))) : null;
    return this.section("energy", "Energy", bar, h("div", {}, h("p", {class: "small"},
      "What passes take in and give out a pixel: the mean of red, green and blue, and of the frames. The rest are shares of what came in."), box));
  }

  energyTable(list) {
    const parts = [["border", "At borders"], ["off_screen", "Off screen"], ["clamped", "Clamped"], ["redistributed", "Redistributed"]].filter(([k]) => list.some(r => r[k]));
    const mean = v => (v ? (v[0] + v[1] + v[2]) / 3 : 0), groups = new Map(), many = this.metrics.captures.length > 1;
    for (const r of list) {
      const key = JSON.stringify([r.capture, r.node, r.material]), g = groups.get(key) || {...r, pixels: 0, sums: {}};
      groups.set(key, g);
      g.pixels += r.pixels || 1;
      for (const k of ["in", "out", ...parts.map(p => p[0])]) g.sums[k] = (g.sums[k] || 0) + mean(r[k]);
    }
    const share = (g, v) => (g.sums.in > 0 ? fixed(100 * v / g.sums.in, 2) + THIN + "%" : NONE), num = v => h("td", {class: "num"}, v);
    const head = [...(many ? ["Capture"] : []), "Node", "Material", "In", "Out", "Out \u2212 in", ...parts.map(p => p[1])];
    let before = "";
    return h("table", {}, h("thead", {}, h("tr", {}, head.map((x, i) => h("th", {scope: "col", class: i > (many ? 2 : 1) ? "num" : null}, x)))),
      h("tbody", {}, [...groups.values()].map(g => {
        const name = `${g.capture} ${g.node}`, first = name !== before;
        before = name;
        return h("tr", {class: g.material === null ? "whole" : null}, many ? h("td", {}, first ? (this.metrics.captures[g.capture] || {}).name : "") : null,
          h("th", {scope: "row"}, first ? [g.node, h("small", {}, " " + (g.pass || ""))] : h("span", {class: "hidden"}, g.node)), h("td", {}, materialName(g.material)),
          num(number(g.sums.in / g.pixels)), num(number(g.sums.out / g.pixels)), num(share(g, g.sums.out - g.sums.in)), parts.map(([k]) => num(share(g, g.sums[k]))));
      })));
  }

  /* ---- cost ---- */

  cost() {
    const c = this.metrics.cost;
    if (!c) return null;
    const n = c.variants || this.metrics.variants.length, bars = [["one variant", 1, ""], [`these ${n}, together`, c.factor, "main"], [`these ${n}, one after the other`, c.sum, ""]]
      .filter(b => typeof b[1] === "number"), most = Math.max(...bars.map(b => b[1]));
    const extra = n - this.metrics.variants.length;
    const predicted = typeof c.predicted === "number" ? `, predicted ${fixed(c.predicted, 2)}\u00d7` : "";
    const nodes = (this.metrics.graph || []).flatMap(g => g.nodes).filter(x => typeof x.ms === "number").sort((a, b) => b.ms - a.ms), total = nodes.reduce((t, x) => t + x.ms, 0);
    return this.section("cost", "Cost",
      h("p", {}, `${plural(n, "variant")} = ${fixed(c.factor, 2)}\u00d7 one (${c.measured ? "measured" : "predicted"}${predicted})` +
        (c.frames ? `; ${plural(c.frames, "frame")}` : "") + (typeof c.seconds === "number" ? ` in ${number(c.seconds)}\u00a0s` : "") + "." +
        (extra > 0 ? ` ${extra} of them are for chance alone.` : "")),
      h("div", {class: "multiples"}, h("figure", {class: "multiple bars"}, h("figcaption", {}, "Against one variant"), h("dl", {}, bars.map(([name, v, cls]) => [
        h("dt", {}, name), h("dd", {}, h("span", {class: "track"}, h("span", {class: "fill " + cls, style: {width: v / most * 100 + "%"}})), h("span", {class: "value"}, fixed(v, 2) + "\u00d7"))]))),
      nodes.length ? h("figure", {class: "multiple bars"}, h("figcaption", {}, "Nodes", h("small", {}, ` ${number(total)} ms a frame`)), h("dl", {}, nodes.slice(0, 12).map(x => [
        h("dt", {title: x.pass}, x.name), h("dd", {}, h("span", {class: "track"}, h("span", {class: "fill" + (x.varied ? " main" : ""), style: {width: x.ms / nodes[0].ms * 100 + "%"}})),
          h("span", {class: "value"}, number(x.ms), h("small", {}, " ms")))]))) : null));
  }

  /* ---- files ---- */

  files() {
    const frames = this.page.frames.filter(f => f.files && f.files.some(x => x.length));
    if (!frames.length) return null;
    this.fileRows = new Map();
    const body = h("tbody"), build = () => {
      if (body.childElementCount) return;
      for (const f of frames) {
        const i = this.viewer.held.indexOf(f), row = h("tr", {tabindex: -1},
          h("th", {scope: "row"}, (this.metrics.captures.length > 1 ? (this.metrics.captures[f.capture] || {}).name + " " : "") + f.frame),
          h("td", {}, i < 0 ? "" : h("button", {type: "button", class: "link", onclick: () => this.show(f.capture, f.frame)}, "view")),
          f.files.map(list => h("td", {}, list.map(p => [h("a", {href: pathUrl(p)}, p.split("/").pop()), " "]))));
        this.fileRows.set(`${f.capture} ${f.frame}`, row);
        body.append(row);
      }
    };
    this.details = h("details", {ontoggle: build}, h("summary", {}, `${plural(frames.length, "frame")}, as written`),
      h("div", {class: "scroll"}, h("table", {class: "files"}, h("thead", {}, h("tr", {}, h("th", {scope: "col"}, "Frame"), h("td"),
        this.metrics.variants.map(v => h("th", {scope: "col"}, v.name)))), body)));
    this.openFiles = (capture, frame) => { this.details.open = true; build(); return this.fileRows.get(`${capture} ${frame}`); };
    return this.section("files", "Images", this.details);
  }

  openFiles() { return null; }
}
