// Where the robot went, as a ribbon on the floor, in the colour of the word it followed there.

import {
  BufferAttribute, BufferGeometry, Color, DoubleSide, DynamicDrawUsage, Mesh, MeshBasicMaterial,
} from 'three';

const MOST = 6000;
const STEP_M = 0.004;
// A robot does not walk that far between two frames: it was put somewhere else.
const JUMP_M = 0.3;
const HEIGHT_M = 0.0015;

export class Path {
  mesh;
  #positions = new Float32Array(MOST * 2 * 3);
  #colours = new Float32Array(MOST * 2 * 3);
  #count = 0;
  #last = null;
  #colour = new Color();

  constructor() {
    const geometry = new BufferGeometry();
    for (const [name, array] of [['position', this.#positions], ['color', this.#colours]])
      geometry.setAttribute(name, new BufferAttribute(array, 3).setUsage(DynamicDrawUsage));
    const index = [];
    for (let i = 0; i < MOST - 1; i++) index.push(2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 1, 2 * i + 3, 2 * i + 2);
    geometry.setIndex(index);
    geometry.setDrawRange(0, 0);
    this.mesh = new Mesh(geometry, new MeshBasicMaterial({
      vertexColors: true, side: DoubleSide, transparent: true, opacity: 0.9 }));
    this.mesh.frustumCulled = false;
  }

  clear() {
    this.#count = 0;
    this.#last = null;
    this.mesh.geometry.setDrawRange(0, 0);
  }

  add([x, y], colour, width) {
    const last = this.#last;
    if (last === null) { this.#last = [x, y]; return; }
    const dx = x - last[0], dy = y - last[1], far = Math.hypot(dx, dy);
    if (far > JUMP_M) { this.clear(); this.#last = [x, y]; return; }
    if (far < STEP_M) return;
    const half = width / 2, nx = (-dy / far) * half, ny = (dx / far) * half;
    this.#colour.set(colour);
    // The first step begins the ribbon.
    if (this.#count === 0) this.#put(last[0], last[1], nx, ny);
    this.#put(x, y, nx, ny);
    this.#last = [x, y];
    const geometry = this.mesh.geometry;
    geometry.attributes.position.needsUpdate = geometry.attributes.color.needsUpdate = true;
    geometry.setDrawRange(0, 6 * (this.#count - 1));
  }

  #put(x, y, nx, ny) {
    if (this.#count === MOST) {
      this.#positions.copyWithin(0, MOST * 3);
      this.#colours.copyWithin(0, MOST * 3);
      this.#count = MOST / 2;
    }
    const place = this.#count * 6, { r, g, b } = this.#colour;
    this.#positions.set([x + nx, y + ny, HEIGHT_M, x - nx, y - ny, HEIGHT_M], place);
    this.#colours.set([r, g, b, r, g, b], place);
    this.#count += 1;
  }
}
