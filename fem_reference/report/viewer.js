// The 3D view of the page: unpacks the frames that viewer.py packed and draws every run with the same camera.
const data = JSON.parse(document.getElementById("viewer-data").textContent);
const part = (name) => document.getElementById(`viewer-${name}`);
const FIELD = 18; // vertical field of view [degrees], small, so that the projection is nearly parallel
const PLAY_RATE = 8; // frames a second
const KEY_TURN = Math.PI / 24, KEY_MOVE = 20, KEY_ZOOM = 0.9;
const MUSCLE = "#b4574e", BONE = "#dedbd4", UNKNOWN = "#85878d", SEEN_THROUGH = 0.28;
const dark = window.matchMedia("(prefers-color-scheme: dark)");

{% include "viewer_scale.js" %}
{% include "viewer_marks.js" %}

async function unpacked(text) {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

// The library's files import each other by name; here each name becomes the address of a blob in the page's memory.
async function library(files) {
  const source = async (name) => new TextDecoder().decode(await unpacked(files[name]));
  const address = (text) => URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  const core = address(await source("three.core.min.js"));
  const main = address((await source("three.module.min.js")).replaceAll("./three.core.min.js", core));
  const controls = address((await source("OrbitControls.js")).replace("from 'three'", `from '${main}'`));
  return { ...(await import(main)), ...(await import(controls)) };
}

// Integers (frames, vertices, 3), from differences from the previous frame, zigzag, low bytes before high bytes.
async function wholeNumbers(text, frames) {
  const bytes = new Uint8Array(await unpacked(text));
  const count = bytes.length / 2, stride = count / frames;
  const values = new Uint16Array(count);
  for (let i = 0; i < count; i++) {
    const zigzag = bytes[i] | (bytes[count + i] << 8);
    const step = (zigzag >>> 1) ^ -(zigzag & 1);
    values[i] = i < stride ? step : values[i - stride] + step; // wraps at 65536, as the differences did
  }
  return values;
}

function sorry(error) {
  part("sorry").textContent = `No 3D view (${error.message}). It needs WebGL 2; the pictures below show the same without it.`;
  return null;
}

// ---- The scene

async function assembled() {
  const renderer = new three.WebGLRenderer({ canvas: part("canvas"), antialias: true });
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  renderer.setScissorTest(true);
  const scene = new three.Scene(), camera = new three.PerspectiveCamera(FIELD);
  camera.up.set(0, 0, 1);
  const lamp = new three.DirectionalLight("#ffffff", 2.6);
  lamp.position.set(-0.3, 0.4, 1);
  camera.add(lamp);
  scene.add(camera, new three.AmbientLight("#ffffff", 0.9));
  const faces = new three.BufferAttribute(new Uint32Array(await unpacked(data.triangles)), 1);
  const runs = await Promise.all(data.runs.map((run) => muscle(run, faces)));
  const bones = await Promise.all(data.bones.map(bone));
  const ghost = new three.Mesh(runs[0].mesh.geometry, look("#000000", { transparent: true, opacity: 0.25, depthWrite: false }));
  ghost.renderOrder = 1;
  scene.add(...runs.flatMap((run) => [run.mesh, run.strands.mesh, run.arrows, ...run.marks.all]), ...bones.map((each) => each.mesh), ghost);
  const controls = new three.OrbitControls(camera, renderer.domElement);
  controls.enableZoom = false; // until the picture has the focus; otherwise nobody could scroll past it
  renderer.domElement.style.touchAction = "pan-y";
  return { renderer, scene, camera, controls, runs, bones, ghost, frame: 0, top: data.quantities[0]?.top ?? 0, radius: reach(runs, bones), drawing: 0, playing: 0 };
}

function look(colour, more = {}) {
  return new three.MeshLambertMaterial({ color: colour, side: three.DoubleSide, ...more });
}

async function muscle(run, faces) {
  const whole = await wholeNumbers(run.positions, data.frames.length);
  const stride = whole.length / data.frames.length;
  const geometry = new three.BufferGeometry();
  geometry.setIndex(faces);
  for (const name of ["position", "color"]) geometry.setAttribute(name, new three.BufferAttribute(new Float32Array(stride), 3));
  const behind = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }; // the surface lies behind its marks
  const mesh = new three.Mesh(geometry, look(MUSCLE, behind));
  mesh.frustumCulled = false;
  const packed = await Promise.all(Object.entries(run.levels).map(async ([name, text]) => [name, await levels(text)]));
  const own = { levels: Object.fromEntries(packed), strands: await fibres(run), arrows: arrows(run), marks: await marks(run, geometry), bins: new Float32Array(BINS), greatest: 0, label: label(run.name) };
  return { ...run, whole, stride, mesh, plain: mesh.material, coloured: look("#ffffff", { vertexColors: true, ...behind }), ...own };
}

async function bone(data) {
  const whole = await wholeNumbers(data.positions, 1);
  const geometry = new three.BufferGeometry();
  geometry.setIndex(new three.BufferAttribute(new Uint32Array(await unpacked(data.triangles)), 1));
  geometry.setAttribute("position", new three.BufferAttribute(Float32Array.from(whole, (value, i) => data.low[i % 3] + data.step * value), 3));
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  const mesh = new three.Mesh(geometry, look(BONE));
  mesh.matrixAutoUpdate = false;
  mesh.frustumCulled = false;
  return { mesh, poses: data.poses, plate: geometry.index.count <= PLATE };
}

function label(name) {
  const element = document.createElement("div");
  element.className = "viewer-label";
  element.append(Object.assign(document.createElement("b"), { textContent: name }), document.createElement("span"));
  part("stage").append(element);
  return element;
}

// The greatest distance [mm] of anything from the middle of the picture in any frame, for the camera's near and far planes.
function reach(runs, bones) {
  const middle = new three.Vector3(...data.camera.middle);
  const far = bones.flatMap(({ mesh, poses }) => poses.map((pose) => {
    const { center, radius } = mesh.geometry.boundingSphere;
    return center.clone().applyMatrix4(new three.Matrix4().set(...pose)).distanceTo(middle) + radius;
  }));
  const corner = new three.Vector3(...data.low);
  return Math.max(corner.distanceTo(middle) + data.step * 65535 * Math.sqrt(3), ...far);
}

// ---- A frame

const boxes = [...document.querySelectorAll("input[name=viewer-candidate]")];

function chosen() {
  return boxes.filter((box) => box.checked).map((box) => view.runs[Number(box.value)]);
}

function isOn(name) {
  return part(name)?.checked ?? false;
}

// The panes of the picture: the reference and the chosen candidates, or only the candidates, each with the reference laid over it.
function panes() {
  const candidates = chosen();
  return isOn("laid") && candidates.length ? candidates : [view.runs[0], ...candidates];
}

function show(frame) {
  view.frame = frame;
  part("slider").value = frame;
  part("slider").setAttribute("aria-valuetext", `frame ${data.frames[frame]}`);
  part("number").textContent = data.frames[frame];
  part("joint").textContent = data.joints.map(({ name, unit, values }) => `${name} ${number(values[frame])}${unit}`).join(", ");
  view.bones.forEach(({ mesh, poses }) => mesh.matrix.set(...poses[frame]));
  new Set([view.runs[0], ...panes()]).forEach(place);
  legend();
  fibreLegend();
  draw();
}

function place(run) {
  const { position, color } = run.mesh.geometry.attributes;
  const start = view.frame * run.stride;
  for (let i = 0; i < run.stride; i++) position.array[i] = data.low[i % 3] + data.step * run.whole[start + i];
  position.needsUpdate = true;
  run.mesh.geometry.computeVertexNormals();
  const chosen = quantity() ?? data.quantities[0];
  if (shades(run, chosen)) {
    colour(run, chosen, color.array);
    color.needsUpdate = true;
  }
  if (isOn("fibres")) lay(run);
  pull(run);
  touch(run);
  describe(run, chosen);
}

function describe(run, chosen) {
  const { frame, runs } = view, label = run.label.lastChild, off = run.off[frame];
  const known = run.reached[frame] && runs[0].reached[frame];
  label.className = run.reached[frame] && !off ? "" : "bad";
  label.textContent = shades(run, chosen) ? `${WORDS[chosen.name]} ${off ? "more than " : ""}${number(run.greatest)} mm` : "";
  if (off) label.textContent += `; ${off} vertices are too far away to be drawn`;
  if (!known && chosen?.name !== "depth") label.textContent = run.reached[frame] ? "no frame of the reference" : "no frame";
  if (!run.reached[frame]) label.textContent = "no frame";
  const drawn = run.mesh.geometry.attributes.position.array;
  const mean = [0, 1, 2].map((k) => (3 * drawn.reduce((sum, value, i) => sum + (i % 3 === k ? value : 0), 0)) / drawn.length);
  run.label.dataset.mean = run.reached[frame] ? mean.join(" ") : "";
}

// ---- The picture

// Up to three panes in one row, more in a square grid.
function arrange() {
  const shown = panes(), columns = shown.length <= 3 ? shown.length : Math.ceil(Math.sqrt(shown.length));
  const rows = Math.ceil(shown.length / columns), width = part("stage").clientWidth;
  const height = Math.min(width / columns, (0.8 * window.innerHeight) / rows);
  view.layout = shown.map((run, i) => ({ run, left: (i % columns) * (width / columns), top: Math.floor(i / columns) * height }));
  Object.assign(view, { width: width / columns, height, rows });
  view.controls.panSpeed = view.controls.rotateSpeed = rows; // they use the height of the whole canvas
  view.renderer.setSize(width, rows * height, false);
  part("canvas").style.height = `${rows * height}px`;
  view.runs.forEach((run) => { run.label.hidden = true; });
  view.layout.forEach(({ run, left, top }) => {
    run.label.hidden = false;
    const share = { left: left / width, top: top / (rows * height), width: 1 / columns, height: 1 / rows }; // a printed picture has another size
    Object.entries(share).forEach(([name, value]) => { run.label.style[name] = `${100 * value}%`; });
  });
  show(view.frame);
}

function draw() {
  view.drawing ||= requestAnimationFrame(() => {
    view.drawing = 0;
    drawNow(dark.matches);
  });
}

// Draw the panes now, for a dark page if ``night`` is true.
function drawNow(night) {
  const { camera, controls, radius, width, height, renderer, ghost } = view, away = controls.getDistance();
  const aside = controls.target.distanceTo(new three.Vector3(...data.camera.middle));
  renderer.setClearColor(night ? style("--paper", "#ffffff") : "#ffffff");
  ghost.material.color.set(night ? style("--ink", "#20242c") : "#20242c");
  camera.far = away + aside + radius;
  camera.near = Math.max(away - aside - radius, away / 50);
  camera.aspect = width / height;
  camera.updateProjectionMatrix();
  view.layout.forEach(pane);
}

function style(name, otherwise) {
  return getComputedStyle(part("stage")).getPropertyValue(name).trim() || otherwise;
}

// Replace the canvas by a picture for printing, as browsers do not keep the canvas for the printer.
function print() {
  drawNow(false);
  part("print").src = part("canvas").toDataURL();
}

function pane({ run, left, top }) {
  const { renderer, scene, camera, ghost, frame, runs, width, height, rows } = view;
  const bottom = rows * height - top - height, compared = run !== runs[0] && runs[0].reached[frame];
  runs.forEach((each) => {
    each.mesh.visible = each === run && run.reached[frame];
    each.arrows.visible = each.mesh.visible && isOn("forces");
    each.strands.mesh.visible = each.mesh.visible && isOn("fibres");
    showMarks(each);
  });
  view.bones.forEach(({ mesh, plate }) => {
    mesh.visible = isOn("bones");
    const within = plate || quantity()?.name === "depth"; // bones are transparent if penetration is shown, and plates always
    Object.assign(mesh.material, { transparent: within, opacity: within ? SEEN_THROUGH : 1, depthWrite: !within });
  });
  ghost.visible = isOn("laid") && compared;
  run.mesh.material = shades(run, quantity()) ? run.coloured : run.plain;
  Object.assign(run.mesh.material, { transparent: isOn("fibres"), opacity: isOn("fibres") ? SEEN_THROUGH : 1, depthWrite: !isOn("fibres") });
  renderer.setViewport(left, bottom, width, height);
  renderer.setScissor(left, bottom, width, height);
  renderer.render(scene, camera);
}

function lookFrom(direction) {
  const away = data.camera.half / Math.sin((FIELD / 2) * (Math.PI / 180));
  view.controls.target.set(...data.camera.middle);
  view.camera.position.set(...direction).multiplyScalar(away).add(view.controls.target);
  view.controls.update();
  draw();
}

// ---- Input

function listen() {
  document.getElementById("viewer").hidden = false;
  part("sorry").hidden = true;
  const { controls } = view, canvas = part("canvas");
  controls.addEventListener("change", draw);
  canvas.addEventListener("pointerdown", () => canvas.focus({ preventScroll: true }));
  canvas.addEventListener("focus", () => { controls.enableZoom = true; });
  canvas.addEventListener("blur", () => { controls.enableZoom = false; });
  canvas.addEventListener("keydown", key);
  part("slider").addEventListener("input", (event) => show(Number(event.target.value)));
  part("play").addEventListener("click", play);
  part("worst")?.addEventListener("click", () => show(worst(chosen())));
  part("front").addEventListener("click", () => lookFrom(data.camera.directions[0]));
  part("side").addEventListener("click", () => lookFrom(data.camera.directions[1]));
  part("bones").addEventListener("change", draw);
  for (const name of ["forces", "attached", "touched"]) part(name)?.addEventListener("change", draw);
  part("fibres").addEventListener("change", () => show(view.frame));
  part("laid")?.addEventListener("change", arrange);
  part("quantity")?.addEventListener("change", choose);
  part("top")?.addEventListener("input", (event) => scale(Number(event.target.value)));
  dark.addEventListener("change", draw);
  window.addEventListener("beforeprint", print);
  boxes.forEach((box) => box.addEventListener("change", arrange));
  window.addEventListener("hashchange", follow);
  new ResizeObserver(arrange).observe(part("stage"));
  view.frame = worst(chosen());
  arrange();
  if (part("quantity")) choose();
  lookFrom(data.camera.directions[0]);
  follow();
}

// The frame in which one of the runs is furthest from the reference.
function worst(runs) {
  return runs.reduce((one, other) => (other.worst[0] > one.worst[0] ? other : one), view.runs[0]).worst[1];
}

function key(event) {
  const { controls } = view, moved = event.shiftKey;
  const turns = {
    ArrowLeft: () => (moved ? controls.pan(KEY_MOVE, 0) : controls.rotateLeft(KEY_TURN)),
    ArrowRight: () => (moved ? controls.pan(-KEY_MOVE, 0) : controls.rotateLeft(-KEY_TURN)),
    ArrowUp: () => (moved ? controls.pan(0, KEY_MOVE) : controls.rotateUp(KEY_TURN)),
    ArrowDown: () => (moved ? controls.pan(0, -KEY_MOVE) : controls.rotateUp(-KEY_TURN)),
    "+": () => controls.dollyIn(KEY_ZOOM),
    "-": () => controls.dollyOut(KEY_ZOOM),
  };
  if (!turns[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  turns[event.key]();
}

function play() {
  view.playing = view.playing ? clearInterval(view.playing) : setInterval(() => show((view.frame + 1) % data.frames.length), 1000 / PLAY_RATE);
  part("play").textContent = view.playing ? "Pause" : "Play";
  part("play").setAttribute("aria-pressed", Boolean(view.playing));
}

// The address of the page may name a frame: report.html#frame=110.
function follow() {
  const frame = data.frames.indexOf(Number(location.hash.match(/^#frame=(\d+)$/)?.[1] ?? NaN));
  if (frame >= 0) show(frame);
}

const three = await library(data.library).catch(sorry);
const [stops, both, warm] = [data.colours, data.both, data.warm].map((palette) => three && palette.map((text) => new three.Color(text)));
const [flesh, lost] = [MUSCLE, UNKNOWN].map((text) => three && new three.Color(text));
const view = three && (await assembled().catch(sorry));
if (view) listen();
