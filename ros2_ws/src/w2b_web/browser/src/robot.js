// A robot description, read by the server, as objects of three.js.

import {
  Box3, BoxGeometry, Color, CylinderGeometry, CapsuleGeometry, Euler, Group, Mesh,
  MeshStandardMaterial, Quaternion, SphereGeometry, Vector3,
} from 'three';

const LIT = new Color(0x19c37d);
const DARK = new Color(0x000000);

function geometryOf({ kind, size }) {
  if (kind === 'sphere') return new SphereGeometry(size[0], 28, 18);
  if (kind === 'cylinder' || kind === 'capsule') {
    const made = kind === 'cylinder' ? new CylinderGeometry(size[0], size[0], size[1], 28)
      : new CapsuleGeometry(size[0], size[1], 8, 24);
    // URDF's run along z, those of three.js along y.
    return made.rotateX(Math.PI / 2);
  }
  return new BoxGeometry(...size);
}

function place(object, { xyz, rpy }) {
  object.position.fromArray(xyz);
  object.quaternion.setFromEuler(new Euler(...rpy, 'ZYX'));
}

export class Robot {
  root = new Group();
  size = 0.3;
  #joints = new Map();
  #materials = new Map();
  #box = new Box3();

  constructor(shape) {
    const links = new Map(), children = new Set();
    for (const link of shape.links) {
      const group = new Group(), materials = [];
      for (const visual of link.visuals) {
        const [red, green, blue, alpha] = visual.colour;
        const material = new MeshStandardMaterial({
          color: new Color().setRGB(red, green, blue, 'srgb'), roughness: 0.62, metalness: 0.08,
          transparent: alpha < 1, opacity: alpha });
        const mesh = new Mesh(geometryOf(visual), material);
        mesh.castShadow = mesh.receiveShadow = true;
        place(mesh, visual);
        group.add(mesh);
        materials.push(material);
      }
      links.set(link.name, group);
      this.#materials.set(link.name, materials);
    }
    for (const joint of shape.joints) {
      const fixed = new Group(), moved = new Group();
      place(fixed, joint);
      fixed.add(moved);
      moved.add(links.get(joint.child));
      links.get(joint.parent).add(fixed);
      children.add(joint.child);
      if (joint.kind !== 'fixed')
        this.#joints.set(joint.name, { ...joint, moved, along: new Vector3(...joint.axis).normalize() });
    }
    for (const [name, group] of links) if (!children.has(name)) this.root.add(group);
    this.root.updateMatrixWorld(true);
    const extent = new Box3().setFromObject(this.root);
    if (!extent.isEmpty()) this.size = extent.getSize(new Vector3()).length();
  }

  joints(names, positions) {
    names.forEach((name, index) => {
      const joint = this.#joints.get(name), position = positions[index];
      if (!joint || position === null) return;
      if (joint.kind === 'turn') joint.moved.quaternion.setFromAxisAngle(joint.along, position);
      else joint.moved.position.copy(joint.along).multiplyScalar(position);
    });
  }

  // Position in metres and orientation wxyz; without a position it stands on the floor where it is.
  pose(position, orientation) {
    if (orientation) {
      const [w, x, y, z] = orientation;
      this.root.quaternion.copy(new Quaternion(x, y, z, w));
    }
    if (position) { this.root.position.fromArray(position); return; }
    this.root.position.z = 0;
    this.root.updateMatrixWorld(true);
    this.#box.setFromObject(this.root);
    if (!this.#box.isEmpty()) this.root.position.z = -this.#box.min.z;
  }

  contacts(names, touching) {
    names.forEach((name, index) => {
      for (const material of this.#materials.get(name) ?? [])
        material.emissive.copy(touching[index] ? LIT : DARK).multiplyScalar(0.55);
    });
  }

  dispose() {
    this.root.traverse(object => { object.geometry?.dispose(); object.material?.dispose(); });
  }
}
