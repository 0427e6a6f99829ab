// The scene of a part: turned, cut, coloured and asked, in any browser with WebGL 2.
// Its data stand beside it in the page, see scene_data in case_scene.py and run_scene.py.
"use strict";

const T = THREE;
const CREASE = Math.cos((35 * Math.PI) / 180); // sharper edges are drawn as edges
const MOST_HOVERED = 60000; // triangles through which a ray is sent as the pointer moves
const PLAIN = "#c3cad3", PRINTED = "#8fa9c4", CUT = "#8d97a3", CHOSEN = "#ffb300";
const PALETTES = {
  viridis: "440154 482475 414487 355f8d 2a788e 21918c 22a884 44bf70 7ad151 bddf26 fde725",
  turbo: "30123b 4454c4 4490fe 1fc8de 29efa2 7dff56 c1f334 f1ca3a fe922a ea4f0d 7a0403",
  plasma: "0d0887 41049d 6a00a8 8f0da4 b12a90 cc4778 e16462 f2844b fca636 fcce25 f0f921",
};
const ABOVE = "#ff00c8", MISTAKE = "#b42318"; // stress above the limit, places of a mistake

// ---- data ----------------------------------------------------------------------------------

async function bytesOf(text) {
  const raw = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([raw]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Whole numbers, row by row; see packed.py. */
async function unpack({ bits, rows, columns, data }) {
  const bytes = await bytesOf(data);
  const size = bits / 8, mask = 2 ** bits - 1;
  const values = new Uint32Array(rows * columns);
  for (let column = 0; column < columns; column++) {
    let value = 0;
    for (let row = 0; row < rows; row++) {
      let difference = 0;
      for (let k = 0; k < size; k++) {
        difference += bytes[(column * size + k) * rows + row] * 2 ** (8 * k);
      }
      value = (value + difference) & (bits === 32 ? -1 : mask);
      values[row * columns + column] = value;
    }
  }
  return values;
}

/** Quantised values, row by row. */
async function values(packed) {
  const levels = await unpack(packed);
  const result = new Float32Array(levels.length);
  const { columns, lower, step } = packed;
  for (let k = 0; k < levels.length; k++) {
    const column = k % columns;
    result[k] = lower[column] + step[column] * levels[k];
  }
  return result;
}

// ---- geometry ------------------------------------------------------------------------------

/** Corners of triangles with normals that are smooth within a crease angle. */
function creased(vertices, triangles) {
  const corners = triangles.length, total = vertices.length / 3;
  const positions = new Float32Array(3 * corners), normals = new Float32Array(3 * corners);
  for (let k = 0; k < corners; k++) {
    const v = 3 * triangles[k];
    positions[3 * k] = vertices[v];
    positions[3 * k + 1] = vertices[v + 1];
    positions[3 * k + 2] = vertices[v + 2];
  }
  const face = new Float32Array(corners), length = new Float32Array(corners / 3); // area vectors
  for (let t = 0; t < corners; t += 3) {
    const a = 3 * t, p = positions;
    const ux = p[a + 3] - p[a], uy = p[a + 4] - p[a + 1], uz = p[a + 5] - p[a + 2];
    const vx = p[a + 6] - p[a], vy = p[a + 7] - p[a + 1], vz = p[a + 8] - p[a + 2];
    const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
    face[t] = x; face[t + 1] = y; face[t + 2] = z;
    length[t / 3] = Math.sqrt(x * x + y * y + z * z);
  }
  const first = new Uint32Array(total + 1); // triangles of each vertex
  for (let k = 0; k < corners; k++) first[triangles[k] + 1]++;
  for (let v = 0; v < total; v++) first[v + 1] += first[v];
  const users = new Uint32Array(corners), next = first.slice(0, total);
  for (let k = 0; k < corners; k++) users[next[triangles[k]]++] = k - (k % 3);
  for (let k = 0; k < corners; k++) {
    const v = triangles[k], t = k - (k % 3), fx = face[t], fy = face[t + 1], fz = face[t + 2];
    const least = CREASE * length[t / 3];
    let x = 0, y = 0, z = 0;
    for (let j = first[v]; j < first[v + 1]; j++) {
      const o = users[j], ox = face[o], oy = face[o + 1], oz = face[o + 2];
      if (fx * ox + fy * oy + fz * oz < least * length[o / 3]) continue;
      x += ox; y += oy; z += oz;
    }
    const size = Math.sqrt(x * x + y * y + z * z) || 1;
    normals[3 * k] = x / size;
    normals[3 * k + 1] = y / size;
    normals[3 * k + 2] = z / size;
  }
  return { positions, normals };
}

async function meshData(packed) {
  const [vertices, triangles] = await Promise.all([values(packed.vertices), unpack(packed.triangles)]);
  return { vertices, triangles };
}

function geometryOf({ vertices, triangles }) {
  const { positions, normals } = creased(vertices, triangles);
  const geometry = new T.BufferGeometry();
  geometry.setAttribute("position", new T.BufferAttribute(positions, 3));
  geometry.setAttribute("normal", new T.BufferAttribute(normals, 3));
  return geometry;
}

function linesOf(points, colour, more = {}) {
  const geometry = new T.BufferGeometry();
  geometry.setAttribute("position", new T.BufferAttribute(points, 3));
  return new T.LineSegments(geometry, new T.LineBasicMaterial({ color: colour, ...more }));
}

// ---- colours -------------------------------------------------------------------------------

const channels = (hex) => [0, 2, 4].map((k) => parseInt(hex.replace("#", "").slice(k, k + 2), 16));

/** Red, green and blue, 0 to 255, at a share from 0 to 1 of a palette. */
function shade(palette, share) {
  const anchors = (shade.anchors[palette] ??= PALETTES[palette].split(" ").map(channels));
  const at = Math.min(Math.max(share, 0), 1) * (anchors.length - 1);
  const low = Math.min(Math.floor(at), anchors.length - 2);
  return anchors[low].map((value, k) => value + (at - low) * (anchors[low + 1][k] - value));
}
shade.anchors = {};

const linear = (value) => ((value / 255 <= 0.04045) ? value / 255 / 12.92 : ((value / 255 + 0.055) / 1.055) ** 2.4);

/** A texture of colours that fills the part. */
async function volumeTexture(volume, colourOf, smooth) {
  const levels = await unpack(volume.values);
  const data = new Uint8Array(4 * levels.length);
  const known = new Map();
  for (let k = 0; k < levels.length; k++) {
    let colour = known.get(levels[k]);
    if (!colour) known.set(levels[k], (colour = colourOf(levels[k])));
    for (let j = 0; j < 3; j++) data[4 * k + j] = colour[j];
    data[4 * k + 3] = 255;
  }
  const [nx, ny, nz] = volume.shape;
  const texture = new T.Data3DTexture(data, nx, ny, nz);
  texture.format = T.RGBAFormat;
  texture.minFilter = texture.magFilter = smooth ? T.LinearFilter : T.NearestFilter;
  texture.needsUpdate = true;
  return { texture, levels, volume };
}

/** Let a material take its colour from a volume, at the place of each pixel. */
function coloured(material, { texture, volume }) {
  const size = volume.shape.map((n) => n * volume.step);
  material.onBeforeCompile = (shader) => {
    shader.uniforms.volume = { value: texture };
    shader.uniforms.volumeLower = { value: new T.Vector3(...volume.lower.map((x) => x - volume.step / 2)) };
    shader.uniforms.volumeSize = { value: new T.Vector3(...size) };
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying vec3 place;")
      .replace("#include <begin_vertex>",
        "#include <begin_vertex>\nplace = (modelMatrix * vec4(position, 1.0)).xyz;");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", `#include <common>
        varying vec3 place;
        uniform highp sampler3D volume;
        uniform vec3 volumeLower, volumeSize;`)
      .replace("#include <color_fragment>",
        "diffuseColor.rgb = pow(texture(volume, (place - volumeLower) / volumeSize).rgb, vec3(2.2));");
  };
  material.customProgramCacheKey = () => "volume";
  return material;
}

// ---- page ----------------------------------------------------------------------------------

/** An element; attributes that are functions listen. */
function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") made.addEventListener(name, value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value != null) made.setAttribute(name, value);
  }
  made.append(...children.filter((child) => child != null));
  return made;
}

const facts = (rows) =>
  element("dl", {}, ...rows.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]));

const figure = (value) => (value === 0 ? "0" : Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3
  ? value.toExponential(2) : String(Number(value.toPrecision(4))));

async function copied(text, button, source) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    getSelection().selectAllChildren(source); // then the keys of the browser copy it
  }
  button.textContent = "Copied";
  setTimeout(() => { button.textContent = "Copy"; }, 1500);
}

class View {
  constructor(root, data) {
    this.root = root;
    this.data = data;
    this.stage = root.querySelector(".stage");
    this.panel = root.querySelector(".panel");
    this.labels = element("div", { class: "labels", "aria-hidden": "true" });
    this.leaders = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    this.leaders.setAttribute("class", "leaders");
    this.leaders.setAttribute("aria-hidden", "true");
    this.legend = element("div", { class: "legend" });
    this.lower = new T.Vector3(...data.box[0]);
    this.upper = new T.Vector3(...data.box[1]);
    this.middle = this.lower.clone().add(this.upper).multiplyScalar(0.5);
    this.diagonal = this.upper.distanceTo(this.lower) || 1;
    this.plane = new T.Plane(new T.Vector3(-1, 0, 0), 0);
    this.state = {
      view: data.views[0].id, load: "all", axis: "", cut: 0.5, flip: false, factor: 0,
      through: false, regions: true, labels: true, face: null,
    };
    this.bodies = {};
  }

  async start() {
    T.ColorManagement.enabled = true;
    if (!document.createElement("canvas").getContext("webgl2")) throw new Error("this browser has no WebGL 2");
    this.renderer = new T.WebGLRenderer({ antialias: true, stencil: true });
    this.renderer.localClippingEnabled = true;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio || 1, 2));
    this.renderer.setClearColor("#f6f8fa");
    this.canvas = this.renderer.domElement;
    Object.entries({
      tabindex: "0", role: "application", "aria-describedby": `${this.root.id}-keys`,
      "aria-label": `${this.data.title}, three-dimensional scene`,
    }).forEach(([name, value]) => this.canvas.setAttribute(name, value));
    this.scene = new T.Scene();
    this.camera = new T.OrthographicCamera();
    this.camera.up.set(0, 0, 1);
    const sky = this.sky = new T.HemisphereLight("#ffffff", "#98a1ac", 2.2);
    sky.position.set(0, 0, 1);
    const sun = this.sun = new T.DirectionalLight("#ffffff", 1.2);
    sun.position.set(0.9, 1, 0.5);
    this.scene.add(sky);
    this.camera.add(sun, sun.target); // it turns with the eye
    this.scene.add(this.camera);
    this.controls = new T.OrbitControls(this.camera, this.canvas);
    this.controls.addEventListener("change", () => this.draw());
    this.controls.addEventListener("start", () => { this.whole = false; });
    this.stage.append(this.canvas, this.leaders, this.labels, this.legend, this.#tools());
    await this.#fill();
    this.#panel();
    this.#listen();
    this.turn(1, -1.35, 0.85);
    this.#restore();
    await this.show();
    this.stage.classList.add("live");
  }

  // -- what is drawn --

  async #fill() {
    const { data } = this;
    this.cutAway = [this.plane];
    this.edges = linesOf(await values(data.edges), "#4a5260", { transparent: true, opacity: 0.8 });
    this.scene.add(this.edges);
    this.chosen = new T.Mesh(new T.BufferGeometry(), new T.MeshLambertMaterial({
      color: CHOSEN, polygonOffset: true, polygonOffsetFactor: -2, polygonOffsetUnits: -2, side: T.DoubleSide,
    }));
    this.hovered = new T.Mesh(new T.BufferGeometry(), new T.MeshBasicMaterial({
      color: CHOSEN, transparent: true, opacity: 0.35, polygonOffset: true, polygonOffsetFactor: -2,
      polygonOffsetUnits: -2,
    }));
    for (const mesh of [this.chosen, this.hovered]) { mesh.renderOrder = 4; this.scene.add(mesh); }
    this.regions = new T.Group();
    for (const region of data.regions) {
      const mesh = new T.Mesh(geometryOf(await meshData(region.mesh)), new T.MeshLambertMaterial({
        color: region.colour, polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1,
        side: T.DoubleSide,
      }));
      mesh.userData = region;
      mesh.renderOrder = region.volume ? 1.5 : 3;
      this.regions.add(mesh);
      if (region.hatch.rows) {
        const strokes = linesOf(await values(region.hatch), "#ffffff");
        strokes.renderOrder = 3.5;
        strokes.userData = region;
        this.regions.add(strokes);
      }
    }
    this.scene.add(this.regions);
    this.loads = new T.Group();
    for (const load of data.cases) this.loads.add(this.#load(load));
    this.scene.add(this.loads);
    this.cap = new T.Mesh(new T.PlaneGeometry(4 * this.diagonal, 4 * this.diagonal), new T.MeshBasicMaterial());
    this.cap.visible = false;
    this.cap.renderOrder = 1.1;
    this.cap.onAfterRender = (renderer) => renderer.clearStencil();
    this.scene.add(this.cap);
  }

  /** Arrows, bars and the line of action of a load case. */
  #load(load) {
    const group = new T.Group();
    group.userData = load;
    const solid = (geometry) => {
      // Twice: as it stands, and faintly where the part hides it.
      const pair = new T.Group();
      pair.add(new T.Mesh(geometry, new T.MeshLambertMaterial({ color: load.colour })));
      const ghost = new T.Mesh(geometry, new T.MeshBasicMaterial({
        color: load.colour, transparent: true, opacity: 0.3, depthTest: false, depthWrite: false,
      }));
      ghost.renderOrder = 8;
      pair.add(ghost);
      return pair;
    };
    const bar = (from, to, radius, shape) => {
      const along = to.clone().sub(from), length = along.length();
      const made = solid(shape === "cone"
        ? new T.ConeGeometry(radius, length, 24) : new T.CylinderGeometry(radius, radius, length, 12));
      made.position.copy(from).addScaledVector(along, 0.5);
      made.quaternion.setFromUnitVectors(new T.Vector3(0, 1, 0), along.normalize());
      return made;
    };
    for (const action of load.actions) {
      for (const [tail, tip] of action.arrows) {
        const [a, b] = [new T.Vector3(...tail), new T.Vector3(...tip)];
        const neck = a.clone().lerp(b, 0.68), thick = Math.max(0.05 * a.distanceTo(b), 0.003 * this.diagonal);
        group.add(bar(a, neck, 0.45 * thick), bar(neck, b, 1.6 * thick, "cone"));
      }
      for (const { radius, segments } of action.bars) {
        for (const [a, b] of segments) group.add(bar(new T.Vector3(...a), new T.Vector3(...b), radius));
      }
    }
    if (load.line) {
      const geometry = new T.BufferGeometry();
      geometry.setAttribute("position", new T.BufferAttribute(new Float32Array(load.line.flat()), 3));
      const line = new T.LineSegments(geometry, new T.LineDashedMaterial({
        color: load.colour, dashSize: 0.02 * this.diagonal, gapSize: 0.012 * this.diagonal,
        transparent: true, opacity: 0.75, depthTest: false,
      }));
      line.computeLineDistances();
      line.renderOrder = 7;
      group.add(line);
    }
    return group;
  }

  /** A closed surface with what fills its cut; made when it is first shown. */
  async body(name) {
    if (this.bodies[name]) return this.bodies[name];
    const packed = this.data[name];
    const data = await meshData(packed);
    const geometry = geometryOf(data);
    const body = { ...data, geometry, group: new T.Group(), base: null };
    if (packed.labels) body.labels = await unpack(packed.labels);
    body.mesh = new T.Mesh(geometry, new T.MeshLambertMaterial({ color: PLAIN }));
    body.mesh.renderOrder = 2;
    const ways = [[T.BackSide, T.IncrementWrapStencilOp], [T.FrontSide, T.DecrementWrapStencilOp]];
    body.stencils = ways.map(([side, operation]) => {
      const mesh = new T.Mesh(geometry, new T.MeshBasicMaterial({
        side, depthWrite: false, depthTest: false, colorWrite: false, stencilWrite: true,
        stencilFunc: T.AlwaysStencilFunc, stencilFail: operation, stencilZFail: operation,
        stencilZPass: operation, clippingPlanes: this.cutAway,
      }));
      mesh.renderOrder = 1;
      return mesh;
    });
    body.group.add(body.mesh, ...body.stencils);
    this.scene.add(body.group);
    return (this.bodies[name] = body);
  }

  async volume(name) {
    this.textures ??= {};
    if (!this.textures[name]) {
      const volume = this.data.volumes[name];
      const colourOf = volume.palette
        ? (level) => channels(volume.palette[level] ?? "#888888")
        : (level) => shade(volume.colours, level / 255);
      this.textures[name] = await volumeTexture(volume, colourOf, !volume.palette);
    }
    return this.textures[name];
  }

  /** Bring everything into the state that the controls ask for. */
  async show() {
    const { state, data } = this;
    const view = data.views.find((each) => each.id === state.view);
    const body = await this.body(view.body);
    for (const [name, other] of Object.entries(this.bodies)) other.group.visible = name === view.body;
    const isCase = view.id === "case";
    body.mesh.material.dispose();
    // Colours that stand for values are to be read: little shade.
    [this.sky.intensity, this.sun.intensity] = view.field || view.volume ? [2.9, 0.6] : [2.2, 1.2];
    const through = state.through && isCase;
    const look = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1, transparent: through, opacity: through ? 0.3 : 1, depthWrite: !through, clippingPlanes: state.axis ? this.cutAway : [] };
    const capLook = {
      stencilWrite: true, stencilRef: 0, stencilFunc: T.NotEqualStencilFunc, stencilFail: T.ReplaceStencilOp,
      stencilZFail: T.ReplaceStencilOp, stencilZPass: T.ReplaceStencilOp, side: T.DoubleSide,
    };
    if (view.volume) {
      const volume = await this.volume(view.volume);
      body.mesh.material = coloured(new T.MeshLambertMaterial(look), volume);
      this.cap.material = coloured(new T.MeshBasicMaterial(capLook), volume);
    } else if (view.field) {
      body.mesh.material = new T.MeshLambertMaterial({ ...look, vertexColors: true });
      this.cap.material = new T.MeshBasicMaterial({ ...capLook, color: "#9aa3ae" });
      await this.#paint(body, view);
    } else {
      body.mesh.material = new T.MeshLambertMaterial({ ...look, color: view.id === "printed" ? PRINTED : PLAIN });
      this.cap.material = new T.MeshBasicMaterial({ ...capLook, color: view.id === "printed" ? "#56718e" : CUT });
    }
    await this.#deform(body, view);
    this.#cut(body, isCase);
    for (const mesh of this.regions.children) {
      // Zones in which stress is not judged lie just below the faces: only seen through them.
      mesh.visible = isCase && state.regions && (!mesh.userData.volume || through || !!state.axis);
      mesh.material.clippingPlanes = look.clippingPlanes;
      mesh.material.transparent = mesh.userData.volume || false;
      mesh.material.opacity = mesh.userData.volume ? 0.55 : 1;
    }
    for (const group of this.loads.children) {
      group.visible = isCase && (state.load === "all" || state.load === group.userData.name);
    }
    this.edges.visible = true;
    this.edges.material.opacity = isCase || view.body === "part" ? 0.8 : 0.35;
    this.edges.material.clippingPlanes = view.body === "part" ? look.clippingPlanes : [];
    this.chosen.visible = this.hovered.visible = isCase;
    for (const mesh of [this.chosen, this.hovered]) mesh.material.clippingPlanes = look.clippingPlanes;
    this.#legends(view);
    this.#controls(view);
    this.draw();
  }

  /** Colours of a field of the load case that is shown. */
  async #paint(body, view) {
    const solved = this.#solved();
    let levels = await values(view.field === "stress" ? solved.von_mises : solved.displacement);
    if (view.field !== "stress") {
      const shift = levels;
      levels = new Float32Array(shift.length / 3).map((_, v) =>
        Math.hypot(shift[3 * v], shift[3 * v + 1], shift[3 * v + 2]));
    }
    const high = view.field === "stress" ? this.#highest(solved) : solved.largest;
    const limit = view.field === "stress" ? this.data.limit : null;
    const colours = new Float32Array(3 * body.triangles.length);
    const table = Array.from({ length: 256 }, (_, k) => shade(view.colours, k / 255).map(linear));
    const over = channels(ABOVE).map(linear);
    body.triangles.forEach((v, k) => {
      const beyond = limit != null && levels[v] > limit && high >= limit;
      const index = Math.min(Math.max(Math.round((255 * levels[v]) / (high || 1)), 0), 255);
      const colour = beyond ? over : table[index];
      for (let j = 0; j < 3; j++) colours[3 * k + j] = colour[j];
    });
    body.geometry.setAttribute("color", new T.BufferAttribute(colours, 3));
    body.levels = levels;
  }

  /** Where the bar of stress ends: at the limit, unless even the maximum is far below it. */
  #highest(solved) {
    const { limit } = this.data;
    return limit != null && solved.most >= 0.5 * limit ? limit : solved.most;
  }

  #solved() {
    const { cases } = this.data.analysed;
    return cases.find((each) => each.name === this.state.load) ?? cases[0];
  }

  /** Move the analysed body by a multiple of its displacement. */
  async #deform(body, view) {
    if (view.body !== "analysed") return;
    const solved = this.#solved();
    const factor = this.state.factor * solved.factor;
    if (body.moved === `${solved.name} ${factor}`) return;
    body.moved = `${solved.name} ${factor}`;
    const shift = await values(solved.displacement);
    const attribute = body.geometry.getAttribute("position");
    body.triangles.forEach((v, k) => {
      for (let j = 0; j < 3; j++) {
        attribute.array[3 * k + j] = body.vertices[3 * v + j] + factor * shift[3 * v + j];
      }
    });
    attribute.needsUpdate = true;
    body.geometry.computeBoundingSphere();
  }

  #cut(body) {
    const { state } = this;
    const cuts = !!state.axis;
    this.cap.visible = cuts;
    body.stencils.forEach((mesh) => { mesh.visible = cuts; });
    if (!cuts) return;
    const axis = "xyz".indexOf(state.axis);
    const [low, high] = [this.lower.getComponent(axis), this.upper.getComponent(axis)];
    // Just inside the ends, so that no face of the part lies in the plane.
    const at = low + (high - low) * (0.001 + 0.998 * state.cut);
    const sign = state.flip ? 1 : -1;
    this.plane.normal.set(0, 0, 0).setComponent(axis, sign);
    this.plane.constant = -sign * at;
    this.cap.position.copy(this.middle).setComponent(axis, at);
    this.cap.quaternion.setFromUnitVectors(new T.Vector3(0, 0, 1), this.plane.normal);
    this.cutAt = at;
  }

  draw() {
    if (this.waits) return;
    this.waits = true;
    requestAnimationFrame(() => {
      this.waits = false;
      this.#fit();
      this.renderer.render(this.scene, this.camera);
      this.#place();
      this.#store();
      this.#lead();
      this.root.dataset.drawn = String(Number(this.root.dataset.drawn ?? 0) + 1);
    });
  }

  // -- the view --

  #fit() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === this.width && height === this.height) return;
    [this.width, this.height] = [width, height];
    this.renderer.setSize(width, height, false);
    Object.assign(this.camera, {
      left: -width / 2, right: width / 2, top: height / 2, bottom: -height / 2,
      near: -10 * this.diagonal, far: 10 * this.diagonal,
    });
    if (this.whole) this.#showWhole();
    this.camera.updateProjectionMatrix();
  }

  /** Zoom so that the part's box fills the stage, with room for arrows and texts. */
  #showWhole() {
    this.camera.updateMatrixWorld();
    const reach = [0, 0];
    for (let corner = 0; corner < 8; corner++) {
      const point = new T.Vector3(...[0, 1, 2].map((k) =>
        (corner >> k & 1 ? this.upper : this.lower).getComponent(k))).applyMatrix4(this.camera.matrixWorldInverse);
      reach[0] = Math.max(reach[0], Math.abs(point.x));
      reach[1] = Math.max(reach[1], Math.abs(point.y));
    }
    this.camera.zoom = Math.min((0.4 * this.width) / (reach[0] || 1), (0.36 * this.height) / (reach[1] || 1));
  }

  /** Look from a direction. */
  turn(x, y, z) {
    this.controls.target.copy(this.middle);
    this.camera.position.copy(this.middle).add(new T.Vector3(x, y, z).normalize().multiplyScalar(3 * this.diagonal));
    this.controls.update();
    this.whole = true;
    this.width = 0; // fit anew
    this.draw();
  }

  /** Turn by angles in degrees, as the arrow keys do. */
  orbit(across, up) {
    const from = this.camera.position.clone().sub(this.controls.target);
    const length = from.length();
    const azimuth = Math.atan2(from.y, from.x) + (across * Math.PI) / 180;
    const rise = Math.asin(from.z / length) + (up * Math.PI) / 180;
    const height = Math.min(Math.max(rise, -1.5706), 1.5706);
    this.camera.position.copy(this.controls.target).add(new T.Vector3(
      length * Math.cos(height) * Math.cos(azimuth), length * Math.cos(height) * Math.sin(azimuth),
      length * Math.sin(height),
    ));
    this.controls.update();
    this.draw();
  }

  /** How it is looked at, for others of its kind: distances over the part's diagonal. */
  #look() {
    const { camera, controls, diagonal, state } = this;
    const { view, load, axis, cut, flip, factor } = state;
    const over = (vector, from) => vector.clone().sub(from).divideScalar(diagonal).toArray();
    return {
      state: { view, load, axis, cut, flip, factor }, whole: this.whole, zoom: this.whole ? 0 : camera.zoom * diagonal,
      from: over(camera.position, controls.target), aside: over(controls.target, this.middle),
    };
  }

  /** Scenes that stand for comparison are looked at as the one that was last moved. */
  #lead() {
    if (!this.data.together) return;
    const look = this.#look(), before = this.looked;
    this.looked = JSON.stringify(look);
    if (!before || before === this.looked) return;
    for (const other of window.scenes) if (other !== this && other.looked) other.follow(look);
  }

  follow(look) {
    const { camera, controls, diagonal } = this;
    const place = (array) => new T.Vector3(...array).multiplyScalar(diagonal);
    controls.target.copy(this.middle).add(place(look.aside));
    camera.position.copy(controls.target).add(place(look.from));
    controls.update();
    this.whole = look.whole;
    if (look.whole) this.width = 0; // fit anew
    else camera.zoom = look.zoom / diagonal;
    camera.updateProjectionMatrix();
    const before = JSON.stringify(this.#look().state);
    const { view, load } = this.state; // kept where there is none of that name
    Object.assign(this.state, look.state);
    if (!this.data.views.some(({ id }) => id === look.state.view)) this.state.view = view;
    if (![{ name: "all" }, ...this.data.cases].some(({ name }) => name === look.state.load)) this.state.load = load;
    const now = this.#look();
    this.looked = JSON.stringify(now);
    if (before === JSON.stringify(now.state)) this.draw();
    else this.show();
  }

  zoom(factor) {
    this.whole = false;
    this.camera.zoom *= factor;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Texts at their places, none over another. */
  #place() {
    const isCase = this.state.view === "case";
    const wanted = [];
    for (const place of isCase ? this.data.places ?? [] : []) {
      wanted.push([`(${place.map(figure).join(", ")})`, place, MISTAKE]);
    }
    if (isCase && this.state.labels) {
      for (const load of this.data.cases) {
        if (this.state.load !== "all" && this.state.load !== load.name) continue;
        for (const action of load.actions) wanted.push([action.text, action.at, load.colour]);
      }
      const seen = new Set();
      for (const region of this.state.regions ? this.data.regions : []) {
        if (region.role === "stress not judged" || seen.has(region.name)) continue;
        seen.add(region.name);
        wanted.push([region.name, region.at, region.colour]);
      }
    }
    const named = wanted.map(([text, at, colour]) => ({ text, at, colour, behind: this.#hidden(at) }));
    named.sort((a, b) => a.behind - b.behind); // what is seen stands at its place, the rest makes room
    while (this.labels.children.length > named.length) this.labels.lastChild.remove();
    this.leaders.replaceChildren();
    const taken = [];
    named.forEach(({ text, at, colour, behind }, k) => {
      const label = this.labels.children[k] ?? this.labels.appendChild(element("span"));
      label.textContent = text;
      label.style.setProperty("--colour", colour);
      label.className = `${colour === MISTAKE ? "mistake" : ""}${behind ? " behind" : ""}`;
      const point = new T.Vector3(...at).project(this.camera);
      const x = ((point.x + 1) / 2) * this.width, y = ((1 - point.y) / 2) * this.height;
      const width = 7.2 * text.length + 16, left = Math.min(Math.max(x, 4), this.width - width - 4);
      let top = y - 12;
      const meets = (box) => left < box[0] + box[2] && box[0] < left + width && Math.abs(top - box[1]) < 22;
      for (let tries = 0; tries < 12 && taken.some(meets); tries++) top += 22;
      top = Math.min(Math.max(top, 4), this.height - 26);
      taken.push([left, top, width]);
      label.style.transform = `translate(${left}px, ${top}px)`;
      if (top - y > 0) {
        const leader = document.createElementNS("http://www.w3.org/2000/svg", "line");
        const ends = { x1: x, y1: y, x2: left + 2, y2: top + 11, stroke: colour };
        Object.entries(ends).forEach(([name, value]) => leader.setAttribute(name, value));
        this.leaders.append(leader);
      }
    });
  }

  /** Whether the part hides a place on it. */
  #hidden(at) {
    const { part } = this.bodies;
    if (!part || this.state.through || part.labels.length > MOST_HOVERED) return false;
    const place = new T.Vector3(...at), away = this.camera.getWorldDirection(new T.Vector3());
    const ray = (this.ray ??= new T.Raycaster());
    ray.set(place.clone().addScaledVector(away, -2 * this.diagonal), away);
    const first = ray.intersectObject(part.mesh, false)
      .find((each) => !this.state.axis || this.plane.distanceToPoint(each.point) >= 0);
    return !!first && first.distance < (2 - 0.005) * this.diagonal;
  }

  // -- asking --

  /** What lies below the pointer: body, triangle and place; null where nothing does. */
  hit(event) {
    const body = this.bodies[this.data.views.find((each) => each.id === this.state.view).body];
    if (!body) return null;
    const box = this.canvas.getBoundingClientRect();
    const ray = (this.ray ??= new T.Raycaster());
    ray.setFromCamera(new T.Vector2(
      (2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height,
    ), this.camera);
    // Both sides: what is first seen from within lies behind the filled cut.
    const { material } = body.mesh, { side } = material;
    material.side = T.DoubleSide;
    const seen = ray.intersectObject(body.mesh, false)
      .find((each) => !this.state.axis || this.plane.distanceToPoint(each.point) >= 0);
    material.side = side;
    const within = seen && seen.face.normal.dot(ray.ray.direction) > 0;
    return seen && !within ? { body, triangle: seen.faceIndex, point: seen.point } : null;
  }

  #highlight(mesh, number) {
    mesh.geometry.dispose();
    mesh.geometry = new T.BufferGeometry();
    if (number === null) return;
    const { labels, geometry } = this.bodies.part;
    const picked = [];
    labels.forEach((label, t) => { if (label === number) picked.push(t); });
    for (const name of ["position", "normal"]) {
      const from = geometry.getAttribute(name).array, to = new Float32Array(9 * picked.length);
      picked.forEach((t, k) => to.set(from.subarray(9 * t, 9 * t + 9), 9 * k));
      mesh.geometry.setAttribute(name, new T.BufferAttribute(to, 3));
    }
  }

  /** Choose a face of the part by its number, or none. */
  choose(number) {
    this.state.face = number;
    this.#highlight(this.chosen, number);
    this.asked.replaceChildren(...this.#faceWords(number));
    this.faceList.value = number === null ? "" : String(number);
    this.draw();
  }

  #faceWords(number) {
    if (number === null) {
      return [element("p", { class: "hint" }, "Click a face, or choose one here, for its size and the lines that select it in a case.")];
    }
    const face = this.data.faces[number];
    const selectors = face.regions.map(([words, text]) => {
      const lines = element("pre", { tabindex: "0" }, text.trimEnd());
      const button = element("button", {
        type: "button", "aria-label": `Copy the region that finds ${words}`,
        click: () => copied(text, button, lines),
      }, "Copy");
      return element("div", { class: "selector" }, element("span", {}, `finds ${words}`), button, lines);
    });
    const none = selectors.length ? null
      : element("p", { class: "hint" }, "One of very many faces: no selector was tried on it.");
    return [element("h3", {}, face.kind), facts(face.facts), ...selectors, ...(none ? [none] : [])];
  }

  /** What a field holds at a place. */
  #fieldWords({ body, triangle, point }) {
    const view = this.data.views.find((each) => each.id === this.state.view);
    const rows = [["at", `(${point.toArray().map(figure).join(", ")}) mm`]];
    if (view.field) {
      rows.push([view.unitTitle, `${figure(body.levels[body.triangles[3 * triangle]])} ${view.unit}`]);
    } else if (view.volume) {
      const { levels, volume } = this.textures[view.volume];
      const [i, j, k] = point.toArray().map((x, n) =>
        Math.min(Math.max(Math.round((x - volume.lower[n]) / volume.step), 0), volume.shape[n] - 1));
      const level = levels[(k * volume.shape[1] + j) * volume.shape[0] + i];
      if (!volume.palette) rows.push([view.unitTitle, figure(volume.low + (level / 255) * (volume.high - volume.low))]);
    }
    return [element("h3", {}, view.title), facts(rows)];
  }

  // -- controls --

  #tools() {
    const views = [["iso", "at an angle", [1, -1.35, 0.85]], ["x", "along x", [1, 0, 0]], ["y", "along y", [0, -1, 0]], ["z", "from above", [0, -1e-4, 1]]];
    const buttons = views.map(([text, words, from]) =>
      element("button", { type: "button", "aria-label": `Look ${words}`, title: `Look ${words}`, click: () => this.turn(...from) }, text));
    const keys = element("span", { id: `${this.root.id}-keys`, class: "unseen" },
      "Arrow keys turn, plus and minus zoom, Home shows all, Escape lets a face go.");
    return element("div", { class: "tools", role: "group", "aria-label": "Direction of view" }, ...buttons, keys);
  }

  #panel() {
    const { data, state } = this;
    const change = (name, of) => async (event) => { state[name] = of(event.target); await this.show(); };
    const check = (name, text) => {
      const input = element("input", { type: "checkbox", change: change(name, (box) => box.checked) });
      input.checked = state[name];
      return element("label", { class: "check" }, input, text);
    };
    this.viewButtons = data.views.map((view) => element("button", {
      type: "button", "aria-pressed": "false", click: async () => { state.view = view.id; await this.show(); },
    }, view.title));
    this.loadList = element("select", { change: change("load", (list) => list.value) });
    this.loadRow = element("label", { class: "row" }, element("span", {}, "Load case"), this.loadList);
    this.factorList = element("input", { type: "range", min: "0", max: "2", step: "0.05", value: "0",
      input: change("factor", (slider) => Number(slider.value)) });
    this.factorWords = element("output");
    this.factorRow = element("label", { class: "row" }, element("span", {}, "Deformation"), this.factorList, this.factorWords);
    this.axisList = element("select", { change: change("axis", (list) => list.value) },
      ...[["", "none"], ["x", "across x"], ["y", "across y"], ["z", "across z"]].map(([value, text]) =>
        element("option", { value }, text)));
    this.cutSlider = element("input", { type: "range", min: "0", max: "1", step: "0.005", value: "0.5",
      "aria-label": "Place of the cut", input: change("cut", (slider) => Number(slider.value)) });
    this.cutWords = element("output");
    this.flipBox = check("flip", "other side");
    this.cutRow = element("div", { class: "row" }, this.cutSlider, this.cutWords, this.flipBox);
    this.caseChecks = element("div", { class: "checks" }, check("regions", "regions"), check("labels", "names"), check("through", "see through"));
    const order = data.faces.map((face, number) => [face, number]).sort((a, b) => b[0].area - a[0].area);
    this.faceList = element("select", { "aria-label": "Face of the part",
      change: (event) => this.choose(event.target.value === "" ? null : Number(event.target.value)) },
      element("option", { value: "" }, `choose one of ${data.faces.length}`),
      ...order.map(([face, number]) => element("option", { value: String(number) }, `${face.kind}, ${figure(face.area)} mm²`)));
    this.asked = element("div", { "aria-live": "polite" });
    this.caseFacts = element("div");
    this.panel.append(
      element("div", { class: "views", role: "group", "aria-label": "What is shown" }, ...this.viewButtons),
      this.loadRow, this.factorRow,
      element("label", { class: "row" }, element("span", {}, "Cut"), this.axisList), this.cutRow, this.caseChecks,
      (this.faceRow = element("label", { class: "row" }, element("span", {}, "Face"), this.faceList)),
      this.asked, this.caseFacts,
    );
    this.asked.replaceChildren(...this.#faceWords(null));
  }

  /** Controls that the view has, with what they show. */
  #controls(view) {
    const { state, data } = this;
    this.viewButtons.forEach((button, k) => button.setAttribute("aria-pressed", String(data.views[k] === view)));
    const names = view.field ? data.analysed.cases.map((each) => each.name)
      : view.id === "case" ? data.cases.map((each) => each.name) : [];
    const options = !view.field && names.length > 1 ? ["all", ...names] : names;
    this.loadRow.hidden = options.length < 2;
    this.loadList.replaceChildren(...options.map((name) => element("option", { value: name }, name === "all" ? "all together" : name)));
    this.loadList.value = options.includes(state.load) ? state.load : options[0] ?? "";
    this.factorList.value = String(state.factor);
    this.cutSlider.value = String(state.cut);
    this.factorRow.hidden = view.body !== "analysed";
    if (view.body === "analysed") {
      const factor = state.factor * this.#solved().factor;
      this.factorWords.textContent = factor ? `× ${figure(factor)}` : "none";
    }
    this.cutRow.hidden = !state.axis;
    this.axisList.value = state.axis;
    this.flipBox.querySelector("input").checked = state.flip;
    if (state.axis) this.cutWords.textContent = `${state.axis} = ${figure(this.cutAt)} mm`;
    this.caseChecks.hidden = this.faceRow.hidden = view.id !== "case";
    if (view.id !== this.lastView) {
      this.lastView = view.id;
      const hint = view.field || (view.volume && !data.volumes[view.volume].palette)
        ? [element("p", { class: "hint" }, "Click the body for the value there.")] : [];
      this.asked.replaceChildren(...(view.id === "case" ? this.#faceWords(state.face) : hint));
    }
    const shown = view.id === "case"
      ? data.cases.filter((each) => state.load === "all" || each.name === state.load || data.cases.length === 1) : [];
    this.caseFacts.replaceChildren(
      ...shown.flatMap((each) => {
        const title = element("h3", {}, `Load case ${each.name}`);
        title.style.setProperty("--colour", each.colour);
        title.className = "case";
        return [title, facts(each.facts)];
      }),
      ...(view.note ? [element("p", { class: "hint" }, view.note)] : []),
    );
  }

  #legends(view) {
    const entry = ({ text, colour }) => {
      const mark = element("i");
      mark.style.background = colour;
      return element("span", { class: "entry" }, mark, text);
    };
    const bar = (title, low, high, colours, over) => {
      const strip = element("i", { class: "strip" });
      strip.style.background = `linear-gradient(to right, ${PALETTES[colours].split(" ").map((c) => `#${c}`).join(", ")})`;
      return [element("span", {}, title), element("span", { class: "bar" }, figure(low), strip, figure(high)),
        ...(over ? [entry({ text: over, colour: ABOVE })] : [])];
    };
    let entries = [];
    if (view.id === "case") {
      const roles = new Map(this.data.regions.map((region) => [region.role, region.colour]));
      entries = [...roles].map(([text, colour]) => entry({ text, colour }))
        .concat(this.data.cases.filter((each) => each.actions.length).map((each) => entry({ text: `load case ${each.name}`, colour: each.colour })));
    } else if (view.volume) {
      const volume = this.data.volumes[view.volume];
      entries = volume.palette ? volume.legend.map(entry) : bar(view.unitTitle, volume.low, volume.high, volume.colours);
    } else if (view.field) {
      const solved = this.#solved(), { limit } = this.data;
      entries = view.field === "stress"
        ? bar(`${view.unitTitle}, ${view.unit}`, 0, this.#highest(solved), view.colours,
            limit != null && solved.most > limit ? `above the limit of ${figure(limit)} ${view.unit}` : null)
        : bar(`${view.unitTitle}, ${view.unit}`, 0, solved.largest, view.colours);
    }
    this.legend.replaceChildren(...entries);
    this.legend.hidden = !entries.length;
  }

  #listen() {
    const { canvas } = this;
    let pressed = null;
    canvas.addEventListener("pointerdown", (event) => { pressed = [event.clientX, event.clientY]; });
    canvas.addEventListener("pointerup", (event) => {
      if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return;
      const hit = this.hit(event);
      if (this.state.view === "case") this.choose(hit ? hit.body.labels[hit.triangle] : null);
      else if (hit) this.asked.replaceChildren(...this.#fieldWords(hit));
    });
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons || this.state.view !== "case") return;
      if (this.bodies.part.labels.length > MOST_HOVERED) return;
      const hit = this.hit(event);
      const number = hit ? hit.body.labels[hit.triangle] : null;
      if (number === this.over) return;
      this.over = number;
      this.#highlight(this.hovered, number);
      this.draw();
    });
    canvas.addEventListener("pointerleave", () => {
      this.over = null;
      this.#highlight(this.hovered, null);
      this.draw();
    });
    // The wheel scrolls the page until the scene is asked for by a click.
    canvas.addEventListener("wheel", (event) => {
      if (this.data.embedded && document.activeElement !== canvas) event.stopImmediatePropagation();
    }, { capture: true });
    canvas.addEventListener("keydown", (event) => {
      const does = {
        ArrowLeft: () => this.orbit(-10, 0), ArrowRight: () => this.orbit(10, 0),
        ArrowUp: () => this.orbit(0, 10), ArrowDown: () => this.orbit(0, -10),
        "+": () => this.zoom(1.15), "=": () => this.zoom(1.15), "-": () => this.zoom(1 / 1.15),
        Home: () => this.turn(1, -1.35, 0.85), Escape: () => this.state.view === "case" && this.choose(null),
      }[event.key];
      if (!does || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      does();
    });
    new ResizeObserver(() => this.draw()).observe(this.stage);
  }

  // A page that is loaded again, as its case is saved, keeps its view.
  #store() {
    if (!this.data.watch) return;
    const { position, zoom } = this.camera;
    sessionStorage.setItem("scene", JSON.stringify({
      state: { ...this.state, face: null }, position: position.toArray(), zoom, target: this.controls.target.toArray(),
    }));
  }

  #restore() {
    const kept = this.data.watch ? sessionStorage.getItem("scene") : null;
    if (!kept) return;
    const { state, position, zoom, target } = JSON.parse(kept);
    if (!this.data.views.some((view) => view.id === state.view)) state.view = this.data.views[0].id;
    Object.assign(this.state, state);
    this.camera.position.fromArray(position);
    this.controls.target.fromArray(target);
    this.camera.zoom = zoom;
    this.whole = false;
    this.controls.update();
  }
}

/** Load the page again when the case is saved. */
function watch(state) {
  setInterval(async () => {
    try {
      const answer = await fetch("state", { cache: "no-store" });
      if ((await answer.text()) !== state) location.reload();
    } catch {
      // The program has ended; the page stays as it is.
    }
  }, 700);
}

for (const root of document.querySelectorAll("section.scene")) {
  const data = JSON.parse(root.querySelector("script[type='application/json']").textContent);
  if (data.watch) watch(data.watch);
  if (data.part) {
    const view = new View(root, data);
    window.scenes = [...(window.scenes ?? []), view];
    view.start().catch((error) => {
      console.warn(`no scene: ${error.message}`);
      root.classList.add("without");
      for (const made of root.querySelectorAll("canvas, .leaders, .labels, .legend, .tools")) made.remove();
    });
  }
}
