// SPDX-License-Identifier: Apache-2.0
// The arm in three dimensions, drawn from its URDF. The links have no meshes: each is a rod between joints.

import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import URDFLoader, { type URDFJoint, type URDFRobot } from "urdf-loader";

import type { ArmState, Description, Joint } from "./state.js";
import { CAMERA, TARGET, viewAngle_deg } from "./view_angle.js";

const RADIANS = Math.PI / 180;
const SOLID = new THREE.MeshStandardMaterial({ color: 0xe07b1f, roughness: 0.6 });
const KNOB = new THREE.MeshStandardMaterial({ color: 0x4b5a6b, roughness: 0.6 });
/// Only its far side is drawn: a rim remains where the measured arm is at its set-points.
const GHOST = new THREE.MeshStandardMaterial(
  { color: 0x2f8fff, transparent: true, opacity: 0.5, depthWrite: false, side: THREE.BackSide });
const UP = new THREE.Vector3(0, 1, 0);

/// One drawing of the arm.
class Figure {
  readonly robot: URDFRobot;
  private readonly rods: { rod: THREE.Mesh; joint: URDFJoint }[] = [];

  constructor(urdf: string, private readonly joints: Joint[], private readonly ghost: boolean) {
    this.robot = new URDFLoader().parse(urdf);
    for (const joint of Object.values(this.robot.joints)) joint.ignoreLimits = true;
  }

  /// Adds rods and knobs of a size that fits the arm.
  dress(radius_m: number): void {
    const thickness_m = this.ghost ? 1.35 * radius_m : radius_m;
    const cylinder = new THREE.CylinderGeometry(thickness_m, thickness_m, 1, 20);
    const ball = new THREE.SphereGeometry(1.2 * thickness_m, 20, 14);
    for (const joint of Object.values(this.robot.joints)) {
      const rod = new THREE.Mesh(cylinder, this.ghost ? GHOST : SOLID);
      joint.parent?.add(rod);
      this.rods.push({ rod, joint });
      const isTip = joint.children.every((link) => link.children.length === 0);
      if (!isTip) joint.add(new THREE.Mesh(ball, this.ghost ? GHOST : KNOB));
      else if (!this.ghost) joint.add(new THREE.AxesHelper(6 * radius_m));
    }
    this.place();
  }

  set(values: number[]): void {
    this.joints.forEach((joint, i) => {
      const value = values[i] ?? NaN;
      if (!Number.isFinite(value)) return;
      this.robot.setJointValue(joint.name, joint.unit === "m" ? value : value * RADIANS);
    });
    this.place();
  }

  /// Puts each rod between its link's frame and the next joint's, which a sliding joint moves.
  private place(): void {
    for (const { rod, joint } of this.rods) {
      const length_m = joint.position.length();
      rod.visible = length_m > 1e-6;
      if (!rod.visible) continue;
      rod.position.copy(joint.position).multiplyScalar(0.5);
      rod.quaternion.setFromUnitVectors(UP, joint.position.clone().divideScalar(length_m));
      rod.scale.set(1, length_m, 1);
    }
  }
}

export class Arm3d {
  readonly canvas: HTMLCanvasElement;
  private readonly renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(undefined, 1, 0.01, 100);
  private readonly controls: OrbitControls;
  private readonly commanded: Figure;
  private readonly measured: Figure;
  private readonly resizes: ResizeObserver;
  private isAsked = false;

  /// Throws if the browser has no WebGL or the URDF is invalid.
  constructor(description: Description) {
    this.canvas = this.renderer.domElement;
    this.commanded = new Figure(description.urdf, description.joints, false);
    this.measured = new Figure(description.urdf, description.joints, true);
    const world = new THREE.Group(); // the URDF's z points up, three's y does
    world.rotation.x = -Math.PI / 2;
    world.add(this.commanded.robot, this.measured.robot);
    const size_m = sizeOf(this.commanded.robot);
    this.commanded.dress(0.028 * size_m);
    this.measured.dress(0.028 * size_m);
    const light = new THREE.DirectionalLight(0xffffff, 2);
    light.position.set(1, 3, 2);
    const floor = new THREE.GridHelper(1.6 * size_m, 16, 0x8a8f98, 0x8a8f98);
    floor.material.transparent = true;
    floor.material.opacity = 0.4;
    this.scene.add(world, light, new THREE.HemisphereLight(0xffffff, 0x888888, 1.6), floor);
    this.camera.position.fromArray(CAMERA).multiplyScalar(size_m);
    this.controls = new OrbitControls(this.camera, this.canvas);
    this.controls.target.fromArray(TARGET).multiplyScalar(size_m);
    this.controls.addEventListener("change", () => this.ask());
    this.controls.update();
    this.canvas.style.touchAction = "pan-y"; // a finger can still scroll the page
    this.resizes = new ResizeObserver(() => this.resize());
    this.resizes.observe(this.canvas);
  }

  show(arm: ArmState): void {
    this.commanded.set(arm.commanded);
    this.measured.robot.visible = arm.measured !== null;
    if (arm.measured) this.measured.set(arm.measured);
    this.ask();
  }

  /// Browsers allow few drawings at a time: this frees one.
  close(): void {
    this.resizes.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0 || height === 0) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.fov = viewAngle_deg(this.camera.aspect);
    this.camera.updateProjectionMatrix();
    this.ask();
  }

  /// Draws once before the browser's next picture, however often it was asked.
  private ask(): void {
    if (this.isAsked) return;
    this.isAsked = true;
    requestAnimationFrame(() => {
      this.isAsked = false;
      this.renderer.render(this.scene, this.camera);
    });
  }
}

/// The length of the outstretched arm, with sliding joints at zero.
function sizeOf(robot: URDFRobot): number {
  const length_m = Object.values(robot.joints).reduce((sum, joint) => sum + joint.position.length(), 0);
  return Math.max(0.1, length_m);
}
