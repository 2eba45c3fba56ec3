// Marks of a muscle: vertices that are attached to bones, and vertices that touch bones. Part of viewer.js.
const ATTACHED = "#e0218a", TOUCHED = "#101014", PLATE = 36; // number of triangle corners of a box: a bone with at most as many is drawn as a plate

async function marks(run, geometry) {
  const touched = run.touched ? new Uint8Array(await unpacked(run.touched)) : new Uint8Array(0);
  const own = { attached: dots(geometry, ATTACHED), touched: dots(geometry, TOUCHED) };
  choosePoints(own.attached, data.attached);
  return { ...own, mask: touched, all: [own.attached, own.touched] };
}

function dots(geometry, colour) {
  const shared = new three.BufferGeometry(), position = geometry.getAttribute("position");
  shared.setAttribute("position", position);
  shared.setIndex(new three.BufferAttribute(new Uint32Array(position.count), 1));
  const points = new three.Points(shared, new three.PointsMaterial({ color: colour, size: 5, sizeAttenuation: false }));
  points.frustumCulled = false;
  return points;
}

function choosePoints({ geometry }, chosen) {
  geometry.index.array.set(chosen);
  geometry.index.needsUpdate = true;
  geometry.setDrawRange(0, chosen.length);
}

function touch(run) {
  const count = run.stride / 3, own = run.marks.mask.subarray(view.frame * count, (view.frame + 1) * count), chosen = [];
  own.forEach((one, i) => { if (one) chosen.push(i); });
  choosePoints(run.marks.touched, chosen);
}

function showMarks(run) {
  for (const name of ["attached", "touched"]) run.marks[name].visible = run.mesh.visible && isOn(name);
}
