/* Hands on the viewer: pointer, wheel, two fingers, keyboard. */

const KEYS = [
  [["Space"], "A and B in turns"],
  [["W", "F", "S"], "wipe, flip, side by side"],
  [["\u2190", "\u2192"], "move the line (Shift: further); in flip and side by side: pan"],
  [["\u2191", "\u2193", "Shift + arrows"], "pan"],
  [["+", "\u2212"], "zoom; two fingers too, and the wheel after a click on the picture"],
  [["0", "1"], "all of the picture; one pixel a pixel"],
  [["[", "]"], "exposure, a quarter of a stop"],
  [["E"], "exposure 0"],
  [["H"], "next heat map: FLIP, HDR-FLIP, difference, off"],
  [["A", "B"], "next variant as A, as B (Shift: the one before)"],
  [["X"], "swap A and B"],
  [[",", "."], "frame before, next frame"],
  [["V"], "next view"],
  [["Alt + arrows"], "move the pixel that is read out (Shift: by 10)"],
  [["Esc"], "let go of that pixel"],
  [["T"], "light or dark"],
  [["?"], "this list"]
];

class ViewerInput {
  constructor(viewer) {
    this.viewer = viewer;
    this.pointers = new Map();
    this.keyboardPixel = false;
    const {canvas, handle, stage} = viewer;
    canvas.addEventListener("pointerdown", e => this.down(e));
    canvas.addEventListener("pointermove", e => this.move(e));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, e => this.up(e));
    canvas.addEventListener("pointerleave", () => this.leave());
    stage.addEventListener("wheel", e => this.wheel(e), {passive: false});
    handle.addEventListener("pointerdown", e => { handle.setPointerCapture(e.pointerId); this.wiping = true; handle.focus(); });
    handle.addEventListener("pointermove", e => { if (this.wiping) this.wipeTo(e); });
    for (const end of ["pointerup", "pointercancel"]) handle.addEventListener(end, () => { this.wiping = false; });
    document.addEventListener("keydown", e => this.key(e));
  }

  /* Device pixels of the canvas. */
  place(e) {
    const box = this.viewer.canvas.getBoundingClientRect(), ratio = this.viewer.canvas.width / box.width;
    return [(e.clientX - box.left) * ratio, (e.clientY - box.top) * ratio];
  }

  wipeTo(e) { this.viewer.set({wipe: clamp(this.place(e)[0] / this.viewer.canvas.width, 0, 1)}); }

  pixelAt(x, y) {
    const v = this.viewer;
    if (!v.loaded) return null;
    const scene = v.scene(), pane = scene.panes.find(p => x < p.x + p.width) || scene.panes[0];
    const p = imagePoint(scene, pane, x, y).map(Math.floor), image = v.loaded.pictures[0].image;
    return p[0] >= 0 && p[1] >= 0 && p[0] < image.width && p[1] < image.height ? p : null;
  }

  down(e) {
    this.viewer.canvas.setPointerCapture(e.pointerId);
    this.pointers.set(e.pointerId, this.place(e));
    this.dragged = 0;
  }

  move(e) {
    const v = this.viewer, now = this.place(e), before = this.pointers.get(e.pointerId);
    if (!v.loaded) return;
    if (!before) {
      if (!v.state.pinned) {
        this.keyboardPixel = false;
        v.set({pixel: this.pixelAt(now[0], now[1])});
      }
      return;
    }
    const others = [...this.pointers.entries()].filter(([id]) => id !== e.pointerId);
    this.pointers.set(e.pointerId, now);
    this.dragged += Math.abs(now[0] - before[0]) + Math.abs(now[1] - before[1]);
    if (others.length === 1) this.pinch(before, now, others[0][1]);
    else if (this.dragged > 3) v.panBy(now[0] - before[0], now[1] - before[1]);
  }

  pinch(before, now, other) {
    const v = this.viewer, size = p => Math.hypot(p[0] - other[0], p[1] - other[1]);
    const middle = p => [(p[0] + other[0]) / 2, (p[1] + other[1]) / 2], to = middle(now), from = middle(before);
    v.panBy(to[0] - from[0], to[1] - from[1]);
    if (size(before) > 0) v.zoomTo(v.state.scale * size(now) / size(before), to[0], to[1]);
  }

  up(e) {
    const at = this.pointers.get(e.pointerId), v = this.viewer;
    this.pointers.delete(e.pointerId);
    if (!at || this.dragged > 3 || e.type === "pointercancel") return;
    const pixel = this.pixelAt(at[0], at[1]), p = v.state.pixel;
    const same = v.state.pinned && pixel && p && p[0] === pixel[0] && p[1] === pixel[1];
    v.set({pixel, pinned: pixel !== null && !same});
  }

  leave() {
    const v = this.viewer;
    if (!v.state.pinned && !this.keyboardPixel && v.state.pixel) v.set({pixel: null});
  }

  /* The page scrolls under the wheel until the viewer was touched: it holds the focus then. */
  wheel(e) {
    const v = this.viewer;
    if (!v.loaded || !(e.ctrlKey || v.root.contains(document.activeElement))) return;
    e.preventDefault();
    const [x, y] = this.place(e), amount = clamp(e.deltaY * (e.deltaMode ? 16 : 1), -120, 120);
    v.zoomTo(v.state.scale * 2 ** (-amount / 240), x, y);
  }

  key(e) {
    const target = e.target, v = this.viewer, tag = target.tagName;
    if (e.ctrlKey || e.metaKey || byId("help").open) return;
    const own = target === v.canvas || target === v.handle;
    if (tag === "SELECT" || tag === "INPUT" || (tag === "BUTTON" || tag === "A" || tag === "SUMMARY") && (e.key === " " || e.key === "Enter"))
      return;
    if (!own && e.key.startsWith("Arrow")) return;
    const act = this.action(e);
    if (!act) return;
    e.preventDefault();
    act();
  }

  action(e) {
    const v = this.viewer, st = v.state, arrow = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]}[e.key];
    if (e.key === "?") return openHelp;
    if (e.key === "t" || e.key === "T") return switchTheme;
    if (!v.loaded) return null;
    if (arrow) return () => this.arrow(arrow, e);
    if (e.altKey) return null;
    const cycle = (list, value, step) => list[(list.indexOf(value) + step + list.length) % list.length];
    const sources = v.sources().map(o => o.value), step = e.shiftKey ? -1 : 1;
    const exposure = d => v.set({exposure: clamp(st.exposure + d, EXPOSURES.low, EXPOSURES.high)});
    const actions = {
      " ": () => v.flip(),
      w: () => v.set({mode: "wipe"}), f: () => v.set({mode: "flip"}), s: () => v.set({mode: "side"}),
      "+": () => v.zoomBy(Math.SQRT2), "=": () => v.zoomBy(Math.SQRT2), "-": () => v.zoomBy(1 / Math.SQRT2),
      0: () => v.fit(), 1: () => v.zoomTo(1),
      "[": () => exposure(-EXPOSURES.step), "]": () => exposure(EXPOSURES.step), e: () => v.set({exposure: 0}),
      h: () => v.set({overlay: cycle(v.overlays().map(o => o.value), st.overlay, step)}),
      a: () => v.set({a: cycle(sources, st.a, step)}), b: () => v.set({b: cycle(sources, st.b, step)}),
      x: () => v.swap(),
      ",": () => v.set({frame: Math.max(st.frame - 1, 0)}),
      ".": () => v.set({frame: Math.min(st.frame + 1, v.held.length - 1)}),
      v: () => v.set({display: cycle([...v.selectDisplay.options].map(o => o.value), st.display, 1)}),
      escape: () => { this.keyboardPixel = false; v.set({pixel: null, pinned: false}); }
    };
    return actions[e.key.toLowerCase()];
  }

  arrow([dx, dy], e) {
    const v = this.viewer, st = v.state;
    if (e.altKey) {
      const image = v.loaded.pictures[0].image, by = e.shiftKey ? 10 : 1;
      const from = st.pixel || [Math.floor(image.width / 2), Math.floor(image.height / 2)], go = st.pixel ? by : 0;
      this.keyboardPixel = true;
      v.set({pinned: true, pixel: [clamp(from[0] + dx * go, 0, image.width - 1), clamp(from[1] + dy * go, 0, image.height - 1)]});
      say(v.readout.place.textContent);
    } else if (dx && st.mode === "wipe" && (e.target === v.handle || !e.shiftKey)) {
      v.set({wipe: clamp(st.wipe + dx * (e.shiftKey ? 0.1 : 0.01), 0, 1)});
    } else {
      const far = 0.1 * v.canvas.height;
      v.panBy(-dx * far, -dy * far);
    }
  }
}
