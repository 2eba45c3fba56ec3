// Colours, scale and histogram of the quantities in the 3D view. Part of viewer.js.
const FORCE = "#1f6fd1", LONGEST = 0.6; // length of the longest arrow, as a fraction of half the picture's height
const BINS = 48, GREATEST_LEVEL = 127;
const WORDS = { distance: "worst vertex", surface: "farthest from the surface", depth: "deepest in a bone" };

// Levels of one byte (frames, vertices), from differences from the previous frame.
async function levels(text) {
  const bytes = new Int8Array(await unpacked(text)), stride = bytes.length / data.frames.length;
  for (let i = stride; i < bytes.length; i++) bytes[i] += bytes[i - stride]; // wraps at 256, as the differences did
  return bytes;
}

function quantity() {
  return data.quantities.find(({ name }) => name === part("quantity")?.value);
}

// The value [mm] of a quantity at each vertex of a run in the frame shown.
function values(run, { name, top }) {
  const count = run.stride / 3, found = new Float32Array(count), { whole } = run, other = view.runs[0].whole;
  if (name === "distance") {
    for (let i = 0, at = view.frame * run.stride; i < count; i++, at += 3) {
      found[i] = data.step * Math.hypot(whole[at] - other[at], whole[at + 1] - other[at + 1], whole[at + 2] - other[at + 2]);
    }
    return found;
  }
  const own = run.levels[name], start = view.frame * count;
  for (let i = 0; i < count; i++) found[i] = Math.sign(own[start + i]) * top * (own[start + i] / GREATEST_LEVEL) ** 2;
  return found;
}

// The error bar [mm] of the distance to the reference, below which a distance is not significant.
function unknown({ name }) {
  return data.bars[name]?.[view.frame] ?? 0;
}

function shades(run, chosen) {
  return Boolean(chosen) && run.reached[view.frame] && (chosen.name === "depth" ? Boolean(run.levels.depth) : run !== view.runs[0] && view.runs[0].reached[view.frame]);
}

function colour(run, chosen, colours) {
  const found = values(run, chosen), bar = unknown(chosen), palette = chosen.signed ? both : stops;
  run.bins = new Float32Array(BINS);
  run.greatest = run.most[chosen.name]?.[view.frame] ?? found.reduce((most, value) => Math.max(most, value), 0);
  found.forEach((value, i) => {
    const share = view.top > 0 ? value / view.top : 0, along = chosen.signed ? (share + 1) / 2 : share;
    const still = chosen.name === "depth" ? value <= 0 : Math.abs(value) < bar;
    if (still) (chosen.name === "depth" ? flesh : lost).toArray(colours, 3 * i);
    else ramp(palette, along, colours, 3 * i);
    if (chosen.name !== "depth" || value > 0) run.bins[Math.min(Math.max(Math.floor(along * BINS), 0), BINS - 1)] += 1 / found.length;
  });
}

function ramp(palette, share, colours, at) {
  const along = Math.min(Math.max(share, 0), 1) * (palette.length - 1), below = Math.min(Math.floor(along), palette.length - 2);
  ["r", "g", "b"].forEach((channel, k) => {
    colours[at + k] = palette[below][channel] + (along - below) * (palette[below + 1][channel] - palette[below][channel]);
  });
}

function number(value) {
  const size = Math.abs(value);
  return size >= 1000 ? value.toFixed(0) : String(Number(value.toPrecision(3))).replace("-", "\u2212");
}

// The colour scale of the surfaces: its colours, with unknown values in grey, its ends, and the histogram of the vertices.
function legend() {
  const chosen = quantity(), shown = panes().filter((run) => shades(run, chosen));
  part("legend").hidden = !chosen;
  if (!chosen) return;
  const { top } = view, low = chosen.signed ? -top : 0, bar = unknown(chosen), share = Math.min(top > 0 ? bar / top : 0, 1);
  const [from, to] = chosen.signed ? [50 - 50 * share, 50 + 50 * share] : [0, 100 * share];
  const grey = `linear-gradient(to right, transparent ${from}%, ${UNKNOWN} ${from}%, ${UNKNOWN} ${to}%, transparent ${to}%)`;
  part("ramp").style.background = `${grey}, linear-gradient(to right, ${(chosen.signed ? data.both : data.colours).join(", ")})`;
  [["zero", low], ["half", (low + top) / 2], ["full", top]].forEach(([name, value]) => { part(name).textContent = number(value); });
  part("full").textContent += " mm";
  histogram(part("bins"), shown.map((run) => run.bins));
  const inside = shown.reduce((sum, run) => sum + run.bins.reduce((one, other) => one + other, 0), 0) / (shown.length || 1);
  const notes = { depth: `${number(100 * inside)} % of the vertices are in bones; the others have the muscle's own colour.` };
  const without = data.bars[chosen.name] ? "No error bar is known for this frame." : "The reference has no error bars.";
  part("known").textContent = notes[chosen.name] ?? (bar > 0 ? `Grey: below the reference's error bar of ${number(bar)} mm.` : without);
}

// Bars over a scale: the sum over the runs of the fraction in each bin, relative to the highest bar.
function histogram(svg, all) {
  const means = Array.from({ length: BINS }, (_, i) => all.reduce((sum, bins) => sum + bins[i], 0));
  const most = Math.max(...means, 1e-9);
  svg.firstElementChild.setAttribute("d", means.map((mean, i) => (mean > 0 ? `M${i} 1h1V${1 - Math.max(mean / most, 0.03)}h-1z` : "")).join(""));
}

function scale(top) {
  if (!(top >= 0) || !part("legend")) return;
  view.top = top;
  show(view.frame);
}

// The scale is reset for each quantity.
function choose() {
  const chosen = quantity();
  view.top = chosen?.top ?? view.top;
  if (chosen) part("top").value = Number(view.top.toPrecision(3));
  show(view.frame);
}

// ---- Fibres

async function fibres(run) {
  const { lines, rest } = data.fibres, whole = await wholeNumbers(run.points, data.frames.length);
  const radius = 0.008 * data.camera.half;
  const mesh = new three.InstancedMesh(new three.CylinderGeometry(radius, radius, 1, 6), look("#ffffff"), rest.length);
  mesh.frustumCulled = false;
  const starts = []; // the point that each piece begins at
  lines.reduce((first, count) => {
    for (let i = 0; i < count - 1; i++) starts.push(first + i);
    return first + count;
  }, 0);
  return { mesh, starts, whole, stride: whole.length / data.frames.length };
}

function lay(run) {
  const { mesh, starts, whole, stride } = run.strands, { rest, low, high } = data.fibres;
  const matrix = new three.Matrix4(), turn = new three.Quaternion(), up = new three.Vector3(0, 1, 0), paint = new three.Color(), shade = [0, 0, 0];
  const point = (i) => new three.Vector3(...[0, 1, 2].map((k) => data.low[k] + data.step * whole[view.frame * stride + 3 * i + k]));
  run.stretches = new Float32Array(BINS);
  starts.forEach((start, i) => {
    const one = point(start), along = point(start + 1).sub(one), length = along.length();
    const share = (length / rest[i] - low) / (high - low || 1);
    turn.setFromUnitVectors(up, length > 0 ? along.clone().divideScalar(length) : up);
    mesh.setMatrixAt(i, matrix.compose(one.addScaledVector(along, 0.5), turn, new three.Vector3(1, length, 1)));
    ramp(warm, share, shade, 0);
    mesh.setColorAt(i, paint.fromArray(shade));
    run.stretches[Math.min(Math.max(Math.floor(share * BINS), 0), BINS - 1)] += 1 / starts.length;
  });
  mesh.instanceMatrix.needsUpdate = mesh.instanceColor.needsUpdate = true;
}

function fibreLegend() {
  part("stretch").hidden = !isOn("fibres");
  if (isOn("fibres")) histogram(part("stretches"), panes().filter((run) => run.reached[view.frame]).map((run) => run.stretches));
}

// ---- Forces

// As many arrows as any frame has, drawn in front of everything, along y until they are turned.
function arrows(run) {
  const group = new three.Group(), thick = 0.012 * data.camera.half;
  for (let i = Math.max(0, ...run.forces.map((frame) => frame.length)); i > 0; i--) {
    const arrow = new three.Group();
    for (const shape of [new three.CylinderGeometry(thick, thick, 1, 8).translate(0, 0.5, 0), new three.ConeGeometry(3 * thick, 6 * thick, 16)]) {
      const mesh = new three.Mesh(shape, look(FORCE, { transparent: true, depthTest: false }));
      mesh.renderOrder = 2;
      mesh.frustumCulled = false;
      arrow.add(mesh);
    }
    group.add(arrow);
  }
  return group;
}

function pull(run) {
  const found = run.forces[view.frame];
  run.arrows.children.forEach((arrow, i) => {
    arrow.visible = i < found.length;
    if (!arrow.visible) return;
    const force = new three.Vector3(...found[i].slice(3)), length = (LONGEST * data.camera.half * force.length()) / data.force;
    arrow.position.set(...found[i].slice(0, 3));
    arrow.quaternion.setFromUnitVectors(new three.Vector3(0, 1, 0), force.normalize());
    arrow.children[0].scale.y = Math.max(length, 1e-6);
    arrow.children[1].position.y = length;
  });
}
