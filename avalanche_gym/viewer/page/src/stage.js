// Camera, light and sky.

import {
  BackSide, BufferAttribute, BufferGeometry, Color, DirectionalLight, FogExp2, HemisphereLight, Mesh, PCFShadowMap, PerspectiveCamera, Points,
  PointsMaterial, Scene, ShaderMaterial, SphereGeometry, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const SKY_RADIUS = 1; // drawn behind everything, so any will do
const STARS = 1500;

export class Stage {
  constructor(canvas, { shadows }) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true });
    this.renderer.shadowMap.enabled = shadows;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(40, 1, 0.05, 2000);
    this.camera.up.set(0, 0, 1);
    this.hemisphere = new HemisphereLight();
    this.hemisphere.position.set(0, 0, 1);
    this.sun = new DirectionalLight();
    this.sun.castShadow = shadows;
    this.sun.shadow.mapSize.set(2048, 2048);
    this.scene.add(this.hemisphere, this.sun, this.sun.target);
    this.addSky();
    this.follows = true;
    this.makeControls(new Vector3());
  }

  makeControls(target) {
    this.controls?.dispose();
    // The controls keep the vertical of the moment they are made.
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.target.copy(target);
    this.controls.enabled = !this.follows;
  }

  addSky() {
    this.sky = new Mesh(
      new SphereGeometry(SKY_RADIUS, 32, 24),
      new ShaderMaterial({
        side: BackSide,
        depthWrite: false,
        depthTest: false,
        fog: false,
        uniforms: {
          zenith: { value: new Color() }, horizon: { value: new Color() }, nadir: { value: new Color() },
          sunColor: { value: new Color() }, sun: { value: new Vector3(0, 0, 1) }, glow: { value: 0 },
        },
        vertexShader: `varying vec3 direction;
          void main() {
            direction = position;
            gl_Position = projectionMatrix * vec4(mat3(viewMatrix) * position, 1.0);
          }`,
        fragmentShader: `varying vec3 direction;
          uniform vec3 zenith, horizon, nadir, sunColor, sun;
          uniform float glow;
          void main() {
            vec3 d = normalize(direction);
            vec3 color = d.z > 0.0 ? mix(horizon, zenith, pow(d.z, 0.6)) : mix(horizon, nadir, pow(-d.z, 0.5));
            float near = max(dot(d, sun), 0.0);
            color += sunColor * glow * (0.25 * pow(near, 24.0) + pow(near, 900.0));
            gl_FragColor = vec4(color, 1.0);
            #include <colorspace_fragment>
          }`,
      }),
    );
    this.sky.frustumCulled = false;
    this.sky.renderOrder = -2;
    this.scene.add(this.sky);

    // Evenly spread over the sphere by Fibonacci's spiral, jittered by it too; always the same.
    const positions = new Float32Array(3 * STARS), colors = new Float32Array(3 * STARS);
    for (let i = 0; i < STARS; i++) {
      const jitter = (k) => (Math.abs(Math.sin((i + 1) * k) * 43758.5453) % 1);
      const z = 2 * jitter(12.9898) - 1, angle = 2 * Math.PI * jitter(78.233), r = Math.sqrt(1 - z * z);
      positions.set([500 * r * Math.cos(angle), 500 * r * Math.sin(angle), 500 * z], 3 * i);
      colors.fill(0.15 + 0.85 * jitter(39.425) ** 4, 3 * i, 3 * i + 3);
    }
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(positions, 3));
    geometry.setAttribute("color", new BufferAttribute(colors, 3));
    const material = new PointsMaterial({ size: 1.6, sizeAttenuation: false, vertexColors: true, depthTest: false, depthWrite: false, fog: false });
    this.stars = new Points(geometry, material);
    this.stars.frustumCulled = false;
    this.stars.renderOrder = -1;
    this.scene.add(this.stars);
  }

  setLight(light) {
    const uniforms = this.sky.material.uniforms;
    for (const [name, key] of [["zenith", "zenith"], ["horizon", "horizon"], ["nadir", "nadir"], ["sunColor", "sun_color"]]) {
      uniforms[name].value.setRGB(...light[key]);
    }
    uniforms.glow.value = light.glow;
    // A surface sends light of 1 / pi in each direction for the light that falls on it.
    this.hemisphere.color.setRGB(...light.above.map((value) => Math.PI * value));
    this.hemisphere.groundColor.setRGB(...light.below.map((value) => Math.PI * value));
    this.sun.color.setRGB(...light.sun_color.map((value) => Math.PI * value));
    this.hemisphere.intensity = this.sun.intensity = 1;
    this.stars.visible = light.stars > 0;
    this.stars.material.opacity = light.stars;
    this.haze = light.haze;
    this.horizon = new Color().setRGB(...light.horizon);
  }

  // The view that the show proposes; taken over while the camera follows.
  setView(frame, blended) {
    const read = (array) => new Vector3().fromArray(array);
    const view = { eye: read(frame.eye), target: read(frame.target), up: read(frame.up), fov: frame.fov, sun: read(frame.sun) };
    this.scale = view.eye.distanceTo(view.target);
    this.sky.material.uniforms.sun.value.copy(view.sun);
    // What jumps is not blended, as when another episode begins.
    const jumps = !blended || this.proposed.eye.distanceTo(view.eye) > 0.5 * this.scale;
    this.before = jumps ? view : this.proposed;
    this.proposed = view;
  }

  begin() {
    this.follows = true;
    this.controls.enabled = false;
  }

  // From now on the user turns the view.
  release() {
    if (!this.follows || !this.proposed) return;
    this.follows = false;
    const { up } = this.proposed, right = this.camera.getWorldDirection(new Vector3()).cross(up);
    // A level view turns about the vertical; one that leans, as over the side of a planet, about its own.
    const isLevel = up.z > 0 && Math.abs(right.z) < 1e-3 * right.length();
    this.camera.up.copy(isLevel ? new Vector3(0, 0, 1) : up).normalize();
    this.makeControls(this.look);
  }

  // Move the camera; `share` of the way from the last frame to this one has passed.
  update(share) {
    const view = this.proposed;
    if (!view) return;
    if (this.follows) {
      this.camera.position.lerpVectors(this.before.eye, view.eye, share);
      this.look = this.before.target.clone().lerp(view.target, share);
      this.camera.up.lerpVectors(this.before.up, view.up, share).normalize();
      this.camera.lookAt(this.look);
    } else {
      this.controls.update();
    }
    if (this.camera.fov !== view.fov) this.camera.fov = view.fov;
    this.camera.near = 0.002 * this.scale;
    this.camera.far = 60 * this.scale;
    this.camera.updateProjectionMatrix();
    this.scene.fog = this.haze > 0 ? (this.scene.fog ?? new FogExp2(this.horizon)) : null;
    if (this.scene.fog) {
      this.scene.fog.color.copy(this.horizon);
      // Half of a colour has faded at haze times half the distance: exp(-(density distance)^2) = 1/2.
      this.scene.fog.density = Math.sqrt(Math.LN2) / (0.5 * this.haze * this.scale);
    }
    const reach = 0.75 * this.scale;
    this.sun.position.copy(view.target).addScaledVector(view.sun, 2 * reach);
    this.sun.target.position.copy(view.target);
    const box = this.sun.shadow.camera;
    if (box.right !== reach) {
      Object.assign(box, { left: -reach, right: reach, top: reach, bottom: -reach, near: 0.1 * reach, far: 4 * reach });
      box.updateProjectionMatrix();
      // About one texel of the map: less shows stripes on lit ground, more detaches shadows.
      this.sun.shadow.normalBias = (2.5 * reach) / this.sun.shadow.mapSize.x;
      this.sun.shadow.bias = -0.0002;
    }
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    const ratio = Math.min(devicePixelRatio, 2);
    if (this.canvas.width === Math.floor(clientWidth * ratio) && this.canvas.height === Math.floor(clientHeight * ratio)) return;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
  }

  // Keep the middle of the scene in the middle of what the panel leaves free.
  setPanelWidth(width) {
    const { clientWidth, clientHeight } = this.canvas;
    this.camera.setViewOffset(clientWidth, clientHeight, clientWidth > 2 * width ? -0.5 * width : 0, 0, clientWidth, clientHeight);
  }

  render(share) {
    this.resize();
    this.update(share);
    this.renderer.render(this.scene, this.camera);
  }
}
