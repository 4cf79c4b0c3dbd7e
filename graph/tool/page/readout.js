/* One pixel in numbers: scene-linear, as shown, and the metrics' maps. */

class Readout {
  constructor(viewer) {
    this.viewer = viewer;
    this.place = h("p", {class: "place"});
    this.body = h("tbody");
    const head = t => h("th", {scope: "col"}, t);
    this.element = h("div", {id: "readout", class: "readout"}, this.place,
      h("div", {class: "scroll"}, h("table", {}, h("caption", {class: "hidden"}, "Values of the pixel"),
        h("thead", {}, h("tr", {}, h("td"), ["R", "G", "B"].map(c => head("linear " + c)),
                         ["R", "G", "B"].map(c => head("shown " + c)))), this.body)));
    this.rows = ["A", "B", "B \u2212 A"].map((name, i) => {
      const cells = Array.from({length: 6}, () => h("td", {}, NONE));
      this.body.append(h("tr", {class: "row-" + "abd"[i]}, h("th", {scope: "row"}, name), cells));
      return cells;
    });
  }

  /* {linear, shown} of a picture at a pixel; shown in steps of 8 bits. */
  values({image, display}, x, y) {
    const n = image.width * image.height, i = y * image.width + x, gain = 2 ** this.viewer.state.exposure;
    const linear = [0, 1, 2].map(c => HALVES[image.data[c * n + i]]), shown = [0, 0, 0];
    display.apply(linear[0] * gain, linear[1] * gain, linear[2] * gain, shown);
    return {linear, shown: shown.map(v => Math.round(v * 255))};
  }

  show() {
    const v = this.viewer, pixel = v.state.pixel, f = v.frame;
    if (!pixel) {
      this.place.textContent = "Point at a pixel to read it; a click pins it (Alt and arrow keys move the pin).";
      for (const cell of this.rows.flat()) cell.textContent = NONE;
      return;
    }
    const [x, y] = pixel, {pictures, ids, maps} = v.loaded, capture = v.metrics.captures[f.capture] || {};
    const [a, b] = pictures.map(p => this.values(p, x, y)), i = y * pictures[0].image.width + x;
    const parts = [`x ${x + f.x}, y ${y + f.y}`];
    if (ids) {
      const id = ids.data[i];
      parts.push((capture.materials && capture.materials[id]) || (id ? `material ${id}` : "no material"));
    }
    for (const metric of ["flip", "hdrflip"])
      if (maps[metric]) parts.push(`${metricName(metric)} ${fixed(maps[metric].data[i] / 255, 3)}`);
    this.place.textContent = parts.join("   \u00b7   ") + (v.state.pinned ? "   \u00b7   pinned" : "");
    for (let c = 0; c < 3; c++) {
      [a, b].forEach((side, k) => {
        this.rows[k][c].textContent = number(side.linear[c], 4);
        this.rows[k][3 + c].textContent = side.shown[c];
      });
      this.rows[2][c].textContent = number(b.linear[c] - a.linear[c], 3);
      this.rows[2][3 + c].textContent = String(b.shown[c] - a.shown[c]).replace("-", MINUS);
    }
  }
}
