import {
  BufferAttribute, BufferGeometry, Color, GLSL3, Group, Mesh, MeshBasicMaterial, PerspectiveCamera, Points,
  Quaternion, Scene, ShaderMaterial, Shape, ShapeGeometry, Sphere, Vector2, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Points as NewPoints } from "../link/point_message";
import { Budget, distanceTo, nearFor, pointsDrawn } from "./detail";
import { PointRing, type Block } from "./point_ring";
import { fragmentShader, kModes, vertexShader, type Mode } from "./shader";

const kWantedMs = 40; // a frame
const kStillMs = 400, kStillTimes = 8; // after that time a picture at rest is drawn once with more points

/// What one block has on the graphics processor.
interface Drawn {
  points: Points<BufferGeometry, ShaderMaterial>;
  attributes: BufferAttribute[];
}

/// The growing cloud on a canvas. It draws only when something has changed. `attach` and `detach` put its canvas into the
/// page and out of it; the points stay on the graphics processor, and only new ones are uploaded.
export class CloudScene {
  readonly ring: PointRing;
  /// Calls of draws and points drawn in the last frame, and its time, for who measures.
  readonly last = { blocks: 0, points: 0, ms: 0 };

  #renderer: WebGLRenderer;
  #scene = new Scene();
  #camera = new PerspectiveCamera(55, 1, 0.3, 4000);
  #controls: OrbitControls;
  #material: ShaderMaterial;
  #drawn = new Map<Block, Drawn>();
  #vehicle: Group;
  #host: HTMLElement | undefined;
  #observer: ResizeObserver;
  #isStale = true;
  #follows = true;
  #pose: { place: Vector3; yaw: number } | undefined;
  #shownPose: { place: Vector3; yaw: number } | undefined;
  #budget = new Budget(kWantedMs);
  #lastFrame = 0;
  #drawnAt = 0;
  #isWhole = true; // the last picture was one at rest, or there is none
  #pointSize = 1;
  #handle = 0;

  /// Throws if the browser has no WebGL 2.
  constructor(capacity: number) {
    this.ring = new PointRing(capacity);
    this.#renderer = new WebGLRenderer({ antialias: false, powerPreference: "high-performance" });
    this.#camera.up.set(0, 0, 1);
    this.#camera.position.set(0, -25, 14);
    this.#controls = new OrbitControls(this.#camera, this.#renderer.domElement);
    this.#controls.maxPolarAngle = 0.495 * Math.PI;
    this.#controls.minDistance = 2;
    this.#controls.maxDistance = 1500;
    this.#controls.addEventListener("change", () => (this.#isStale = true));
    this.#material = new ShaderMaterial({
      glslVersion: GLSL3,
      vertexShader,
      fragmentShader,
      uniforms: {
        mode: { value: 0 },
        size: { value: 40 },
        smallest: { value: 1.5 },
        heights: { value: new Vector2(-2, 12) },
      },
    });
    this.#vehicle = vehicle();
    this.#vehicle.visible = false;
    this.#scene.add(this.#vehicle);
    this.#observer = new ResizeObserver(() => this.#resize());
  }

  attach(host: HTMLElement): void {
    this.#host = host;
    host.append(this.#renderer.domElement);
    this.#observer.observe(host);
    this.#resize();
    this.#lastFrame = 0;
    const frame = (time: number): void => {
      this.#handle = requestAnimationFrame(frame);
      this.#frame(time);
    };
    this.#handle = requestAnimationFrame(frame);
  }
  detach(): void {
    cancelAnimationFrame(this.#handle);
    this.#observer.disconnect();
    this.#renderer.domElement.remove();
    this.#host = undefined;
  }

  append(points: NewPoints): void {
    this.ring.append(points);
    this.#isStale = true;
  }
  clear(): void {
    this.ring.clear();
    this.#pose = this.#shownPose = undefined;
    this.#vehicle.visible = false;
    this.#isStale = true;
  }
  /// Body in enu; body has y ahead.
  pose(place: { x: number; y: number; z: number }, turn: { x: number; y: number; z: number; w: number }): void {
    const ahead = new Vector3(0, 1, 0).applyQuaternion(new Quaternion(turn.x, turn.y, turn.z, turn.w));
    this.#pose = { place: new Vector3(place.x, place.y, place.z), yaw: Math.atan2(-ahead.x, ahead.y) };
    this.#isStale = true;
  }
  set mode(mode: Mode) {
    this.#material.uniforms["mode"]!.value = kModes.indexOf(mode);
    this.#isStale = true;
  }
  set follows(follows: boolean) {
    this.#follows = follows;
    if (follows) this.#shownPose = undefined; // behind the vehicle again
    this.#isStale = true;
  }
  set pointSize(size: number) {
    this.#pointSize = size;
    this.#resize();
  }
  set background(colour: string) {
    this.#scene.background = new Color(colour);
    this.#isStale = true;
  }

  #resize(): void {
    if (!this.#host) return;
    const { clientWidth: width, clientHeight: height } = this.#host;
    if (width === 0 || height === 0) return;
    const ratio = Math.min(devicePixelRatio, 2);
    this.#renderer.setPixelRatio(ratio);
    this.#renderer.setSize(width, height);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    this.#material.uniforms["size"]!.value = 0.07 * this.#pointSize * height * ratio;
    this.#material.uniforms["smallest"]!.value = Math.max(1, 1.6 * this.#pointSize * ratio);
    this.#isStale = true;
  }

  /// Moves camera and vehicle to the newest pose, with a little inertia, so that ten poses a second do not jerk.
  #followPose(): void {
    const to = this.#pose;
    if (!to) return;
    this.#vehicle.visible = true;
    const from = this.#shownPose;
    if (!from) {
      this.#shownPose = { place: to.place.clone(), yaw: to.yaw };
      if (this.#follows) {
        const behind = new Vector3(0, -18, 9).applyAxisAngle(this.#camera.up, to.yaw);
        this.#camera.position.copy(to.place).add(behind);
        this.#controls.target.copy(to.place).add(new Vector3(0, 6, 0).applyAxisAngle(this.#camera.up, to.yaw));
      }
    } else {
      let turn = to.yaw - from.yaw;
      turn = Math.atan2(Math.sin(turn), Math.cos(turn));
      const way = to.place.clone().sub(from.place);
      if (way.length() < 1e-3 && Math.abs(turn) < 1e-4) return;
      const part = way.length() > 50 ? 1 : 0.25;
      way.multiplyScalar(part);
      const before = from.place.clone();
      from.place.add(way);
      from.yaw += turn * part;
      if (this.#follows) {
        for (const one of [this.#camera.position, this.#controls.target])
          one.sub(before).applyAxisAngle(this.#camera.up, turn * part).add(from.place);
      }
      this.#isStale = true;
    }
    const shown = this.#shownPose!;
    this.#vehicle.position.copy(shown.place);
    this.#vehicle.rotation.z = shown.yaw;
    (this.#material.uniforms["heights"]!.value as Vector2).set(shown.place.z - 3, shown.place.z + 12);
  }

  #frame(time: number): void {
    this.#followPose();
    this.#controls.update();
    const isAtRest = !this.#isStale;
    if (isAtRest) {
      this.#lastFrame = 0;
      if (this.#isWhole || time - this.#drawnAt < kStillMs) return;
    }
    this.#isStale = false;
    if (this.#lastFrame > 0) this.#budget.frame(time - this.#lastFrame);
    if (!isAtRest) this.#lastFrame = time;
    this.#drawnAt = time;
    const began = performance.now();
    this.#upload();
    this.#isWhole = isAtRest;
    this.#choose(isAtRest ? kStillTimes * this.#budget.points : this.#budget.points);
    this.#renderer.render(this.#scene, this.#camera);
    this.last.ms = performance.now() - began;
  }

  #upload(): void {
    const blocks = new Set(this.ring.blocks);
    for (const [block, drawn] of this.#drawn) {
      if (blocks.has(block)) continue;
      this.#scene.remove(drawn.points);
      drawn.points.geometry.dispose();
      this.#drawn.delete(block);
    }
    for (const block of blocks) {
      let drawn = this.#drawn.get(block);
      if (!drawn) this.#drawn.set(block, (drawn = this.#make(block)));
      if (block.dirtyFrom >= block.count) continue;
      for (const attribute of drawn.attributes) {
        attribute.clearUpdateRanges();
        attribute.addUpdateRange(block.dirtyFrom * attribute.itemSize, (block.count - block.dirtyFrom) * attribute.itemSize);
        attribute.needsUpdate = true;
      }
      block.dirtyFrom = block.count;
      const sphere = drawn.points.geometry.boundingSphere!;
      sphere.center.set(...block.least).add(new Vector3(...block.most)).multiplyScalar(0.5);
      sphere.radius = sphere.center.distanceTo(new Vector3(...block.most));
    }
  }

  #make(block: Block): Drawn {
    const geometry = new BufferGeometry();
    const attributes = [new BufferAttribute(block.place, 3), new BufferAttribute(block.colour, 4, true), new BufferAttribute(block.extra, 4, true)];
    for (const [i, name] of ["position", "colour", "extra"].entries()) geometry.setAttribute(name, attributes[i]!);
    geometry.boundingSphere = new Sphere();
    const points = new Points(geometry, this.#material);
    this.#scene.add(points);
    return { points, attributes };
  }

  #choose(budget: number): void {
    const at: [number, number, number] = [this.#camera.position.x, this.#camera.position.y, this.#camera.position.z];
    const blocks = [...this.#drawn].map(([block, drawn]) => ({ block, drawn, distance: distanceTo(block, at) }));
    const near = nearFor(budget, blocks);
    this.last.blocks = this.last.points = 0;
    for (const { block, drawn, distance } of blocks) {
      const n = pointsDrawn(block, distance, near);
      drawn.points.visible = n > 0;
      drawn.points.geometry.setDrawRange(0, n);
      if (n > 0) ++this.last.blocks;
      this.last.points += n;
    }
  }
}

/// An arrow on the ground that points ahead.
function vehicle(): Group {
  const shape = new Shape([new Vector2(0, 2.4), new Vector2(1.1, -2), new Vector2(0, -1.2), new Vector2(-1.1, -2)]);
  const group = new Group();
  group.add(new Mesh(new ShapeGeometry(shape), new MeshBasicMaterial({ color: 0xff5a1f, side: 2 })));
  return group;
}
