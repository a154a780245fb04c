// The view: floor, robot, path, a camera that follows. Drawn only when something changed.

import {
  Color, DirectionalLight, Fog, HemisphereLight, PCFShadowMap, PerspectiveCamera, Scene, Vector3,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { Floor } from './floor.js';
import { Path } from './path.js';
import { Robot } from './robot.js';

const THEMES = {
  light: { ground: '#eef1f5', fine: '#d3dae3', bold: '#9fb0c3', text: '#7d8c9e' },
  dark: { ground: '#10151c', fine: '#222b37', bold: '#42526a', text: '#66788f' },
};
// Drawn by the CPU a picture may take longer than that: then it is made simpler.
const SLOW_MS = 60, JUDGED = 4;
const VIEWS = { follow: [1.0, -1.25, 0.72], side: [0, -1.7, 0.3], top: [0, -0.01, 2.2] };

export class View {
  robot = null;
  drawn = 0;
  #follow = true;
  #dirty = true;
  #path = new Path();
  #floor = new Floor();
  #scene = new Scene();
  #camera = new PerspectiveCamera(38, 1, 0.02, 60);
  #sun = new DirectionalLight(0xffffff, 2.4);
  #place;
  #renderer;
  #controls;
  #slow = new URLSearchParams(location.search).has('quality') ? -1e9 : 0;

  // Throws where the browser has no WebGL.
  constructor(place) {
    this.#place = place;
    this.#renderer = new WebGLRenderer({ antialias: true });
    this.#renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.#renderer.shadowMap.enabled = true;
    this.#renderer.shadowMap.type = PCFShadowMap;
    this.#renderer.domElement.setAttribute('aria-hidden', 'true');
    place.append(this.#renderer.domElement);
    this.#camera.up.set(0, 0, 1);
    this.#controls = new OrbitControls(this.#camera, this.#renderer.domElement);
    this.#controls.maxPolarAngle = 1.52;
    this.#controls.minDistance = 0.1;
    this.#controls.maxDistance = 12;
    this.#controls.addEventListener('change', () => { this.#dirty = true; });
    const { shadow } = this.#sun;
    this.#sun.castShadow = true;
    shadow.mapSize.set(1024, 1024);
    shadow.bias = -0.0004;
    shadow.normalBias = 0.002;
    this.#scene.fog = new Fog(0xffffff, 4, 16);
    this.#scene.add(new HemisphereLight(0xffffff, 0x8a94a3, 1.7), this.#sun, this.#sun.target,
      this.#floor.group, this.#path.mesh);
    this.view('follow');
    new ResizeObserver(() => this.#resize()).observe(place);
    place.addEventListener('keydown', event => this.#onKey(event));
    requestAnimationFrame(() => this.#loop());
  }

  theme(name) {
    const colours = THEMES[name];
    this.#scene.background = new Color(colours.ground);
    this.#scene.fog.color.set(colours.ground);
    this.#floor.colours(colours);
    this.#dirty = true;
  }

  build(shape) {
    if (this.robot) { this.#scene.remove(this.robot.root); this.robot.dispose(); }
    this.robot = new Robot(shape);
    this.#scene.add(this.robot.root);
    const reach = this.robot.size, { camera } = this.#sun.shadow;
    camera.left = camera.bottom = -reach;
    camera.right = camera.top = reach;
    camera.near = 0.1;
    camera.far = 6;
    camera.updateProjectionMatrix();
    this.view('follow');
  }

  view(name) {
    this.#follow = true;
    const size = this.robot?.size ?? 0.35, target = this.#controls.target;
    this.#camera.position.copy(target).addScaledVector(new Vector3(...VIEWS[name]), size * 1.12);
    this.#dirty = true;
  }

  clearPath() { this.#path.clear(); this.#dirty = true; }

  frame(frame, names, contacts, colour) {
    if (!this.robot) return;
    this.robot.joints(names, frame.q);
    this.robot.pose(frame.p, frame.o);
    this.robot.contacts(contacts, frame.c);
    if (frame.p) this.#path.add(frame.p, colour, this.robot.size * 0.03);
    this.#dirty = true;
  }

  #onKey(event) {
    const turn = { ArrowLeft: [-0.15, 0], ArrowRight: [0.15, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[event.key];
    const zoom = { '+': 0.87, '-': 1.15 }[event.key];
    if (!turn && !zoom) return;
    event.preventDefault();
    const arm = this.#camera.position.clone().sub(this.#controls.target);
    if (zoom) arm.multiplyScalar(zoom);
    else {
      arm.applyAxisAngle(this.#camera.up, turn[0]);
      const side = new Vector3().crossVectors(this.#camera.up, arm).normalize();
      arm.applyAxisAngle(side, turn[1]);
    }
    this.#camera.position.copy(this.#controls.target).add(arm);
    this.#dirty = true;
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.#place;
    if (!width || !height) return;
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    // A narrow view sees as much of the robot as a wide one.
    this.#camera.fov = this.#camera.aspect < 1 ? 52 : 38;
    this.#camera.updateProjectionMatrix();
    this.#dirty = true;
  }

  #loop() {
    requestAnimationFrame(() => this.#loop());
    if (!this.#dirty || document.hidden) return;
    this.#dirty = false;
    const at = this.robot?.root.position;
    if (at && this.#follow) {
      const moved = new Vector3(at.x, at.y, at.z * 0.6).sub(this.#controls.target);
      this.#controls.target.add(moved);
      this.#camera.position.add(moved);
    }
    this.#controls.update();
    const { target } = this.#controls;
    this.#floor.follow(target.x, target.y);
    this.#sun.target.position.copy(target);
    this.#sun.position.copy(target).add(new Vector3(0.9, -1.1, 2.0));
    const began = performance.now();
    this.#renderer.render(this.#scene, this.#camera);
    this.#dirty = false;
    this.drawn += 1;
    this.#adapt(performance.now() - began);
  }

  #adapt(took) {
    if (this.drawn < 2) return; // the first compiles
    this.#slow = took > SLOW_MS ? this.#slow + 1 : Math.min(this.#slow, 0);
    if (this.#slow < JUDGED) return;
    this.#slow = -1e9;
    this.#renderer.setPixelRatio(0.6);
    this.#renderer.shadowMap.enabled = false;
    this.#sun.castShadow = false;
    this.#resize();
  }
}
