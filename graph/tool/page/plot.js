/* Small plots of one metric each: lines over frames, bars over materials. */

const SERIES = 8; /* colours; see --s0 … in page.css */
const seriesColor = i => `var(--s${i % SERIES})`;

/* Few round numbers from low to high. */
function ticks(low, high, n = 4) {
  const span = high - low || 1, raw = span / n, unit = 10 ** Math.floor(Math.log10(raw));
  const step = unit * ([1, 2, 2.5, 5].find(k => k * unit >= raw * 0.999) || 10), list = [];
  for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + step * 1e-6; v += step) list.push(Math.abs(v) < step * 1e-6 ? 0 : v);
  return list;
}

/* "0.06", not "0.0600000001". */
const tickText = v => String(Number(v.toPrecision(6))).replace("-", MINUS);

/* From 0 where 0 is "no difference", else around what there is. */
function range(metric, values) {
  if (!values.length) return [0, 1];
  const most = values.reduce((a, b) => Math.max(a, b)), least = values.reduce((a, b) => Math.min(a, b));
  if (!metricRises(metric)) return [0, most > 0 ? most * 1.06 : 1];
  const pad = (most - least) * 0.1 || Math.abs(most) * 0.02 || 1;
  return [least - pad, most + pad];
}

/* Lines over frames. `series`: [{name, color, values: Map frame -> number, bound, main}], `pick(frame)` opens one. */
class LinePlot {
  constructor({metric, frames, series, pick, held}) {
    Object.assign(this, {metric, frames, series, pick, held, at: -1});
    this.W = 340;
    this.H = 170;
    this.box = {left: 46, right: 10, top: 10, bottom: 24};
    this.svg = s("svg", {viewBox: `0 0 ${this.W} ${this.H}`, tabindex: 0, role: "img", class: "plot"});
    this.tip = h("div", {class: "tip", hidden: true});
    this.element = h("figure", {class: "multiple"},
      h("figcaption", {title: METRIC_HELP[metric]}, metricName(metric),
        METRIC_UNITS[metric] ? h("small", {}, " " + METRIC_UNITS[metric]) : null), h("div", {class: "plotbox"}, this.svg, this.tip));
    this.svg.addEventListener("pointermove", e => this.hover(e));
    this.svg.addEventListener("pointerleave", () => this.cursor(-1));
    this.svg.addEventListener("blur", () => this.cursor(-1));
    this.svg.addEventListener("click", () => this.at >= 0 && this.pick(this.frames[this.at]));
    this.svg.addEventListener("keydown", e => this.key(e));
    this.draw();
  }

  x(i) {
    const {left, right} = this.box, n = this.frames.length;
    return left + (n === 1 ? 0.5 : i / (n - 1)) * (this.W - left - right);
  }
  y(v) {
    const {top, bottom} = this.box, [low, high] = this.range;
    return this.H - bottom - (v - low) / (high - low) * (this.H - top - bottom);
  }

  /* Pieces between frames without a value. */
  path(values) {
    let text = "", open = false;
    this.frames.forEach((f, i) => {
      const v = values.get(f);
      if (v === undefined || v === null) { open = false; return; }
      text += `${open ? "L" : "M"}${this.x(i).toFixed(1)} ${this.y(v).toFixed(1)}`;
      open = true;
    });
    return text;
  }

  draw() {
    const numbers = this.series.flatMap(x => [...x.values.values()]).filter(v => v !== null);
    const main = this.series.find(x => x.main && x.bound !== null);
    this.range = range(this.metric, main ? [...numbers, main.bound] : numbers);
    const {left, right, top, bottom} = this.box, end = this.W - right, base = this.H - bottom;
    const every = Math.max(1, Math.ceil(this.frames.length / 7));
    this.svg.replaceChildren(
      main ? this.band(main.bound) : "",
      ...ticks(...this.range).filter(v => v >= this.range[0]).map(v => s("g", {},
        s("line", {class: "grid", x1: left, x2: end, y1: this.y(v), y2: this.y(v)}),
        s("text", {class: "tick y", x: left - 6, y: this.y(v) + 3.5}, tickText(v)))),
      ...this.frames.map((f, i) => (i % every ? "" : s("text", {class: "tick x", x: this.x(i), y: base + 15}, f))),
      ...this.series.map(x => this.line(x)),
      this.mark = s("line", {class: "cursor", y1: top, y2: base, visibility: "hidden"}));
    const whole = this.series.find(x => x.main) || this.series[0];
    const list = whole ? [...whole.values.values()].filter(v => v !== null) : [];
    this.svg.setAttribute("aria-label", `${metricName(this.metric)} over ${this.frames.length} frames` +
      (list.length ? `, ${whole.name}: ${number(list.reduce((a, b) => Math.min(a, b)))} to ${number(list.reduce((a, b) => Math.max(a, b)))}` : "") +
      "; left and right read a frame, Enter shows it");
  }

  line(x) {
    const group = s("g", {class: x.main ? "line main" : "line", style: {"--c": x.color}}, s("path", {d: this.path(x.values)}));
    if (this.frames.length <= 40)
      this.frames.forEach((f, i) => {
        const v = x.values.get(f);
        if (v !== undefined && v !== null)
          group.append(s("circle", {cx: this.x(i), cy: this.y(v), r: x.main ? 2.6 : 1.8, class: this.held.has(f) ? "held" : null}));
      });
    return group;
  }

  /* What chance alone makes: at most `bound` (at least, where larger is more alike). */
  band(bound) {
    const {left, right, top, bottom} = this.box, edge = clamp(this.y(bound), top, this.H - bottom);
    const from = metricRises(this.metric) ? top : edge, to = metricRises(this.metric) ? edge : this.H - bottom;
    return s("g", {class: "chance"}, s("rect", {x: left, y: from, width: this.W - left - right, height: Math.max(to - from, 0)}),
             s("line", {x1: left, x2: this.W - right, y1: edge, y2: edge}));
  }

  hover(e) {
    const box = this.svg.getBoundingClientRect(), x = (e.clientX - box.left) / box.width * this.W;
    const {left, right} = this.box, n = this.frames.length;
    this.cursor(n === 1 ? 0 : clamp(Math.round((x - left) / (this.W - left - right) * (n - 1)), 0, n - 1));
  }

  key(e) {
    const step = {ArrowLeft: -1, ArrowRight: 1}[e.key];
    if (step) this.cursor(clamp((this.at < 0 ? (step > 0 ? -1 : this.frames.length) : this.at) + step, 0, this.frames.length - 1));
    else if (e.key === "Enter" && this.at >= 0) this.pick(this.frames[this.at]);
    else return;
    e.preventDefault();
    e.stopPropagation();
    say(this.tip.textContent);
  }

  cursor(i) {
    this.at = i;
    this.tip.hidden = i < 0;
    this.mark.setAttribute("visibility", i < 0 ? "hidden" : "visible");
    if (i < 0) return;
    const f = this.frames[i], x = this.x(i);
    this.mark.setAttribute("x1", x);
    this.mark.setAttribute("x2", x);
    this.tip.replaceChildren(h("b", {}, `frame ${f}` + (this.held.has(f) ? "" : " (linked)")), ...this.series.map(c =>
      h("div", {}, h("i", {style: {background: c.color}}), c.name + " ", h("span", {}, number(c.values.get(f) ?? null)))));
    const right = x > this.W / 2;
    this.tip.style.left = right ? "" : x / this.W * 100 + 3 + "%";
    this.tip.style.right = right ? (1 - x / this.W) * 100 + 3 + "%" : "";
  }
}

/* A bar a material; a tick where chance ends. rows: [{name, color, value, bound, beyond}] */
function barPlot(metric, rows) {
  const values = rows.flatMap(r => [r.value, r.bound]).filter(v => v !== null && v !== undefined);
  const [low, high] = range(metric, values), share = v => (typeof v === "number" ? (v - low) / (high - low) : null);
  const dot = () => h("b", {class: "beyond", title: "beyond what chance makes"}, "\u25cf");
  return bars({text: metricName(metric), help: METRIC_HELP[metric]}, METRIC_UNITS[metric], rows.map(r => ({
    name: r.name, color: r.color, share: share(r.value), value: [number(r.value), r.beyond ? dot() : null],
    limit: share(r.bound), about: "what chance makes: " + number(r.bound)})));
}
