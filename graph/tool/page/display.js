/* From scene-linear Rec. 709 to what is shown: the pipeline's display as a table (ab_page_lut.c), or plain sRGB. */

const srgbEncode = x => (x <= 0.0031308 ? 12.92 * Math.max(x, 0) : 1.055 * Math.pow(x, 1 / 2.4) - 0.055);

/* Axis of a table, in entries. */
function lutAxis(lut) {
  const t = x => Math.sign(x) * Math.log2(1 + Math.abs(x) / lut.knee);
  const first = t(lut.first), scale = (lut.n - 1) / (t(lut.last) - first);
  return x => clamp((t(x) - first) * scale, 0, lut.n - 1);
}

/* A function (r, g, b, out): exposed scene-linear to encoded, 0 … 1. `entries`: of the table. */
function lutFunction(lut, entries) {
  const n = lut.n, total = n * n * n, axis = lutAxis(lut), scale = (lut.high - lut.low) / 65535;
  const step = [n * n, n, 1], f = [0, 0, 0];
  return (r, g, b, out) => {
    let at = 0;
    for (let c = 0; c < 3; c++) {
      const t = axis(c === 0 ? r : c === 1 ? g : b), cell = Math.min(Math.floor(t), n - 2);
      f[c] = t - cell;
      at += cell * step[c];
    }
    const large = f[0] >= f[1] ? (f[0] >= f[2] ? 0 : 2) : (f[1] >= f[2] ? 1 : 2);
    const small = f[0] < f[1] ? (f[0] < f[2] ? 0 : 2) : (f[1] < f[2] ? 1 : 2);
    const middle = 3 - large - small;
    const one = step[large], two = one + step[middle], all = step[0] + step[1] + step[2];
    for (let c = 0; c < 3; c++) {
      const e = c * total + at;
      const v = (1 - f[large]) * entries[e] + (f[large] - f[middle]) * entries[e + one] +
                (f[middle] - f[small]) * entries[e + two] + f[small] * entries[e + all];
      out[c] = clamp(lut.low + scale * v, 0, 1);
    }
  };
}

function srgbFunction(r, g, b, out) {
  out[0] = clamp(srgbEncode(r), 0, 1);
  out[1] = clamp(srgbEncode(g), 0, 1);
  out[2] = clamp(srgbEncode(b), 0, 1);
}

/* What state.display asks for, for a variant (-1: the reference, shown as the first variant is, or as it was
 * encoded): a promise of {lut, entries, apply}; lut null for sRGB. */
async function displayFor(page, frame, name, variant) {
  if (variant < 0 && frame.encoded) name = "srgb"; /* it was never scene-linear */
  if (name !== "pipeline" || !page.displays.length) return {lut: null, entries: null, apply: srgbFunction};
  const lut = page.displays[page.displayOf[Math.max(variant, 0)]];
  if (!lut.apply) {
    const block = await loadBlock({id: lut.id, bits: 16, planes: 3, width: lut.n, height: lut.n * lut.n});
    lut.entries = block.data;
    lut.apply = lutFunction(lut, block.data);
  }
  return lut.apply && {lut, entries: lut.entries, apply: lut.apply};
}
