/* What metrics.json says, by pair, material, metric. */

const STATS = [{value: "mean", label: "mean"}, {value: "median", label: "median"}, {value: "p95", label: "95th %"}, {value: "max", label: "max"}];

class Measures {
  constructor(metrics) {
    this.metrics = metrics;
    this.list = metrics.metrics || [];
    const present = new Set(this.list.map(r => r.metric));
    this.names = [...Object.keys(METRIC_NAMES).filter(m => present.has(m)), ...[...present].filter(m => !METRIC_NAMES[m])];
    this.index = new Map();
    for (const r of this.list) {
      const key = this.key(r.capture, r.pair, r.material, r.metric);
      if (!this.index.has(key)) this.index.set(key, []);
      this.index.get(key).push(r);
    }
    this.bounds = new Map((metrics.null || []).map(r => [this.key(r.capture, "", r.material, r.metric), r]));
  }

  key(...parts) { return JSON.stringify(parts); }
  rows(capture, pair, material, metric) { return this.index.get(this.key(capture, pair, material, metric)) || []; }

  /* Materials with numbers: null (all of them) first. */
  materials(capture, pair) {
    const seen = new Set(this.list.filter(r => r.capture === capture && r.pair === pair).map(r => r.material));
    return [...(seen.has(null) ? [null] : []), ...[...seen].filter(m => m !== null)];
  }

  frames(capture, pair) {
    return [...new Set(this.list.filter(r => r.capture === capture && r.pair === pair).map(r => r.frame))].sort((a, b) => a - b);
  }

  bound(capture, material, metric, stat) {
    const b = this.bounds.get(this.key(capture, "", material, metric));
    return b && b[stat] !== null && b[stat] !== undefined ? b[stat] : null;
  }

  /* Over frames: the mean of a statistic, the frame where it differs most, and where it is beyond chance. */
  over(capture, pair, material, metric, stat) {
    const rows = this.rows(capture, pair, material, metric), with_ = rows.filter(r => r[stat] !== null && r[stat] !== undefined);
    if (!with_.length) return {n: rows.length, mean: null, worst: null, beyond: 0, known: 0};
    const worst = with_.reduce((w, r) => (moreDifferent(metric, r[stat], w[stat]) ? r : w));
    return {n: rows.length, mean: with_.reduce((t, r) => t + r[stat], 0) / with_.length, worst,
            beyond: rows.filter(r => r.beyond_chance === true).length, known: rows.filter(r => typeof r.beyond_chance === "boolean").length};
  }
}

const pairName = (metrics, pair) => {
  const name = i => (i === null || i < 0 ? "the reference" : (metrics.variants[i] || {}).name || `variant ${i + 1}`);
  return `${name(pair.test)} against ${name(pair.reference)}`;
};

const isDifference = (metric, v) => (metric === "ssim" ? v < 1 : metric === "psnr" ? Number.isFinite(v) : v > 0);

/* Rows of materials, columns of metrics. `show(frame)` opens one in the viewer, when it is held. */
function metricTable(measures, {capture, pair, stat}, color, show) {
  const materials = measures.materials(capture, pair), names = measures.names.filter(m => stat === "mean" || m !== "psnr");
  const many = measures.frames(capture, pair).length > 1;
  const cell = (material, metric) => {
    const o = measures.over(capture, pair, material, metric, stat);
    if (o.mean === null) return h("td", {class: "none"}, metric === "psnr" && o.n ? h("span", {title: "no difference"}, "\u221e") : NONE);
    const worst = o.worst[stat];
    const chance = o.known ? `${o.beyond} of ${plural(o.n, "frame")} beyond chance` : null;
    return h("td", {},
      h("span", {class: "number"}, number(o.mean)),
      o.beyond ? h("b", {class: "beyond", title: chance}, "\u25cf", h("span", {class: "hidden"}, ` (${chance})`)) : null,
      many && isDifference(metric, worst)
        ? h("button", {type: "button", class: "link", title: `worst: ${number(worst)} at frame ${o.worst.frame}`,
                       onclick: () => show(capture, o.worst.frame, pair, metric)}, `${number(worst)} @${THIN}${o.worst.frame}`) : null);
  };
  return h("div", {class: "scroll", tabindex: 0, role: "region", "aria-label": "Table of the metrics"}, h("table", {class: "metrics"},
    h("caption", {class: "hidden"}, "Mean over frames, and the worst frame"),
    h("thead", {}, h("tr", {}, h("th", {scope: "col"}, "Material"), names.map(m =>
      h("th", {scope: "col", class: "num", title: METRIC_HELP[m]}, metricName(m), METRIC_UNITS[m] ? h("small", {}, " " + METRIC_UNITS[m]) : null)))),
    h("tbody", {}, materials.map((m, i) => h("tr", {class: m === null ? "whole" : null},
      h("th", {scope: "row"}, h("i", {class: "swatch", style: {background: color(i)}}), materialName(m)), names.map(x => cell(m, x)))))));
}
