/* Blocks of numbers: base64, raw deflate, bytes in planes, differences (ab_page_pack.c). */

function base64Bytes(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const raw = atob(text), out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
  return out;
}

async function inflate(bytes, size) {
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw")).getReader();
  const out = new Uint8Array(size);
  let at = 0;
  for (;;) {
    const {done, value} = await reader.read();
    if (done) break;
    out.set(value, at);
    at += value.length;
  }
  if (at !== size) throw new Error("a block of the page is damaged");
  return out;
}

function undo8(coded, {planes, width, height}) {
  for (let row = 0; row < planes * height; row++) {
    const at = row * width;
    let v = row % height ? coded[at - width] : 0;
    for (let x = at; x < at + width; x++) coded[x] = v = (v + coded[x]) & 255;
  }
  return coded;
}

function undo16(coded, {planes, width, height}) {
  const n = width * height, out = new Uint16Array(planes * n);
  for (let row = 0; row < planes * height; row++) {
    const at = row * width, low = at + planes * n;
    let v = row % height ? out[at - width] : 0;
    for (let x = 0; x < width; x++) {
      const z = coded[at + x] << 8 | coded[low + x];
      out[at + x] = v = (v + (z >> 1 ^ -(z & 1))) & 65535;
    }
  }
  return out;
}

/* Decoded blocks, the least recently used go first. */
const decoded = new Map();
const DECODED_BYTES = 512 << 20;
let decodedBytes = 0;

function trim() {
  for (const [id, entry] of decoded) {
    if (decodedBytes <= DECODED_BYTES || decoded.size <= 4) break;
    decoded.delete(id);
    decodedBytes -= entry.size;
  }
}

async function decodeBlock(block) {
  const size = block.planes * block.width * block.height * block.bits / 8;
  const coded = await inflate(base64Bytes(byId("block-" + block.id).textContent), size);
  const data = block.bits === 8 ? undo8(coded, block) : undo16(coded, block);
  if (block.base !== undefined) { /* a difference to another block, which wraps around like that one's numbers */
    const base = (await loadBlock({...block, id: block.base, base: undefined})).data;
    for (let i = 0; i < data.length; i++) data[i] += base[i];
  }
  return {...block, data};
}

/* The numbers of a block: a promise of {data, planes, width, height, …}. */
function loadBlock(block) {
  let entry = decoded.get(block.id);
  if (entry) {
    decoded.delete(block.id);
  } else {
    entry = {promise: decodeBlock(block), size: block.planes * block.width * block.height * block.bits / 8};
    decodedBytes += entry.size;
  }
  decoded.set(block.id, entry);
  trim();
  return entry.promise;
}

/* Values of half floats by their bits. */
const HALVES = (() => {
  const table = new Float32Array(65536);
  for (let h = 0; h < 65536; h++) {
    const exponent = h >> 10 & 31, mantissa = h & 1023, sign = h & 32768 ? -1 : 1;
    table[h] = exponent === 31 ? (mantissa ? NaN : sign * Infinity)
             : exponent ? sign * 2 ** (exponent - 15) * (1 + mantissa / 1024) : sign * mantissa * 2 ** -24;
  }
  return table;
})();
