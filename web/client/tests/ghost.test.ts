// Another replay on the same table: its arm, puck and trails in 3-D, and its outline in the flat view.

import { Color, Mesh, MeshStandardMaterial, type BufferGeometry, type Material } from "three";
import { beforeAll, describe, expect, it } from "vitest";
import { decodeMotion } from "../src/clip/motion";
import { drawArmOutline } from "../src/flat/arm";
import { Projection } from "../src/flat/projection";
import { Kinematics } from "../src/model/kinematics";
import { newPose } from "../src/motion/pose";
import type { FrameState, Layers } from "../src/replay/frame-state";
import type { Palette } from "../src/replay/palette";
import { Source } from "../src/replay/source";
import { BASE_BODY, armPieces } from "../src/view3d/arm-shapes";
import { GhostModel } from "../src/view3d/ghost";
import { encode, stillArmColumns } from "./encoder";

const GHOST = "#12753f";
/** All colours are red, except for that of the ghost. */
const PALETTE = new Proxy({} as Palette, {
  get: (_, name) => (name === "rp-ghost" ? GHOST : "#ff0000"),
});
const LAYERS: Layers = { seen: true, mallet: true, commanded: true, puck: true, wholePart: true };

describe("a ghost", () => {
  let frame: FrameState;

  beforeAll(async () => {
    const clip = encode({ samples: 4 }, stillArmColumns(4, (k) => 0.1 * k, () => 0.2)); // prettier-ignore
    expect(decodeMotion(clip).samples).toBe(4);
    const source = new Source({ motion: "/m", observed: null, samples: null }, () =>
      Promise.resolve(new Response(clip)),
    );
    const part = await source.partAt(0);
    const pose = newPose();
    part.interpolation.poseAt(2, pose);
    const arms = [new Kinematics(0), new Kinematics(1)] as const;
    arms[0].set(pose.arms[0].q);
    frame = {
      part,
      position: 2,
      pose,
      arms,
      layers: LAYERS,
      seenX: 0.5,
      seenY: 0,
      isPuckLost: true,
      ghost: null,
    };
  });

  /** The visible meshes of a model. */
  function shown(model: GhostModel): Mesh<BufferGeometry, Material>[] {
    const meshes: Mesh<BufferGeometry, Material>[] = [];
    model.group.traverseVisible((object) => {
      if (object instanceof Mesh) meshes.push(object as Mesh<BufferGeometry, Material>);
    });
    return meshes;
  }

  it("has arm, puck and trails, and no observations", () => {
    const model = new GhostModel(frame.arms[0]);
    model.set(frame, 0.001, 0.001);
    const meshes = shown(model);
    // Two trails, the puck with its halo, and the arm.
    expect(meshes).toHaveLength(5);
    const puck = meshes.find(({ position }) => position.x !== 0);
    expect(puck?.position.x).toBeCloseTo(0.2, 6);
    expect(puck?.position.y).toBeCloseTo(0.2, 6);
    model.set({ ...frame, layers: { ...LAYERS, puck: false, mallet: false } }, 0.001, 0.001);
    expect(shown(model)).toHaveLength(3);
    model.set(null, 0.001, 0.001);
    expect(shown(model)).toHaveLength(0);
  });

  it("is translucent in its own colour, behind what it coincides with", () => {
    const model = new GhostModel(frame.arms[0]);
    model.paint(PALETTE);
    model.set(frame, 0.001, 0.001);
    const solid = shown(model).filter(({ material }) => material instanceof MeshStandardMaterial);
    expect(solid).toHaveLength(2);
    for (const { material, castShadow } of solid) {
      expect(material).toMatchObject({ transparent: true, polygonOffset: true, polygonOffsetFactor: 1 });
      expect(material.opacity).toBeLessThan(0.8);
      expect(castShadow).toBe(false);
    }
    const arm = shown(model).find((mesh) => "skeleton" in mesh);
    const colours = arm?.geometry.getAttribute("color");
    const last = (colours?.count ?? 0) - 1;
    // The mallet is the last piece of an arm.
    expect(colours?.getY(last)).toBeCloseTo(new Color(GHOST).g, 5);
  });

  it("stands on the base of the arm of the table", () => {
    const bodies = armPieces(0, -1, "ghost").map((piece) => piece.body);
    expect(bodies).not.toContain(BASE_BODY);
    expect(armPieces(0, -1, "solid").length).toBeGreaterThan(bodies.length);
  });

  it("has only an outline in the flat view", () => {
    const strokes: { width: number; operation: string }[] = [];
    const context = {
      lineWidth: 0,
      globalCompositeOperation: "source-over",
      beginPath: () => undefined,
      moveTo: () => undefined,
      lineTo: () => undefined,
      stroke() {
        strokes.push({ width: this.lineWidth, operation: this.globalCompositeOperation });
      },
    };
    const colours = { link: GHOST, mallet: GHOST, outline: GHOST, outlineWidth: 2, malletOpacity: 0.2 };
    const projection = new Projection(800, 500);
    drawArmOutline(context as unknown as CanvasRenderingContext2D, projection, frame.arms[0], colours);
    const [links, erased, rod] = strokes;
    expect(strokes).toHaveLength(3);
    expect(erased).toEqual({ width: links.width - 4, operation: "destination-out" });
    expect([links.operation, rod.operation]).toEqual(["source-over", "source-over"]);
  });
});
