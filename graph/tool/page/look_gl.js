/* Pictures by WebGL 2: half floats in textures, without filtering; the display's table likewise, evaluated as
 * display.js does it. */

const VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0, 1); }`;

const FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler3D;
uniform sampler2D leftImage, rightImage, map, heat;
uniform sampler3D leftTable, rightTable;
uniform ivec2 leftSize, rightSize;
uniform vec4 leftAxis, rightAxis; /* knee, first, scale, entries; entries 0: sRGB */
uniform vec2 leftRange, rightRange; /* low, high */
uniform float paneX, paneWidth, height, scale, split, gain, opacity;
uniform vec2 centre;
uniform int overlay; /* 0 none, 1 map, 2 difference */
uniform vec3 backdrop;
out vec4 color;

vec3 axis(vec3 x, vec4 a) {
  vec3 t = sign(x) * log2(1.0 + abs(x) / a.x);
  return clamp((t - a.y) * a.z, 0.0, a.w - 1.0);
}

/* The corner of a tetrahedron along axis i. */
ivec3 unit(int i) { return ivec3(i == 0, i == 1, i == 2); }

vec3 table(sampler3D entries, vec4 a, vec2 range, vec3 x) {
  vec3 t = axis(x, a), cell = min(floor(t), a.w - 2.0), f = t - cell;
  ivec3 at = ivec3(cell);
  int large = f.r >= f.g ? (f.r >= f.b ? 0 : 2) : (f.g >= f.b ? 1 : 2);
  int small = f.r < f.g ? (f.r < f.b ? 0 : 2) : (f.g < f.b ? 1 : 2);
  int middle = 3 - large - small;
  ivec3 one = at + unit(large), two = one + unit(middle);
  /* The texture's axes are blue, green, red. */
  vec3 v = (1.0 - f[large]) * texelFetch(entries, at.bgr, 0).rgb +
           (f[large] - f[middle]) * texelFetch(entries, one.bgr, 0).rgb +
           (f[middle] - f[small]) * texelFetch(entries, two.bgr, 0).rgb +
           f[small] * texelFetch(entries, (at + 1).bgr, 0).rgb;
  return clamp(range.x + (range.y - range.x) * v, 0.0, 1.0);
}

vec3 srgb(vec3 x) {
  x = max(x, 0.0);
  return clamp(mix(1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, 12.92 * x, lessThanEqual(x, vec3(0.0031308))), 0.0, 1.0);
}

vec3 shown(sampler3D entries, vec4 a, vec2 range, vec3 x) {
  return a.w > 0.0 ? table(entries, a, range, x) : srgb(x);
}

/* Mean of the image's pixels under a pixel of the canvas: one where it is not made smaller. */
vec3 linear(sampler2D image, ivec2 size, vec2 p, float reach) {
  if (reach <= 1.0) return texelFetch(image, clamp(ivec2(floor(p)), ivec2(0), size - 1), 0).rgb;
  int n = int(min(ceil(reach), 8.0));
  vec3 sum = vec3(0);
  for (int y = 0; y < n; y++)
    for (int x = 0; x < n; x++) {
      vec2 q = p + ((vec2(x, y) + 0.5) / float(n) - 0.5) * reach;
      sum += texelFetch(image, clamp(ivec2(floor(q)), ivec2(0), size - 1), 0).rgb;
    }
  return sum / float(n * n);
}

void main() {
  vec2 at = vec2(gl_FragCoord.x, height - gl_FragCoord.y);
  vec2 p = (at - vec2(paneX + 0.5 * paneWidth, 0.5 * height)) / scale + centre;
  bool isLeft = at.x < split;
  ivec2 size = isLeft ? leftSize : rightSize;
  if (any(lessThan(p, vec2(0))) || any(greaterThanEqual(p, vec2(size)))) {
    color = vec4(backdrop, 1);
    return;
  }
  float reach = 1.0 / scale;
  vec3 l = vec3(0), r = vec3(0), c;
  if (isLeft || overlay == 2) l = linear(leftImage, leftSize, p, reach) * gain;
  if (!isLeft || overlay == 2) r = linear(rightImage, rightSize, p, reach) * gain;
  if (isLeft) c = shown(leftTable, leftAxis, leftRange, l);
  else c = shown(rightTable, rightAxis, rightRange, r);
  if (overlay != 0) {
    vec3 d = abs(l - r);
    float t = overlay == 1 ? linear(map, textureSize(map, 0), p, reach).r : clamp(max(d.r, max(d.g, d.b)), 0.0, 1.0);
    c = mix(c, texelFetch(heat, ivec2(int(t * 255.0 + 0.5), 0), 0).rgb, opacity);
  }
  color = vec4(c, 1);
}`;

const UNITS = ["leftImage", "rightImage", "map", "heat", "leftTable", "rightTable"];

class LookGL {
  static make(canvas, heat) {
    const gl = canvas.getContext("webgl2", {alpha: false, antialias: false, preserveDrawingBuffer: true});
    if (!gl) return null;
    try {
      return new LookGL(canvas, gl, heat);
    } catch (error) {
      console.info("relit: WebGL 2 is there but refuses: " + error.message);
      return null;
    }
  }

  constructor(canvas, gl, heat) {
    this.name = "WebGL 2";
    this.canvas = canvas;
    this.gl = gl;
    this.textures = new Map(); /* by block: halves and maps */
    this.build();
    this.heat = this.texture(gl.TEXTURE_2D, t => gl.texImage2D(t, 0, gl.RGB8, heat.length / 3, 1, 0, gl.RGB,
                                                                gl.UNSIGNED_BYTE, new Uint8Array(heat)));
    this.empty = this.texture(gl.TEXTURE_2D, t => gl.texImage2D(t, 0, gl.R8, 1, 1, 0, gl.RED, gl.UNSIGNED_BYTE,
                                                                 new Uint8Array(1)));
    this.emptyTable = this.texture(gl.TEXTURE_3D, t => gl.texImage3D(t, 0, gl.R8, 1, 1, 1, 0, gl.RED,
                                                                      gl.UNSIGNED_BYTE, new Uint8Array(1)));
    canvas.addEventListener("webglcontextlost", e => e.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => { this.restore(heat); });
  }

  restore(heat) {
    const again = this.onrestore;
    Object.assign(this, new LookGL(this.canvas, this.gl, heat), {onrestore: again});
    if (again) again();
  }

  build() {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    this.at = new Proxy({}, {get: (cache, name) => cache[name] ||= gl.getUniformLocation(program, name)});
    UNITS.forEach((name, unit) => gl.uniform1i(this.at[name], unit));
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.largest = gl.getParameter(gl.MAX_TEXTURE_SIZE);
  }

  texture(target, upload) {
    const gl = this.gl, texture = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + UNITS.length); /* one that is not drawn from: making must not unbind */
    gl.bindTexture(target, texture);
    for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.NEAREST], [gl.TEXTURE_MAG_FILTER, gl.NEAREST],
                                 [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]])
      gl.texParameteri(target, name, value);
    upload(target);
    return texture;
  }

  /* A texture a block; a few are kept. */
  blockTexture(block, upload) {
    const found = this.textures.get(block.id);
    if (found) this.textures.delete(block.id);
    const texture = found || upload();
    this.textures.set(block.id, texture);
    for (const [id, old] of this.textures) {
      if (this.textures.size <= 8) break;
      this.textures.delete(id);
      this.gl.deleteTexture(old);
    }
    return texture;
  }

  imageTexture(block) {
    const gl = this.gl;
    return this.blockTexture(block, () => {
      const n = block.width * block.height, rgba = new Uint16Array(4 * n);
      for (let i = 0; i < n; i++) {
        rgba[4 * i] = block.data[i];
        rgba[4 * i + 1] = block.data[n + i];
        rgba[4 * i + 2] = block.data[2 * n + i];
      }
      return this.texture(gl.TEXTURE_2D, t => gl.texImage2D(t, 0, gl.RGBA16F, block.width, block.height, 0, gl.RGBA,
                                                            gl.HALF_FLOAT, rgba));
    });
  }

  mapTexture(block) {
    const gl = this.gl;
    return this.blockTexture(block, () =>
      this.texture(gl.TEXTURE_2D, t => gl.texImage2D(t, 0, gl.R8, block.width, block.height, 0, gl.RED,
                                                     gl.UNSIGNED_BYTE, block.data)));
  }

  tableTexture(display) {
    const gl = this.gl, n = display.lut.n, total = n * n * n;
    return this.blockTexture({id: "table " + display.lut.id}, () => {
      const rgba = new Float32Array(4 * total);
      for (let i = 0; i < total; i++)
        for (let c = 0; c < 3; c++) rgba[4 * i + c] = display.entries[c * total + i] / 65535;
      return this.texture(gl.TEXTURE_3D, t => gl.texImage3D(t, 0, gl.RGBA32F, n, n, n, 0, gl.RGBA, gl.FLOAT, rgba));
    });
  }

  bind(unit, target, texture) {
    this.gl.activeTexture(this.gl.TEXTURE0 + unit);
    this.gl.bindTexture(target, texture);
  }

  /* One side: "left" or "right". */
  setPicture(side, picture) {
    const gl = this.gl, at = this.at, {lut} = picture.display;
    const table = lut ? this.tableTexture(picture.display) : this.emptyTable;
    const image = this.imageTexture(picture.image), unit = side === "left" ? 0 : 1;
    this.bind(unit, gl.TEXTURE_2D, image);
    this.bind(4 + unit, gl.TEXTURE_3D, table);
    gl.uniform2i(at[side + "Size"], picture.image.width, picture.image.height);
    if (!lut) {
      gl.uniform4f(at[side + "Axis"], 1, 0, 1, 0);
      return;
    }
    const t = x => Math.sign(x) * Math.log2(1 + Math.abs(x) / lut.knee), first = t(lut.first);
    gl.uniform4f(at[side + "Axis"], lut.knee, first, (lut.n - 1) / (t(lut.last) - first), lut.n);
    gl.uniform2f(at[side + "Range"], lut.low, lut.high);
  }

  draw(scene) {
    const gl = this.gl, at = this.at, overlay = scene.overlay;
    const map = overlay && overlay.map !== "difference" ? this.mapTexture(overlay.map) : this.empty;
    this.setPicture("left", scene.pictures[0]);
    this.setPicture("right", scene.pictures[1]);
    this.bind(2, gl.TEXTURE_2D, map);
    this.bind(3, gl.TEXTURE_2D, this.heat);
    gl.uniform1f(at.height, scene.height);
    gl.uniform1f(at.scale, scene.scale);
    gl.uniform2f(at.centre, scene.centre[0], scene.centre[1]);
    gl.uniform1f(at.gain, 2 ** scene.exposure);
    gl.uniform1f(at.opacity, overlay ? overlay.opacity : 0);
    gl.uniform1i(at.overlay, overlay ? (overlay.map === "difference" ? 2 : 1) : 0);
    gl.uniform3f(at.backdrop, ...BACKDROP.map(v => v / 255));
    gl.viewport(0, 0, scene.width, scene.height);
    gl.enable(gl.SCISSOR_TEST);
    for (const pane of scene.panes) {
      gl.scissor(pane.x, 0, pane.width, scene.height);
      gl.uniform1f(at.paneX, pane.x);
      gl.uniform1f(at.paneWidth, pane.width);
      gl.uniform1f(at.split, pane.split);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    gl.disable(gl.SCISSOR_TEST);
  }
}
