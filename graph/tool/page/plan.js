/* `relit plan --format html`: graph, steps, lifetimes, memory, from the plan as JSON; times from a trace. */

const bytes = n => {
  const units = ["B", "KiB", "MiB", "GiB", "TiB"];
  let i = 0;
  for (; n >= 1024 && i < 4; i++) n /= 1024;
  return (i ? n.toFixed(1) : n) + "\u00a0" + units[i];
};

const CLASSES = {source: "read from the capture", transient: "between passes", sink: "for the writer", history: "kept for the next frame"};

class PlanView {
  /* group: {nodes, reason} of variants, or null; times: of the trace, or null. */
  constructor(plan, group, variants, times, id) {
    Object.assign(this, {plan, group, variants, times, id});
    this.made = new Map(); /* image -> the node that writes it */
    for (const n of plan.nodes) for (const p of n.ports) if (p.role === "write" && p.image) this.made.set(p.image, n.name);
    this.last = plan.steps.length; /* what the writer reads lives until then */
  }

  section(name, title, ...content) {
    const id = name + this.id;
    return h("section", {id, "aria-labelledby": id + "-title"}, h("h2", {id: id + "-title"}, title), content);
  }

  /* Milliseconds of a step a frame, or null: kernels are traced as "node: entry", conversions by their image. */
  ms(step) {
    if (!this.times) return null;
    const name = step.kind === "kernel" ? `${step.node}: ${step.entry}` : this.plan.buffers[step.buffers[0]].name;
    const kinds = step.kind === "kernel" ? ["kernel", "colour"] : [step.kind];
    for (const k of kinds) if (`${k} ${name}` in this.times.spans) return this.times.spans[`${k} ${name}`].ms;
    return null;
  }

  graph() {
    const about = new Map((this.group ? this.group.nodes : []).map(n => [n.name, n])), edges = [];
    const nodes = this.plan.nodes.map(n => {
      const list = this.plan.steps.filter(x => x.node === n.name).map(x => this.ms(x)).filter(x => x !== null), more = about.get(n.name);
      return {name: n.name, pass: n.pass, varied: !!(more && more.varied), variants: more ? more.variants : null,
              ms: list.length ? list.reduce((a, b) => a + b, 0) : null};
    });
    for (const n of this.plan.nodes)
      for (const p of n.ports)
        if ((p.role === "read" || p.role === "history") && p.image)
          edges.push({from: this.made.get(p.image) || "capture", to: n.name, image: p.image, port: p.name, history: p.role === "history"});
    const words = `Left out, since no output needs them: ${this.plan.culled.join(", ")}.`;
    const culled = this.plan.culled.length ? h("p", {class: "small"}, words) : null;
    return this.section("graph", "Graph", new GraphView({nodes, edges}, {variants: this.variants}).element, culled);
  }

  stepName(step) {
    if (step.kind === "kernel") return [h("b", {}, step.node), " ", h("code", {}, step.entry)];
    const [from, to] = step.buffers.map(b => this.plan.buffers[b]);
    const converts = step.kind === "convert";
    return [h("span", {class: "small"}, converts ? "convert " : "keep "), converts ? `${from.name} to ${to.layout}` : from.name];
  }

  steps() {
    const times = this.plan.steps.map(x => this.ms(x)), most = Math.max(...times.map(t => t || 0)), timed = most > 0;
    const name = b => { const x = this.plan.buffers[b]; return x.name + (x.layout === "phase4" ? "\u2032" : ""); };
    const moved = step => [...new Set(step.buffers.filter(b => b !== null))].reduce((sum, b) => sum + (this.plan.buffers[b].bytes || 0), 0);
    const list = (step, write) => {
      if (step.kind !== "kernel") return name(step.buffers[write ? 1 : 0]);
      const ports = this.plan.nodes.find(n => n.name === step.node).ports;
      return ports.filter(p => (p.role === "write") === write && p.role !== "scratch" && p.buffer !== null)
        .map(p => (p.role === "history" ? "past " : "") + name(p.buffer)).join(", ");
    };
    const total = times.reduce((a, b) => a + (b || 0), 0);
    const time = t => h("span", {class: "time"}, t === null ? NONE
      : [h("span", {class: "track"}, h("span", {class: "fill main", style: {width: t / most * 100 + "%"}})), h("span", {class: "value"}, number(t))]);
    const row = (x, i) => [i, this.stepName(x), ...(timed ? [time(times[i])] : []), h("small", {}, list(x, false)), h("small", {}, list(x, true)),
                           h("small", {}, moved(x) ? bytes(moved(x)) : NONE)];
    return this.section("steps", "Steps", h("p", {class: "small"},
        timed ? `${number(total)} ms on the device a frame, the mean of ${plural(this.times.frames, "frame")} of the trace. ` : null,
        this.plan.buffers.some(b => b.layout === "phase4") ? "\u2032 marks the phase4 layout." : null),
      table("Steps", ["No.", "Step", ...(timed ? ["ms"] : []), "Reads", "Writes", "#Buffers"], this.plan.steps.map(row), {class: "steps"}));
  }

  /* A row a buffer, but one a slot: what shares memory is in one line. */
  rows() {
    const p = this.plan, copies = {source: p.memory ? p.memory.in_flight : 1, sink: p.memory ? p.memory.in_flight : 1, history: 2};
    const row = (label, list, kind, n, size) => ({label, list, kind, copies: n, bytes: size});
    const fixed_ = kind => p.buffers.filter(b => b.class === kind).map(b => row(b.name, [b], kind, copies[kind], b.bytes));
    const slots = p.slots.map((s_, i) => row("slot " + i, s_.buffers.map(k => p.buffers[k]), "transient", 1, s_.bytes));
    return [...fixed_("source"), ...slots, ...fixed_("sink"), ...fixed_("history")];
  }

  lifetimes() {
    const rows = this.rows(), n = this.last + 1, left = 170, W = 1180, right = 110, high = 22, top = 26, cell = (W - left - right) / n;
    const H = top + rows.length * high + 8, x = step => left + clamp(step, 0, n) * cell;
    const text = (attributes, value) => s("text", attributes, value);
    const short = (label, most) => (label.length > most ? label.slice(0, most - 1) + "\u2026" : label);
    const chart = s("svg", {viewBox: `0 0 ${W} ${H}`, class: "lives", role: "img", style: {"min-width": "820px"},
                            "aria-label": `Lifetimes of ${rows.length} buffers and slots over ${this.last} steps`},
      Array.from({length: n}, (_, i) => [s("line", {class: "grid", x1: x(i), x2: x(i), y1: top - 6, y2: H}),
        text({class: "tick x", x: x(i) + cell / 2, y: 14}, i === this.last ? "write" : i)]),
      rows.map((r, i) => {
        const y = top + i * high;
        return s("g", {class: "life " + r.kind}, text({x: 0, y: y + 14, class: "label"}, short(r.label, 26), s("title", {}, r.label)),
          r.list.map(b => {
            const from = Math.max(b.first, 0), to = Math.min(b.last, this.last), end = to === this.last ? "write" : to, wide = (to + 1 - from) * cell - 2, room = Math.floor(wide / 6.2);
            return s("g", {}, s("rect", {x: x(from) + 1, y: y + 2, width: wide, height: high - 5, rx: 4}),
              r.kind === "transient" && room > 4 ? text({x: x(from) + 7, y: y + 14, class: "inside"}, short(b.name, room)) : null,
              s("title", {}, `${b.name}, ${plural(b.planes, "plane")} ${b.layout}, steps ${from}\u2013${end}${b.scratch ? ", scratch" : ""}`));
          }), r.bytes ? text({x: W, y: y + 14, class: "tick y"}, bytes(r.bytes) + (r.copies > 1 ? ` \u00d7 ${r.copies}` : "")) : null);
      }));
    const keys = Object.keys(CLASSES).filter(k => rows.some(r => r.kind === k))
      .map(k => [h("i", {class: "key " + (k === "history" ? "kept" : k)}), CLASSES[k]]);
    return this.section("lifetimes", "Lifetimes",
      h("p", {class: "small"}, "From the step that fills a buffer to the last that reads it."), h("p", {class: "small keys-line"}, keys),
      h("div", {class: "scroll", tabindex: 0, role: "region", "aria-label": "Lifetimes"}, chart));
  }

  memory() {
    const m = this.plan.memory, rows = this.rows(), peak = this.plan.peak;
    if (!m) return null;
    const sum = kind => rows.filter(r => r.kind === kind).reduce((t, r) => t + r.copies * (r.bytes || 0), 0);
    const sums = Object.keys(CLASSES).map(k => ({name: CLASSES[k], kind: k, bytes: sum(k)})).filter(x => x.bytes);
    const parts = peak ? ["buffers", "reading", "writing", "checkpoint"].filter(k => peak[k]).map(k => ({name: k, bytes: peak[k]})) : [];
    const chart = (title, list, total) => {
      const most = Math.max(...list.map(y => y.bytes));
      return bars(title, bytes(total), list.map(x => ({name: x.name, class: x.kind || "main", share: x.bytes / most, value: bytes(x.bytes)})));
    };
    const saved = m.bytes_unshared > m.bytes ? ` Without shared slots the buffers would take ${bytes(m.bytes_unshared)}.` : "";
    const words = `${m.data_window[2]} \u00d7 ${m.data_window[3]} pixels in buffers of ${m.columns} \u00d7 ${m.rows}, ` +
      `${plural(m.in_flight, "frame")} in flight.${saved}`;
    return this.section("memory", "Memory", h("p", {class: "small"}, words),
      h("div", {class: "multiples"}, chart("Buffers", sums, m.bytes), parts.length ? chart("Peak of a run", parts, peak.total) : null));
  }

  all() { return [this.graph(), this.steps(), this.lifetimes(), this.memory()].filter(Boolean); }
}

(function start() {
  const plans = JSON.parse(byId("plans").textContent), trace = JSON.parse(byId("trace").textContent), facts = [], sections = [];
  const add = (plan, group, variants, title, id) => {
    const view = new PlanView(plan, group, variants, trace, id), list = view.all();
    if (title) list.unshift(h("h2", {class: "part"}, title));
    const peak = plan.peak ? bytes(plan.peak.total) + " at most" : null;
    facts.push([title, plural(plan.nodes.length, "node"), plural(plan.steps.length, "step"), peak].filter(Boolean).join(", "));
    sections.push(...list);
  };
  plans.forEach((p, i) => {
    const many = plans.length > 1;
    if (!p.groups) return add(p, null, [], many ? p.capture || `capture ${i + 1}` : null, many ? "-" + i : "");
    const times = x => fixed(x, 2) + "\u00d7", parts = many || p.groups.length > 1;
    const title = g => [many ? p.capture : null, g.reason].filter(Boolean).join(": ");
    if (!i) facts.push(`${plural(p.variants.length, "variant")} = ${times(p.cost.factor)} one (${times(p.cost.sum)} one after the other)`);
    p.groups.forEach((g, k) => add(g.plan, g, p.variants, title(g), parts ? `-${i}-${k}` : ""));
  });
  if (trace) facts.push(`times of ${plural(trace.frames, "frame")}`);
  byId("facts").append(...facts.map(f => h("li", {}, f)));
  byId("sections").append(...sections);
  byId("nav").append(...sections.filter(x => x.id).map(x => h("a", {href: "#" + x.id}, x.querySelector("h2").textContent)));
  byId("theme").addEventListener("click", switchTheme);
})();
