/* The merged graph, drawn in layers: nodes behind what they read. */

const NODE = {height: 46, gap: 18, layer: 74};

class GraphView {
  constructor(graph, metrics) {
    this.graph = graph;
    this.metrics = metrics;
    this.detail = h("div", {class: "detail", "aria-live": "polite"});
    this.canvas = h("div", {class: "scroll graphbox"});
    this.element = h("div", {class: "graph"}, this.canvas, this.detail);
    this.prepare();
    this.describe(null);
    let wide = null;
    new ResizeObserver(() => {
      const now = this.canvas.clientWidth >= 640;
      if (now !== wide) { wide = now; this.draw(wide); }
    }).observe(this.canvas);
  }

  /* Nodes, "capture" among them, each behind all that it reads; history makes no order. */
  prepare() {
    const g = this.graph, names = new Map();
    this.nodes = [{name: "capture", capture: true}, ...g.nodes].map((n, i) => ({...n, i, layer: 0, into: [], from: []}));
    for (const n of this.nodes) names.set(n.name, n);
    this.edges = new Map();
    for (const e of g.edges || []) {
      const from = names.get(e.from), to = names.get(e.to);
      if (!from || !to) continue;
      const key = `${from.i} ${to.i} ${!!e.history}`;
      if (!this.edges.has(key)) this.edges.set(key, {from, to, history: !!e.history, list: []});
      this.edges.get(key).list.push(e);
    }
    this.edges = [...this.edges.values()];
    for (const e of this.edges) if (!e.history && e.from !== e.to) { e.from.into.push(e.to); e.to.from.push(e.from); }
    for (let round = 0, moved = true; moved && round < this.nodes.length; round++) {
      moved = false;
      for (const n of this.nodes)
        for (const f of n.from) if (n.layer <= f.layer) { n.layer = f.layer + 1; moved = true; }
    }
    this.total = Math.max(...this.nodes.map(n => n.ms || 0), 0);
    this.layers = [];
    for (const n of this.nodes) (this.layers[n.layer] ||= []).push(n);
    this.layers = this.layers.filter(Boolean);
    this.order();
  }

  /* Each layer sorted by the mean place of its neighbours, forwards and back, a few times. */
  order() {
    const place = () => this.layers.forEach(l => l.forEach((n, i) => { n.place = i - (l.length - 1) / 2; }));
    const mean = (list, n) => (list.length ? list.reduce((t, x) => t + x.place, 0) / list.length : n.place);
    place();
    for (let round = 0; round < 8; round++) {
      const forward = round % 2 === 0;
      for (const l of forward ? this.layers : [...this.layers].reverse()) {
        l.sort((a, b) => mean(forward ? a.from : a.into, a) - mean(forward ? b.from : b.into, b) || a.i - b.i);
        place();
      }
    }
  }

  width(n) {
    const ms = typeof n.ms === "number" ? 5 : 0;
    return Math.max(104, 26 + 7.6 * Math.max(n.name.length + ms, (n.pass || "").length * 0.88));
  }

  /* Left to right where there is room, else from the top down. */
  draw(wide) {
    const most = Math.max(...this.nodes.map(n => this.width(n))), across = wide ? NODE.height + NODE.gap : most + 14;
    const along = wide ? null : NODE.height + 40, lengths = this.layers.map(l => Math.max(...l.map(n => this.width(n))));
    const breadth = Math.max(...this.layers.map(l => l.length)) * across;
    let at = 14;
    this.layers.forEach((l, k) => {
      l.forEach((n, i) => {
        n.w = this.width(n);
        const side = (i - (l.length - 1) / 2) * across + breadth / 2;
        [n.x, n.y] = wide ? [at, 14 + side - NODE.height / 2] : [14 + side - n.w / 2, at];
      });
      at += wide ? lengths[k] + NODE.layer : along;
    });
    const [w, height] = wide ? [at - NODE.layer + 14, breadth + 34] : [breadth + 28, at - along + NODE.height + 20];
    this.svg = s("svg", {width: w, height, viewBox: `0 0 ${w} ${height}`, class: "graphsvg", role: "group",
                         "aria-label": "Graph: nodes and what they read"},
      s("defs", {}, s("marker", {id: "arrow", viewBox: "0 0 8 8", refX: 7, refY: 4, markerWidth: 7, markerHeight: 7, orient: "auto"},
                      s("path", {d: "M0 0.8L7.4 4L0 7.2z"}))),
      this.edges.map(e => (e.element = this.edge(e, wide))), this.nodes.map(n => (n.element = this.node(n))));
    this.canvas.replaceChildren(this.svg);
  }

  edge(e, wide) {
    const {from: a, to: b} = e, r = v => v.toFixed(1);
    let d;
    if (e.history) {
      const x1 = a.x + a.w * (wide ? 0.65 : 1), x2 = b.x + b.w * (wide ? 0.35 : 1), low = NODE.height, deep = low + 24;
      d = wide ? `M${r(x1)} ${r(a.y + low)}C${r(x1)} ${r(a.y + deep)} ${r(x2)} ${r(b.y + deep)} ${r(x2)} ${r(b.y + low)}`
               : `M${r(x1)} ${r(a.y + 32)}C${r(x1 + 22)} ${r(a.y + 40)} ${r(x2 + 22)} ${r(b.y + 6)} ${r(x2)} ${r(b.y + 14)}`;
    } else if (wide) {
      const x1 = a.x + a.w, y1 = a.y + NODE.height / 2, x2 = b.x - 1, y2 = b.y + NODE.height / 2, k = Math.max((x2 - x1) * 0.45, 20);
      d = `M${r(x1)} ${r(y1)}C${r(x1 + k)} ${r(y1)} ${r(x2 - k)} ${r(y2)} ${r(x2)} ${r(y2)}`;
    } else {
      const x1 = a.x + a.w / 2, y1 = a.y + NODE.height, x2 = b.x + b.w / 2, y2 = b.y - 1, k = (y2 - y1) * 0.45;
      d = `M${r(x1)} ${r(y1)}C${r(x1)} ${r(y1 + k)} ${r(x2)} ${r(y2 - k)} ${r(x2)} ${r(y2)}`;
    }
    return s("path", {d, class: "edge" + (e.history ? " history" : "") + (a.capture ? " source" : ""), "marker-end": "url(#arrow)"},
             s("title", {}, e.list.map(x => `${x.image} \u2192 ${x.to}.${x.port}`).join("\n")));
  }

  node(n) {
    const show = () => this.describe(n), shares = n.ms && this.total ? n.ms / this.total : 0;
    return s("g", {class: "node" + (n.varied ? " varied" : "") + (n.capture ? " capture" : ""), tabindex: 0, role: "img",
                   transform: `translate(${n.x.toFixed(1)} ${n.y.toFixed(1)})`, "aria-label": this.text(n),
                   onpointerenter: show, onfocus: show, onpointerleave: () => this.describe(this.focused()), onblur: () => this.describe(null)},
      s("rect", {width: n.w, height: NODE.height, rx: 7}),
      shares ? s("rect", {class: "cost", x: 8, y: NODE.height - 6, height: 2.5, rx: 1.25, width: Math.max((n.w - 16) * shares, 1)}) : null,
      s("text", {x: 12, y: 20, class: "name"}, n.name),
      s("text", {x: 12, y: 35, class: "pass"}, n.capture ? "recorded layers" : n.pass),
      n.ms !== null && n.ms !== undefined ? s("text", {x: n.w - 10, y: 20, class: "ms"}, number(n.ms, 2)) : null);
  }

  focused() { return this.nodes.find(n => n.element === document.activeElement) || null; }

  users(n) {
    const all = (this.metrics.variants || []).length;
    if (!n.variants) return "";
    return n.variants.length >= all ? "all variants" : n.variants.map(i => this.metrics.variants[i].name).join(", ");
  }

  text(n) {
    if (n.capture) return "capture: the recorded layers";
    return `${n.name}, ${n.pass}, ${this.users(n)}${n.varied ? ", varied" : ""}` + (n.ms ? `, ${number(n.ms)} milliseconds a frame` : "");
  }

  /* Beside the drawing: a node's inputs and cost; its edges stand out. */
  describe(n) {
    for (const e of this.edges || []) if (e.element) e.element.classList.toggle("lit", n !== null && (e.from === n || e.to === n));
    if (!n) {
      const varied = this.nodes.some(x => x.varied);
      this.detail.replaceChildren(h("p", {class: "small"}, varied ? [h("i", {class: "key varied"}), "not the same in all variants"] : null,
        this.total ? [h("i", {class: "key cost"}), "ms a frame on the device"] : null, h("i", {class: "key history"}), "the frame before"));
      return;
    }
    const inputs = this.edges.filter(e => e.to === n).flatMap(e => e.list);
    const outs = [...new Set(this.edges.filter(e => e.from === n).flatMap(e => e.list.map(x => x.image)))];
    this.detail.replaceChildren(h("p", {}, h("b", {}, n.name), n.capture ? "" : ` ${n.pass}`,
        n.capture ? "" : h("span", {class: "small"}, ` \u00b7 ${this.users(n)}`, n.ms ? ` \u00b7 ${number(n.ms)} ms a frame` : "")),
      h("p", {class: "small"}, n.capture ? "gives " + outs.join(", ")
        : inputs.map(x => `${x.port} \u2190 ${x.image}${x.history ? " (before)" : ""}`).join(",  ")));
  }
}
