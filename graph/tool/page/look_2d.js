/* Pictures by a 2-D canvas, where WebGL 2 is missing: the same colours, computed here. A picture is made once for
 * its exposure and display, then placed. */

class Look2D {
  constructor(canvas, heat) {
    this.name = "2-D canvas";
    this.canvas = canvas;
    this.context = canvas.getContext("2d", {alpha: false});
    this.heat = heat;
    this.made = new Map(); /* by a key: canvases */
  }

  /* A canvas of the image's size whose pixels `paint` sets. */
  make(key, width, height, paint) {
    const found = this.made.get(key);
    if (found) this.made.delete(key);
    const canvas = found || h("canvas", {width, height});
    if (!found) {
      const context = canvas.getContext("2d"), image = context.createImageData(width, height);
      paint(image.data);
      context.putImageData(image, 0, 0);
    }
    this.made.set(key, canvas);
    for (const old of this.made.keys()) {
      if (this.made.size <= 6) break;
      this.made.delete(old);
    }
    return canvas;
  }

  picture({image, display}, exposure) {
    const key = `${image.id} ${display.lut ? display.lut.id : "srgb"} ${exposure}`;
    return this.make(key, image.width, image.height, out => {
      const n = image.width * image.height, gain = 2 ** exposure, rgb = [0, 0, 0], d = image.data;
      for (let i = 0; i < n; i++) {
        display.apply(HALVES[d[i]] * gain, HALVES[d[n + i]] * gain, HALVES[d[2 * n + i]] * gain, rgb);
        for (let c = 0; c < 3; c++) out[4 * i + c] = Math.round(rgb[c] * 255);
        out[4 * i + 3] = 255;
      }
    });
  }

  heatPicture(width, height, key, value) {
    return this.make(key, width, height, out => {
      for (let i = 0; i < width * height; i++) {
        const t = 3 * Math.round(value(i) * 255);
        for (let c = 0; c < 3; c++) out[4 * i + c] = this.heat[t + c];
        out[4 * i + 3] = 255;
      }
    });
  }

  overlayPicture(scene) {
    const {map} = scene.overlay, [a, b] = scene.pictures.map(p => p.image);
    if (map !== "difference")
      return this.heatPicture(map.width, map.height, "map " + map.id, i => map.data[i] / 255);
    const n = a.width * a.height, gain = 2 ** scene.exposure;
    const at = (image, i) => [0, 1, 2].map(c => HALVES[image.data[c * n + i]]);
    return this.heatPicture(a.width, a.height, `difference ${a.id} ${b.id} ${scene.exposure}`,
                            i => differenceHeat(at(a, i), at(b, i), gain));
  }

  /* Draws a picture where it belongs, between two columns of the canvas. */
  place(scene, pane, picture, from, to, alpha) {
    const c = this.context, [x, y] = canvasPoint(scene, pane, 0, 0);
    if (to <= from) return;
    c.save();
    c.beginPath();
    c.rect(from, 0, to - from, scene.height);
    c.clip();
    c.globalAlpha = alpha;
    c.imageSmoothingEnabled = scene.scale < 1;
    c.imageSmoothingQuality = "high";
    c.drawImage(picture, x, y, picture.width * scene.scale, picture.height * scene.scale);
    c.restore();
  }

  draw(scene) {
    const c = this.context;
    c.fillStyle = `rgb(${BACKDROP})`;
    c.fillRect(0, 0, scene.width, scene.height);
    for (const pane of scene.panes) {
      const end = pane.x + pane.width, split = clamp(pane.split, pane.x, end);
      if (split > pane.x) this.place(scene, pane, this.picture(scene.pictures[0], scene.exposure), pane.x, split, 1);
      if (split < end) this.place(scene, pane, this.picture(scene.pictures[1], scene.exposure), split, end, 1);
      if (scene.overlay)
        this.place(scene, pane, this.overlayPicture(scene), pane.x, end, scene.overlay.opacity);
    }
  }
}
