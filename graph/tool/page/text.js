/* Elements, numbers, names. Texts reach the page as text nodes only: nothing from a pipeline is ever markup. */

const byId = id => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes || {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "style") for (const [k, v] of Object.entries(value)) element.style.setProperty(k, v);
    else element.setAttribute(name, value === true ? "" : value);
  }
  for (const child of children.flat(Infinity))
    if (child !== null && child !== undefined && child !== false)
      element.append(child instanceof Node ? child : String(child));
  return element;
}

/* h("p", {class: "note"}, "text", other) */
const h = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
const s = (tag, attributes, ...children) => fill(document.createElementNS(SVG, tag), attributes, children);

const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
const MINUS = "\u2212", THIN = "\u2009", DASH = "\u2013", NONE = "\u2014";

/* Three significant digits, without an exponent where that is readable. null: NONE. */
function number(x, digits = 3) {
  if (x === null || x === undefined || Number.isNaN(x)) return NONE;
  if (!Number.isFinite(x)) return x < 0 ? MINUS + "\u221e" : "\u221e";
  const size = Math.abs(x);
  let text;
  if (size === 0) text = "0";
  else if (size >= 1e6 || size < 1e-4) text = x.toExponential(Math.min(digits - 1, 1)).replace("e+", "e");
  else text = x.toFixed(clamp(digits - 1 - Math.floor(Math.log10(size)), 0, 8));
  return text.replace(/-/g, MINUS);
}

/* A fixed number of decimals, for columns of pixels. */
const fixed = (x, n) => (x === null || !Number.isFinite(x) ? NONE : x.toFixed(n).replace(/^-(?=[0.]*$)/, "").replace("-", MINUS));

const METRIC_NAMES = {flip: "FLIP", hdrflip: "HDR-FLIP", psnr: "PSNR", ssim: "SSIM", rmse: "RMSE", max: "Max diff"};
const METRIC_UNITS = {psnr: "dB"};
const METRIC_HELP = {
  flip: "perceived difference of the display images, 0 to 1 (Andersson et al. 2020)",
  hdrflip: "perceived difference over a range of exposures, 0 to 1 (Andersson et al. 2021)",
  psnr: "peak signal to noise ratio of the display images, dB; larger is more alike",
  ssim: "structural similarity of the display images (Wang et al. 2004); larger is more alike",
  rmse: "root of the mean squared difference, scene-linear",
  max: "largest difference of a channel, scene-linear"
};
const metricName = m => METRIC_NAMES[m] || m;
/* Larger is more alike. */
const metricRises = m => m === "psnr" || m === "ssim";
const moreDifferent = (m, a, b) => (metricRises(m) ? a < b : a > b);

const plural = (n, one, many) => `${n}\u00a0${n === 1 ? one : many || one + "s"}`;
const materialName = m => (m === null ? "all materials" : m === "" ? "no material" : m);

/* A relative path, or one from the root, as the address of a link; never another scheme. */
function pathUrl(path) {
  const url = path.split("/").map(encodeURIComponent).join("/");
  return path.startsWith("/") ? "file://" + url : "./" + url;
}

/* A table that scrolls on its own. head: texts, with '#' in front of a column of numbers. rows: cells, of which the
 * first names its row; or {cells, …} with attributes of the row. */
function table(label, head, rows, attributes) {
  const kind = i => (head[i].startsWith("#") ? "num" : null);
  const cell = (c, i) => (i ? h("td", {class: kind(i)}, c) : h("th", {scope: "row"}, c));
  return h("div", {class: "scroll", tabindex: 0, role: "region", "aria-label": label}, h("table", attributes,
    h("thead", {}, h("tr", {}, head.map((t, i) => h("th", {scope: "col", class: kind(i)}, t.replace(/^#/, ""))))),
    h("tbody", {}, rows.map(r => {
      const {cells, ...others} = Array.isArray(r) ? {cells: r} : r;
      return h("tr", others, cells.map(cell));
    }))));
}

/* Bars beside names. list: [{name, share (0 … 1 or null), value, class, color, title, limit (a share), about, mark}] */
function bars(title, unit, list) {
  const percent = x => clamp(x, 0, 1) * 100 + "%";
  const track = b => h("span", {class: "track"},
    b.share === null ? null : h("span", {class: "fill " + (b.class || ""), style: {width: percent(b.share), ...(b.color ? {"--c": b.color} : {})}}),
    typeof b.limit === "number" ? h("span", {class: "limit", style: {left: percent(b.limit)}, title: b.about}) : null);
  return h("figure", {class: "multiple bars"},
    h("figcaption", title.help ? {title: title.help} : {}, title.text || title, unit ? h("small", {}, " " + unit) : null),
    h("dl", {}, list.map(b => [h("dt", {title: b.title}, b.name), h("dd", {}, track(b), h("span", {class: "value"}, b.value))])));
}

const control = (label, id, element) => h("div", {class: "control"}, h("label", {for: id}, label), element);

let liveTimer = 0;
/* Said to those who do not see the picture. */
function say(text) {
  clearTimeout(liveTimer);
  liveTimer = setTimeout(() => { byId("live").textContent = text; }, 150);
}

function select(attributes, options, value, change) {
  const element = h("select", attributes, options.map(o =>
    o.options ? h("optgroup", {label: o.label}, o.options.map(p => h("option", {value: p.value}, p.label)))
              : h("option", {value: o.value}, o.label)));
  element.value = String(value);
  element.addEventListener("change", () => change(element.value));
  return element;
}

/* Buttons of which one is pressed. */
function segmented(label, options, value, change) {
  const group = h("div", {class: "segmented", role: "group", "aria-label": label});
  const set = v => { for (const b of group.children) b.setAttribute("aria-pressed", String(b.dataset.value === v)); };
  for (const o of options)
    group.append(h("button", {type: "button", "data-value": o.value, title: o.title,
                              onclick: () => { set(o.value); change(o.value); }}, o.label));
  set(value);
  group.set = set;
  return group;
}

/* The system's choice until somebody chooses. */
function switchTheme() {
  const root = document.documentElement, system = matchMedia("(prefers-color-scheme: dark)").matches;
  const dark = root.dataset.theme ? root.dataset.theme === "dark" : system;
  root.dataset.theme = dark ? "light" : "dark";
  byId("theme").setAttribute("aria-label", `Theme: ${root.dataset.theme}`);
}
