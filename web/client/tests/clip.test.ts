// Decoding of clips, with valid, truncated and random data.

import { describe, expect, it } from "vitest";
import { ClipError } from "../src/clip/error";
import { decodeMotion } from "../src/clip/motion";
import { decodeObserved } from "../src/clip/observed";
import { assemble, encode, stillArmColumns } from "./encoder";

/** A clip of an episode with five samples, and a field and a column of a later version, which are ignored. */
const episode = (): Uint8Array =>
  encode(
    {
      samples: 5,
      contacts: [
        { t: 0.05, what: "mallet", x: 0.1, y: 0 },
        { t: 0.013, what: "rim", x: 0.2, y: -0.4 },
      ],
      violations: [{ side: 0, group: "ee", from: 1, to: 2, worst: 0.0031 }],
      end: { end: "crossed_middle", success: false, why: "the puck came back", steps: 4 },
      of_the_future: { ignored: true },
    },
    [
      ...stillArmColumns(
        5,
        (k) => 0.3 - 0.02 * k,
        (k) => -0.1 * k,
      ),
      { name: "of_the_future", values: [1, 2], order: 1 },
    ],
  );

describe("a motion clip", () => {
  it("decodes values to the precision of their scale", () => {
    const motion = decodeMotion(episode());
    expect([...motion.puck.x].map((x) => x.toFixed(4))).toEqual([
      "0.3000",
      "0.2800",
      "0.2600",
      "0.2400",
      "0.2200",
    ]);
    expect(motion.arms).toHaveLength(1);
    expect(motion.arms[0].q[3][2]).toBeCloseTo(0.3, 6);
    expect(motion.arms[0].dq).toBeNull();
    expect(motion.contacts.map((c) => c.what)).toEqual(["rim", "mallet"]);
    expect(motion.end?.why).toBe("the puck came back");
    expect(motion.columns.map((c) => c.name)).not.toContain("of_the_future");
  });

  it.each([0, 1, 2])("decodes order %i, negative numbers and more than 32 bits", (order) => {
    const values = [0, -1, 1, 63, -64, 2 ** 34, -(2 ** 34), 5];
    const columns = stillArmColumns(8, (k) => values[k], () => 0); // prettier-ignore
    columns[0] = { ...columns[0], scale: 1, order };
    expect([...decodeMotion(encode({ samples: 8 }, columns)).puck.x]).toEqual(values);
  });

  it("refuses all truncated clips", () => {
    const bytes = episode();
    for (let length = 0; length < bytes.length; length++) {
      expect(() => decodeMotion(bytes.slice(0, length)), `${length} bytes`).toThrow(ClipError);
    }
  });

  it("refuses an extra byte", () => {
    expect(() => decodeMotion(new Uint8Array([...episode(), 0]))).toThrow(/1 bytes after its last column/);
  });

  it("throws only ClipError for random bytes", () => {
    const bytes = episode();
    // A linear congruential generator (Park and Miller), so that failures are reproducible.
    let state = 1;
    const random = (below: number): number => {
      state = (state * 48271) % 2147483647;
      return state % below;
    };
    for (let i = 0; i < 3000; i++) {
      const garbled = bytes.slice();
      for (let k = 0; k <= random(3); k++) garbled[random(garbled.length)] = random(256);
      try {
        decodeMotion(garbled);
      } catch (error) {
        expect(error).toBeInstanceOf(ClipError);
      }
    }
  });

  it("names an unknown format", () => {
    expect(() => decodeMotion(encode({ samples: 1, format: "faceoff-clip/9" }, []))).toThrow(
      /"faceoff-clip\/9"/,
    );
  });

  it("names the invalid field", () => {
    const wrong = encode({ samples: 2, violations: [{ side: 7 }] }, stillArmColumns(2, () => 0, () => 0)); // prettier-ignore
    expect(() => decodeMotion(wrong)).toThrow(
      "header.violations[0].side must be a whole number from 0 to 1, but is 7",
    );
  });

  it("refuses other files", () => {
    expect(() => decodeMotion(new TextEncoder().encode("<!doctype html><p>Not found"))).toThrow(
      /is not a clip/,
    );
    expect(() => decodeMotion(assemble(new Uint8Array([0xff, 0xfe]), []))).toThrow(/not JSON/);
  });

  it("refuses a clip without puck or arm", () => {
    expect(() => decodeMotion(encode({ samples: 1 }, []))).toThrow(/nothing to draw/);
  });
});

describe("an observed clip", () => {
  it("aligns columns with samples", () => {
    const bytes = encode({ kind: "observed", samples: 3, side: 1, late: [2], lost: [{ from: 1, to: 2 }] }, [
      { name: "computation_time", values: [0.004, 0.021], first: 1, scale: 1e-6, order: 0 },
    ]);
    const observed = decodeObserved(bytes);
    expect(observed.side).toBe(1);
    expect(observed.computationTimeS?.[0]).toBeNaN();
    expect(observed.computationTimeS?.[2]).toBeCloseTo(0.021, 9);
    expect(observed.lost).toEqual([{ from: 1, to: 2 }]);
    expect(observed.command).toBeNull();
  });

  it("refuses a motion clip", () => {
    expect(() => decodeObserved(episode())).toThrow(/expected a clip of kind "observed"/);
  });
});
