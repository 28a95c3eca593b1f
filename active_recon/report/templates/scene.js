'use strict';
// The 3D view: cells above a threshold as cubes, and the camera's positions.

const FACES = [  // outward direction, and the corners counter-clockwise as seen from outside
  [[1, 0, 0], [[1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0, 1]]],
  [[-1, 0, 0], [[0, 0, 0], [0, 0, 1], [0, 1, 1], [0, 1, 0]]],
  [[0, 1, 0], [[0, 1, 0], [0, 1, 1], [1, 1, 1], [1, 1, 0]]],
  [[0, -1, 0], [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]]],
  [[0, 0, 1], [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]],
  [[0, 0, -1], [[0, 0, 0], [0, 1, 0], [1, 1, 0], [1, 0, 0]]],
];
const STEPS = 65535;
const RING = 0.82;

/** Return the cells of a packed grid, or null. */
function unpacked(grid) {
  if (grid === null) return null;
  const bytes = Uint8Array.from(atob(grid), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Uint16Array.from({ length: bytes.length / 2 }, (_, i) => view.getUint16(2 * i, true));
}

/** Return the visible faces of the cells above a threshold as a mesh, and how many cells they are. */
function surface(cells, side, threshold) {
  const least = threshold * STEPS;
  const solid = (x, y, z) => x >= 0 && y >= 0 && z >= 0 && x < side && y < side && z < side
    && cells[(x * side + y) * side + z] > least;
  const mesh = { x: [], y: [], z: [], i: [], j: [], k: [], intensity: [], count: 0 };
  for (let x = 0; x < side; x++) for (let y = 0; y < side; y++) for (let z = 0; z < side; z++) {
    if (!solid(x, y, z)) continue;
    mesh.count++;
    for (const [[dx, dy, dz], corners] of FACES) {
      if (solid(x + dx, y + dy, z + dz)) continue;
      const first = mesh.x.length;
      for (const [cx, cy, cz] of corners) {
        mesh.x.push((x + cx) / side - 0.5);
        mesh.y.push((y + cy) / side - 0.5);
        mesh.z.push((z + cz) / side - 0.5);
      }
      mesh.i.push(first, first);
      mesh.j.push(first + 1, first + 2);
      mesh.k.push(first + 2, first + 3);
      const sure = cells[(x * side + y) * side + z] / STEPS;
      mesh.intensity.push(sure, sure);
    }
  }
  return mesh;
}

/** Return a packed surface as a mesh with a colour for each corner. */
function coloredMesh({ corners, faces, colors }) {
  const bytes = (packed) => Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  const numbers = (packed, size, read) => {
    const view = new DataView(bytes(packed).buffer);
    return Array.from({ length: view.byteLength / size }, (_, i) => view[read](size * i, true));
  };
  const third = (values, first) => values.filter((_, i) => i % 3 === first);
  const places = numbers(corners, 2, 'getUint16').map((step) => 2 * (step / STEPS - 0.5));
  const joined = numbers(faces, 4, 'getUint32');
  const shades = numbers(colors, 1, 'getUint8');
  return { x: third(places, 0), y: third(places, 1), z: third(places, 2), i: third(joined, 0),
    j: third(joined, 1), k: third(joined, 2), vertexcolor: third(shades, 0).map(
      (red, i) => `rgb(${red},${shades[3 * i + 1]},${shades[3 * i + 2]})`) };
}

/** Return intersection over union of what is above the threshold with the true cells. */
function overlap(cells, truth, threshold) {
  let both = 0, either = 0;
  for (let i = 0; i < cells.length; i++) {
    const here = cells[i] > threshold * STEPS, there = truth[i] > STEPS / 2;
    both += here && there;
    either += here || there;
  }
  return either ? both / either : 1;
}

/** Return the traces of a scene: the mesh, the ring, the cameras up to a view. */
function sceneTraces(mesh, cameras, upTo) {
  const around = [...Array(97).keys()].map((i) => (i / 96) * 2 * Math.PI);
  const seen = cameras.slice(0, upTo + 1);
  const { count, ...faces } = mesh;
  return [
    { type: 'mesh3d', ...faces, intensitymode: 'cell', flatshading: !faces.vertexcolor,
      hoverinfo: 'skip', cmin: 0, cmax: 1, showscale: false,
      colorscale: [[0, '--unsure'], [0.5, '--half-sure'], [1, '--sure']],
      lighting: faces.vertexcolor ? { ambient: 0.9, diffuse: 0.2 } : { ambient: 0.62, diffuse: 0.75, specular: 0.06, roughness: 0.9, fresnel: 0,
        facenormalsepsilon: 0, vertexnormalsepsilon: 0 },
      lightposition: { x: 800, y: -1200, z: 2400 } },
    { type: 'scatter3d', mode: 'lines', hoverinfo: 'skip', x: around.map((a) => RING * Math.cos(a)),
      y: around.map((a) => RING * Math.sin(a)), z: around.map(() => -0.52),
      line: { color: '--quiet', width: 2 } },
    { type: 'scatter3d', mode: 'markers+text', hoverinfo: 'skip',
      x: seen.map((c) => RING * Math.cos(c.azimuth)), y: seen.map((c) => RING * Math.sin(c.azimuth)),
      z: seen.map(() => -0.5), text: seen.map((_, i) => `${i + 1}`), textposition: 'top center',
      textfont: { size: 14, color: '--ink' },
      marker: { size: seen.map((_, i) => (i === upTo ? 18 : 12)), color: seen.map((c) => c.color),
        line: { width: 0 } } },
  ];
}

const HIDDEN_AXIS = { visible: false, range: [-0.85, 0.85], showspikes: false };
const SCENE_LAYOUT = {
  margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false, uirevision: 'kept',
  scene: { xaxis: HIDDEN_AXIS, yaxis: HIDDEN_AXIS, zaxis: { ...HIDDEN_AXIS, range: [-0.62, 0.55] },
    aspectmode: 'data', dragmode: 'orbit', uirevision: 'kept' },
};

/** Return where the 3D view is looked at from, after so many radians of turning. */
function eyeAt(angle) {
  return { x: 1.42 * Math.cos(angle), y: 1.42 * Math.sin(angle), z: 0.78 };
}
