/* What a renderer of the viewer is asked to draw. Both renderers (WebGL 2, 2-D canvas) take the same scene:
 *   width, height   of the canvas, device pixels
 *   panes           [{x, width, split, left, right}]: device pixels; `split` in device pixels of the canvas, left of
 *                   it is picture `left`, else `right`
 *   pictures        [{image, display}]: a decoded block of halves, and what displayFor gave
 *   scale           device pixels a pixel of the image
 *   centre          [x, y] of the image in the middle of a pane
 *   exposure        stops
 *   overlay         null or {map, opacity}: a decoded block of 8 bits, or "difference" */

/* Behind the picture: neutral in light and dark, for it changes how a picture is seen. */
const BACKDROP = [46, 46, 46];

/* The picture's pixel under a point of the canvas, and back. */
function imagePoint(scene, pane, x, y) {
  return [(x - pane.x - pane.width / 2) / scene.scale + scene.centre[0],
          (y - scene.height / 2) / scene.scale + scene.centre[1]];
}

function canvasPoint(scene, pane, x, y) {
  return [(x - scene.centre[0]) * scene.scale + pane.x + pane.width / 2,
          (y - scene.centre[1]) * scene.scale + scene.height / 2];
}

/* How a difference of two colours becomes 0 … 1 of the heat map: the largest difference of a channel, exposed. */
const differenceHeat = (a, b, gain) =>
  clamp(Math.max(Math.abs(a[0] - b[0]), Math.abs(a[1] - b[1]), Math.abs(a[2] - b[2])) * gain, 0, 1);

function makeLook(canvas, heat, force2d) {
  if (!force2d) {
    const look = LookGL.make(canvas, heat);
    if (look) return look;
  }
  return new Look2D(canvas, heat);
}
