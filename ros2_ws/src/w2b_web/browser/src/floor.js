// The floor: lines every 10 cm and every metre that fade out, and the metres written on it.

import {
  CanvasTexture, Color, Group, Mesh, MeshBasicMaterial, PlaneGeometry, ShaderMaterial,
  ShadowMaterial, SRGBColorSpace,
} from 'three';

const VERTEX = `
varying vec2 at;
void main() { vec4 world = modelMatrix * vec4(position, 1.0); at = world.xy;
  gl_Position = projectionMatrix * viewMatrix * world; }`;
const FRAGMENT = `
varying vec2 at; uniform vec2 centre; uniform vec3 ground, fine, bold; uniform float reach;
float line(float every, float wide) {
  vec2 cell = at / every, width = fwidth(cell);
  vec2 near = abs(fract(cell - 0.5) - 0.5) / max(width, vec2(1e-6));
  float fade = 1.0 - clamp(max(width.x, width.y) * 1.6, 0.0, 1.0);
  return (1.0 - clamp(min(near.x, near.y) / wide, 0.0, 1.0)) * fade;
}
void main() {
  float far = 1.0 - smoothstep(reach * 0.25, reach, distance(at, centre));
  vec3 colour = mix(ground, fine, line(0.1, 1.0) * 0.75 * far);
  colour = mix(colour, bold, line(1.0, 1.7) * far);
  gl_FragColor = vec4(colour, 1.0);
  #include <colorspace_fragment>
}`;
const LABELS_M = 5;

export class Floor {
  group = new Group();
  #material;
  #labels = new Group();
  #shadow;
  #plane;

  constructor() {
    this.#material = new ShaderMaterial({
      vertexShader: VERTEX, fragmentShader: FRAGMENT,
      uniforms: { centre: { value: [0, 0] }, reach: { value: 6 }, ground: { value: new Color() },
        fine: { value: new Color() }, bold: { value: new Color() } } });
    this.#plane = new Mesh(new PlaneGeometry(60, 60), this.#material);
    this.#plane.position.z = -0.0005;
    this.#shadow = new Mesh(new PlaneGeometry(60, 60), new ShadowMaterial({ opacity: 0.26 }));
    this.#shadow.receiveShadow = true;
    this.#shadow.position.z = 0.0003;
    this.group.add(this.#plane, this.#shadow, this.#labels);
  }

  colours({ ground, fine, bold, text }) {
    const { uniforms } = this.#material;
    uniforms.ground.value.set(ground);
    uniforms.fine.value.set(fine);
    uniforms.bold.value.set(bold);
    this.#labels.clear();
    for (let metre = -LABELS_M; metre <= LABELS_M; metre += 0.5) {
      if (metre !== 0) {
        this.#labels.add(label(`${metre} m`, metre, 0, text));
        this.#labels.add(label(`${metre} m`, 0, metre, text));
      } else this.#labels.add(label('0', 0, 0, text));
    }
  }

  follow(x, y) {
    this.#material.uniforms.centre.value = [x, y];
    for (const mesh of [this.#plane, this.#shadow]) { mesh.position.x = x; mesh.position.y = y; }
  }
}

function label(text, x, y, colour) {
  const canvas = document.createElement('canvas');
  canvas.width = 128;
  canvas.height = 48;
  const pen = canvas.getContext('2d');
  pen.font = '600 30px system-ui, sans-serif';
  pen.fillStyle = colour;
  pen.textBaseline = 'middle';
  pen.fillText(text, 8, 26);
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  texture.anisotropy = 4;
  const mesh = new Mesh(new PlaneGeometry(0.08, 0.03), new MeshBasicMaterial({
    map: texture, transparent: true, depthWrite: false }));
  mesh.position.set(x + 0.045, y + 0.018, 0.0006);
  return mesh;
}
