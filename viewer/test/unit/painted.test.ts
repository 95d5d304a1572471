import assert from "node:assert/strict";
import { test } from "node:test";
import { openContainer } from "../../src/data/container.ts";
import { readRecording } from "../../src/data/recording.ts";
import { coneSize } from "../../src/gl/cones.ts";
import { packed, press, Raster, stamp } from "../../src/soft/raster.ts";
import { BUDGET, movingStride } from "../../src/soft/shafts.ts";
import { sampleRecording } from "../sample.ts";

test("the stride while something moves is the least that keeps the budget", () => {
    for (const vertices of [0, 1, BUDGET, BUDGET + 1, 427_655, 12_345_678]) {
        const stride = movingStride(vertices);
        assert.ok(vertices / stride <= BUDGET);
        assert.ok(stride === 1 || vertices / (stride - 1) > BUDGET);
    }
});

test("cones grow with zooming, within what shows few and many", async () => {
    const recording = readRecording(await openContainer(new Uint8Array(sampleRecording({ axons: 20, vertices: 24, frames: 13, columns: 16, struck: 0 }))));
    const size = (axonCount: number, scale: number): number => coneSize({ ...recording, axonCount }, { x: 0, y: 0, scale });
    assert.equal(size(20, 1), 8);
    assert.equal(size(1000, 0.1), 6.5);
    assert.equal(size(100_000, 2), 2.4);
    assert.ok(size(10_000, 1) < size(10_000, 0.8));
});

test("a large stamp has a rim around its inside, a small one is all inside", () => {
    const [rim, fill] = [packed(255, 255, 255), packed(200, 0, 0)];
    const coloursAcross = (diameter: number): number[] => {
        const raster = new Raster(15, 15, new ArrayBuffer(4 * 225));
        press(raster, stamp(diameter, (x, y) => Math.hypot(x, y)), 7, 7, rim, fill);
        return [...new Set([...raster.pixels.subarray(7 * 15, 8 * 15)])].map((colour) => colour >>> 0);
    };
    assert.ok(coloursAcross(8).includes(fill >>> 0));
    assert.ok(coloursAcross(8).some((colour) => (colour & 0xff00) !== 0));
    assert.ok(coloursAcross(2.4).includes(fill >>> 0));
    assert.ok(coloursAcross(2.4).every((colour) => (colour & 0xff00) === 0));
});
