/* The viewer: two pictures of one frame, compared. Its state is one object; every change goes through set(). */

const MODES = [
  {value: "wipe", label: "Wipe", title: "A left of the line, B right of it (W)"},
  {value: "flip", label: "Flip", title: "A and B in turns: space bar (F)"},
  {value: "side", label: "Side by side", title: "A and B beside each other (S)"}
];
const EXPOSURES = {low: -8, high: 8, step: 0.25};
const ZOOMS = {low: 1 / 16, high: 64};

/* Beyond 1, a pixel of the picture is a square of whole pixels; between 1 and 2 only where they are not fine. */
const wholeScale = (scale, ratio) => (scale >= 2 || (scale > 1 && ratio < 2) ? Math.floor(scale + 1e-6) : scale);

/* The pair that differs most by FLIP, in a frame (all frames when that is undefined): its index. */
function worstPair(metrics, frame) {
  const rows = metrics.metrics.filter(r => r.metric === "flip" && r.material === null && typeof r.mean === "number" &&
                                           (!frame || (r.capture === frame.capture && r.frame === frame.frame)));
  return rows.length ? rows.reduce((w, r) => (r.mean > w.mean ? r : w)).pair : 0;
}

class Viewer {
  constructor(root, metrics, page) {
    this.root = root;
    this.metrics = metrics;
    this.page = page;
    this.held = page.frames.filter(f => f.images);
    this.variants = metrics.variants || [];
    this.loaded = null; /* what is drawn: pictures, map, ids */
    this.ticket = 0;
    const frame = this.firstFrame(), any = {reference: 0, test: Math.min(1, this.variants.length - 1)};
    const pair = metrics.pairs[worstPair(metrics, this.held[frame])] || any;
    this.state = {frame, a: pair.reference === null ? -1 : pair.reference, b: pair.test,
                  mode: "wipe", wipe: 0.5, flipped: false, exposure: 0,
                  display: page.displays.length ? "pipeline" : "srgb", overlay: "none", opacity: 0.75,
                  scale: 0, centre: null, pixel: null, pinned: false};
    this.build();
    this.input = new ViewerInput(this);
    new ResizeObserver(() => this.resize()).observe(this.stage);
    this.refresh();
  }

  /* The most telling one: worst by FLIP, else the first. */
  firstFrame() {
    const worst = this.held.findIndex(f => f.why.includes("worst flip"));
    return Math.max(worst, 0);
  }

  get frame() { return this.held[this.state.frame]; }
  sourceName(i) { return i < 0 ? "reference" : this.variants[i] ? this.variants[i].name : `variant ${i + 1}`; }
  sources() {
    const list = this.variants.map((v, i) => ({value: i, label: v.name}));
    if (this.held.some(f => f.reference)) list.unshift({value: -1, label: "reference"});
    return list;
  }

  frameLabel(f) {
    const worst = f.why.filter(w => w.startsWith("worst ")).map(w => metricName(w.slice(6)));
    const why = f.why.filter(w => !w.startsWith("worst "));
    if (worst.length) why.push("worst " + (worst.length > 3 ? `by ${worst.length} metrics` : worst.join(", ")));
    return `frame ${f.frame}` + (why.length ? ` ${DASH} ${why.join(", ")}` : "");
  }

  /* ---- made once ---- */

  build() {
    this.canvas = h("canvas", {tabindex: 0, role: "img", "aria-describedby": "readout",
                               "aria-label": "Pictures A and B; arrow keys move the line, space flips, ? lists all keys"});
    this.handle = h("div", {class: "handle", role: "slider", tabindex: 0, "aria-label": "Line between A and B",
                            "aria-orientation": "horizontal", "aria-valuemin": 0, "aria-valuemax": 100}, h("span"));
    this.tagA = h("span", {class: "tag a"});
    this.tagB = h("span", {class: "tag b"});
    this.marks = [h("div", {class: "pixel", hidden: true}), h("div", {class: "pixel", hidden: true})];
    this.message = h("p", {class: "message", hidden: true});
    const colors = Array.from({length: 9}, (_, i) => `rgb(${this.page.heat.slice(3 * Math.round(i * 255 / 8)).slice(0, 3)})`);
    const ramp = h("i", {style: {background: `linear-gradient(90deg, ${colors})`}});
    this.legend = h("div", {class: "heat", hidden: true}, h("span"), ramp, h("span", {}, "1"));
    this.stage = h("div", {class: "stage"}, this.canvas, this.tagA, this.tagB, this.handle, this.marks, this.legend, this.message);
    this.readout = new Readout(this);
    this.root.append(this.choices(), this.stage, this.controls(), this.readout.element, this.notes());
    this.look = makeLook(this.canvas, this.page.heat, /[?&]2d\b/.test(location.search));
    this.look.onrestore = () => this.draw();
    this.root.dataset.renderer = this.look.name;
  }

  choices() {
    const sources = this.sources(), captures = this.metrics.captures || [];
    this.selectA = select({id: "pick-a"}, sources, this.state.a, v => this.set({a: Number(v)}));
    this.selectB = select({id: "pick-b"}, sources, this.state.b, v => this.set({b: Number(v)}));
    const groups = captures.map((c, i) => ({label: c.name, options: this.held.map((f, k) => ({f, k}))
      .filter(({f}) => f.capture === i).map(({f, k}) => ({value: k, label: this.frameLabel(f)}))}))
      .filter(g => g.options.length);
    const frames = groups.length === 1 ? groups[0].options : groups;
    this.selectFrame = select({id: "pick-frame"}, frames, this.state.frame, v => this.set({frame: Number(v)}));
    this.modes = segmented("How A and B are compared", MODES, this.state.mode, v => this.set({mode: v}));
    return h("div", {class: "choices"},
      h("div", {class: "pick"}, h("label", {for: "pick-a", class: "chip a"}, "A"), this.selectA,
        h("button", {type: "button", class: "icon", title: "Swap A and B (X)", "aria-label": "Swap A and B",
                     onclick: () => this.swap()}, "\u21c4"),
        h("label", {for: "pick-b", class: "chip b"}, "B"), this.selectB),
      h("div", {class: "pick grow"}, h("label", {for: "pick-frame"}, "Frame"), this.selectFrame), this.modes);
  }

  controls() {
    const own = this.page.displays, displays = [{value: "srgb", label: "plain sRGB"}];
    if (own.length) displays.unshift({value: "pipeline", label: own.length > 1 ? "each its own" : own[0].name});
    this.exposure = h("input", {id: "exposure", type: "range", min: EXPOSURES.low, max: EXPOSURES.high,
                                step: EXPOSURES.step, value: 0,
                                oninput: () => this.set({exposure: Number(this.exposure.value)})});
    this.exposureText = h("output", {for: "exposure"});
    this.opacity = h("input", {id: "opacity", type: "range", min: 0, max: 1, step: 0.05, value: this.state.opacity,
                               oninput: () => this.set({opacity: Number(this.opacity.value)})});
    this.selectDisplay = select({id: "display"}, displays, this.state.display, v => this.set({display: v}));
    this.selectOverlay = select({id: "overlay"}, this.overlays(), "none", v => this.set({overlay: v}));
    this.zoomText = h("button", {type: "button", id: "zoom", title: "One pixel a pixel (1), all of it (0)",
                                 onclick: () => (this.state.fit ? this.zoomTo(1) : this.fit())});
    const button = (label, title, act) =>
      h("button", {type: "button", class: "icon", title, "aria-label": title, onclick: act}, label);
    return h("div", {class: "controls"},
      h("div", {class: "control wide"}, h("label", {for: "exposure"}, "Exposure"), this.exposure, this.exposureText,
        button("\u21ba", "Exposure 0 (E)", () => this.set({exposure: 0}))),
      h("div", {class: "control"}, h("label", {for: "display"}, "View"), this.selectDisplay),
      h("div", {class: "control"}, h("label", {for: "overlay"}, "Heat map"), this.selectOverlay,
        this.opacityBox = h("span", {class: "opacity"}, h("label", {for: "opacity"}, "opacity"), this.opacity)),
      h("div", {class: "control"}, h("span", {class: "label"}, "Zoom"),
        button(MINUS, "Smaller (-)", () => this.zoomBy(1 / Math.SQRT2)), this.zoomText,
        button("+", "Larger (+)", () => this.zoomBy(Math.SQRT2))));
  }

  overlays() {
    return [{value: "none", label: "off"}, {value: "flip", label: "FLIP"}, {value: "hdrflip", label: "HDR-FLIP"},
            {value: "difference", label: "|B \u2212 A|, exposed"}];
  }

  notes() {
    const page = this.page, parts = [];
    const total = page.frames.filter(f => !f.error).length;
    if (this.held.length < total)
      parts.push(`This page holds ${this.held.length} of ${plural(total, "frame")}; the others are linked below.`);
    if (page.leftOut)
      parts.push(`${plural(page.leftOut, "more frame")} did not fit its ${Math.round(page.budget / 1048576)}\u00a0MiB.`);
    if (this.held.some(f => f.encoded)) parts.push("The reference is no scene-linear image: it is shown as plain sRGB.");
    for (const d of page.displays)
      if (d.pixels)
        parts.push(`${d.name} is a table of ${d.n}\u00b3 colours here: off by ${number(d.errorMean * 255, 2)}/255 in the ` +
                   `mean and ${number(d.errorMax * 255, 2)}/255 at most, over ${d.pixels.toLocaleString("en")} pixels.`);
    return h("p", {class: "small"}, parts.join(" "));
  }

  /* ---- what changes ---- */

  set(change) {
    const old = this.state;
    this.state = {...old, ...change};
    const load = ["frame", "a", "b", "display", "overlay"].some(k => old[k] !== this.state[k]);
    const halves = old.mode !== this.state.mode && (old.mode === "side" || this.state.mode === "side");
    if (load) this.refresh();
    else if (halves && old.fit && this.loaded) this.fit();
    else this.draw();
    this.onchange && this.onchange(old);
  }

  swap() { this.set({a: this.state.b, b: this.state.a}); }

  flip() {
    if (this.state.mode !== "flip") this.set({mode: "flip", flipped: false});
    else this.set({flipped: !this.state.flipped});
    say(`${this.state.flipped ? "B" : "A"}: ${this.sourceName(this.state.flipped ? this.state.b : this.state.a)}`);
  }

  /* The map of a metric for A and B, whichever of them is the reference. */
  mapBlock(metric) {
    const {a, b} = this.state, is = (x, v) => (x === null ? -1 : x) === v;
    const found = this.frame.maps.find(m => {
      const pair = this.metrics.pairs[m.pair];
      return m.metric === metric && m.block && pair &&
             ((is(pair.reference, a) && is(pair.test, b)) || (is(pair.reference, b) && is(pair.test, a)));
    });
    return found ? found.block : null;
  }

  imageBlock(source) { return source < 0 ? this.frame.reference : this.frame.images[source]; }

  async refresh() {
    const ticket = ++this.ticket, st = this.state;
    if (!this.frame) return this.fail("No frame is in this page: its images are linked below.");
    this.root.setAttribute("aria-busy", "true");
    try {
      const sides = [st.a, st.b].map(v => this.imageBlock(v));
      if (sides.includes(null)) return this.fail("This picture is not in the page.");
      const metric = st.overlay === "flip" || st.overlay === "hdrflip" ? st.overlay : null;
      const blocks = [...sides, this.frame.ids, this.mapBlock("flip"), this.mapBlock("hdrflip")];
      const [a, b, ids, flip, hdrflip] = await Promise.all(blocks.map(x => x && loadBlock(x)));
      const displays = await Promise.all([st.a, st.b].map(v => displayFor(this.page, this.frame, st.display, v)));
      if (ticket !== this.ticket) return;
      const resized = !this.loaded || this.loaded.pictures[0].image.width !== a.width ||
                      this.loaded.pictures[0].image.height !== a.height;
      this.loaded = {pictures: [{image: a, display: displays[0]}, {image: b, display: displays[1]}], ids,
                     maps: {flip, hdrflip}, missing: metric && !this.mapBlock(metric)};
      this.message.hidden = true;
      if (resized) this.state.centre = null;
      this.resize();
    } catch (error) {
      this.fail("The pictures of this page cannot be read: " + error.message);
    }
    if (ticket === this.ticket) this.root.removeAttribute("aria-busy");
  }

  fail(text) {
    this.loaded = null;
    this.message.textContent = text;
    this.message.hidden = false;
    this.root.removeAttribute("aria-busy");
    this.handle.hidden = true;
  }

  /* ---- geometry ---- */

  resize() {
    if (!this.loaded) return;
    const image = this.loaded.pictures[0].image, ratio = window.devicePixelRatio || 1;
    const width = this.stage.clientWidth, most = Math.max(240, window.innerHeight * 0.74);
    const scale = wholeScale(Math.min(width * ratio / image.width, most * ratio / image.height), ratio);
    const height = Math.round(clamp(scale * image.height / ratio, 160, most));
    this.stage.style.height = height + "px";
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    if (!this.state.centre || this.state.fit) this.fit();
    else this.draw();
  }

  paneWidth() { return this.state.mode === "side" ? Math.floor(this.canvas.width / 2) : this.canvas.width; }

  fit() {
    const image = this.loaded.pictures[0].image;
    const scale = wholeScale(Math.min(this.paneWidth() / image.width, this.canvas.height / image.height), window.devicePixelRatio || 1);
    this.state = {...this.state, scale: Math.max(scale, ZOOMS.low), centre: [image.width / 2, image.height / 2], fit: true};
    this.draw();
  }

  zoomTo(scale, x, y) {
    const st = this.state, scene = this.scene(), to = clamp(scale, ZOOMS.low, ZOOMS.high);
    const pane = scene.panes.find(p => x !== undefined && x < p.x + p.width) || scene.panes[0];
    if (x === undefined) [x, y] = [pane.x + pane.width / 2, scene.height / 2];
    const [px, py] = imagePoint(scene, pane, x, y), k = st.scale / to;
    this.state = {...st, scale: to, fit: false, centre: [px + (st.centre[0] - px) * k, py + (st.centre[1] - py) * k]};
    this.keepInside();
    this.draw();
  }

  /* From one to the next of 1, 2, 3, … beyond 1, where a pixel is a square of whole pixels. */
  zoomBy(factor, x, y) {
    const from = this.state.scale, raw = from * factor;
    const whole = factor > 1 ? Math.max(Math.round(raw), Math.floor(from) + 1) : Math.min(Math.round(raw), Math.ceil(from) - 1);
    this.zoomTo(from >= 1 && whole >= 1 ? whole : raw, x, y);
  }

  panBy(dx, dy) {
    const st = this.state;
    this.state = {...st, fit: false, centre: [st.centre[0] - dx / st.scale, st.centre[1] - dy / st.scale]};
    this.keepInside();
    this.draw();
  }

  keepInside() {
    const image = this.loaded.pictures[0].image, c = this.state.centre;
    this.state.centre = [clamp(c[0], 0, image.width), clamp(c[1], 0, image.height)];
  }

  /* What look.js describes. */
  scene() {
    const st = this.state, {width, height} = this.canvas, half = Math.floor(width / 2), far = 1e6;
    const split = st.mode === "wipe" ? Math.round(st.wipe * width) : st.flipped ? -far : far;
    const panes = st.mode === "side" ? [{x: 0, width: half - 1, split: far}, {x: half + 1, width: width - half - 1, split: -far}]
                                     : [{x: 0, width, split}];
    const map = st.overlay === "none" ? null : st.overlay === "difference" ? "difference" : this.loaded.maps[st.overlay];
    /* The middle of a pixel of the canvas never lies on the border of two of the image's. */
    const snap = v => (st.scale >= 1 ? Math.round(v * st.scale) / st.scale : v);
    const offset = panes[0].width % 2 ? 0.5 / st.scale : 0, offsetY = height % 2 ? 0.5 / st.scale : 0;
    const centre = [snap(st.centre[0]) + offset, snap(st.centre[1]) + offsetY];
    return {width, height, panes, pictures: this.loaded.pictures, scale: st.scale, centre, exposure: st.exposure,
            overlay: map ? {map, opacity: st.opacity} : null};
  }

  draw() {
    if (!this.loaded || !this.canvas.width || this.queued) return;
    this.queued = true;
    requestAnimationFrame(() => {
      this.queued = false;
      if (!this.loaded) return;
      const scene = this.scene();
      this.look.draw(scene);
      this.show(scene);
      this.root.dataset.drawn = Number(this.root.dataset.drawn || 0) + 1;
    });
  }

  /* Controls and labels follow the state. */
  show(scene) {
    const st = this.state, css = this.stage.clientWidth / scene.width, side = st.mode === "side";
    this.modes.set(st.mode);
    this.selectA.value = st.a;
    this.selectB.value = st.b;
    this.selectFrame.value = st.frame;
    this.selectDisplay.value = st.display;
    this.selectOverlay.value = st.overlay;
    this.legend.hidden = !scene.overlay;
    this.legend.firstChild.textContent = (st.overlay === "difference" ? "difference" : metricName(st.overlay)) + " 0";
    this.opacityBox.hidden = st.overlay === "none";
    this.exposure.value = st.exposure;
    const stops = (st.exposure > 0 ? "+" : "") + fixed(st.exposure, 2);
    this.exposureText.textContent = stops;
    this.exposure.setAttribute("aria-valuetext", stops + " stops");
    this.zoomText.textContent = Math.round(st.scale * 100) + THIN + "%";
    this.handle.hidden = st.mode !== "wipe";
    this.handle.style.left = st.wipe * 100 + "%";
    this.handle.setAttribute("aria-valuenow", Math.round(st.wipe * 100));
    this.handle.setAttribute("aria-valuetext", `${Math.round(st.wipe * 100)} percent is A`);
    this.tagA.hidden = st.mode === "flip" && st.flipped;
    this.tagB.hidden = st.mode === "flip" && !st.flipped;
    this.tagA.textContent = "A  " + this.sourceName(st.a);
    this.tagB.textContent = "B  " + this.sourceName(st.b);
    this.tagB.classList.toggle("left", side || st.mode === "flip");
    this.tagB.style.left = side ? "calc(50% + 10px)" : "";
    this.stage.dataset.mode = st.mode;
    const names = [`A, ${this.sourceName(st.a)}`, `B, ${this.sourceName(st.b)}`];
    this.canvas.setAttribute("aria-label", `Frame ${this.frame.frame}, ` + (st.mode === "flip" ? names[st.flipped ? 1 : 0]
      : `${names[0]}, left; ${names[1]}, right`) + "; space flips, ? lists all keys");
    this.message.hidden = !this.loaded.missing;
    if (this.loaded.missing) this.message.textContent = "No such map was measured for A and B.";
    this.showPixel(scene, css);
    this.readout.show();
  }

  /* A frame around the pixel that is read out. */
  showPixel(scene, css) {
    const pixel = this.state.pixel;
    this.marks.forEach((mark, i) => {
      const pane = scene.panes[i];
      mark.hidden = !pixel || !pane || !(this.state.pinned || this.input.keyboardPixel);
      if (mark.hidden) return;
      const [x, y] = canvasPoint(scene, pane, pixel[0], pixel[1]), size = Math.max(scene.scale * css, 5);
      mark.hidden = x * css + size < pane.x * css || x > pane.x + pane.width;
      Object.assign(mark.style, {left: x * css + "px", top: y * css + "px", width: size + "px", height: size + "px"});
      mark.classList.toggle("pinned", this.state.pinned);
    });
  }
}
