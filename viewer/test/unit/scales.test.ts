import assert from "node:assert/strict";
import { test } from "node:test";
import { laidBy } from "../../src/gl/shafts.ts";
import { fitting, pixelOf, pointAt, zoomed } from "../../src/numbers/camera.ts";
import { CATEGORIES, cividis, tint, viridis, type Rgb } from "../../src/numbers/colours.ts";
import { concentrationRange, decades, powerOfTen, roundDown, roundUp, ticks, written } from "../../src/numbers/scales.ts";

test("round numbers are 1, 2 and 5 times powers of ten", () => {
    assert.deepEqual([1, 3, 7, 49, 0.03].map(roundDown), [1, 2, 5, 20, 0.02]);
    assert.deepEqual([1, 3, 7, 51].map(roundUp), [1, 5, 10, 100]);
    assert.deepEqual(ticks(0, 72, 5), [0, 20, 40, 60]);
    assert.deepEqual(ticks(0, 0.3, 3), [0, 0.1, 0.2, 0.3]);
    assert.deepEqual(decades(0.02, 20), [0.1, 1, 10]);
});

test("numbers are written with three digits, a true minus and no long tails", () => {
    assert.deepEqual([932.4378, -0.12345, 0, 15, 12345.6, 1e-5, null, NaN].map((value) => written(value)), ["932", "−0.123", "0", "15", "12346", "1 × 10⁻⁵", "–", "–"]);
    assert.deepEqual([0.001, 1, 1000, 1e4, 1e-12].map(powerOfTen), ["0.001", "1", "1000", "10⁴", "10⁻¹²"]);
});

test("the range of a cue is that of the program's figures", () => {
    assert.deepEqual(concentrationRange(0.3, 27), { low: 0.1, high: 50 });
    assert.deepEqual(concentrationRange(0, 10), { low: 0.1, high: 10 });
    assert.deepEqual(concentrationRange(0, 0), { low: 0.01, high: 1 });
});

test("a pixel and its point are inverse, and zooming keeps the point under the pointer", () => {
    const size = { width: 800, height: 500 };
    const camera = fitting([0, 0, 800, 600], size);
    assert.ok(Math.abs(camera.scale - (600 / 500) * 1.06) < 1e-12);
    const pixel: [number, number] = [123, 77];
    const point = pointAt(camera, size, pixel);
    const nearer = zoomed(camera, size, pixel, 2, camera.scale);
    pixelOf(nearer, size, point).forEach((value, axis) => assert.ok(Math.abs(value - pixel[axis]) < 1e-9));
    assert.equal(zoomed(camera, size, pixel, 1e9, camera.scale).scale, camera.scale / 50);
});

test("what is laid is the beginning of the list of times", () => {
    const times = Uint16Array.from([0, 0, 5, 5, 9, 65535]);
    assert.deepEqual([0, 4, 5, 10, 65535].map((tick) => laidBy(times, tick)), [2, 2, 4, 5, 6]);
});

/** Relative luminance. */
const luminance = (colour: Rgb): number => {
    const [r, g, b] = colour.map((channel) => (channel / 255 <= 0.04045 ? channel / 3294.6 : ((channel / 255 + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};

test("every map rises or falls in lightness throughout", () => {
    const maps: Record<string, (share: number) => Rgb> = {
        viridis, cividis, attract: (share) => tint("attract", share, false), repel: (share) => tint("repel", share, false), dark: (share) => tint("attract", share, true),
    };
    for (const [name, map] of Object.entries(maps)) {
        const lights = Array.from({ length: 33 }, (_, i) => luminance(map(i / 32)));
        const direction = Math.sign(lights[32] - lights[0]);
        for (let i = 1; i < lights.length; i++) assert.ok(direction * (lights[i] - lights[i - 1]) > -0.004, `${name} at ${i}`);
    }
    assert.deepEqual([viridis(0), viridis(1)], [[0x44, 0x01, 0x54], [0xfd, 0xe7, 0x25]]);
});

/** Deuteranopia and protanopia in linear light: Machado, Oliveira & Fernandes (2009), severity 1. */
const BLINDNESS = {
    deuteranope: [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.01182, 0.04294, 0.968881]],
    protanope: [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
};

test("categories differ for red-green-blind readers", () => {
    for (const [who, matrix] of Object.entries(BLINDNESS)) {
        const seen = CATEGORIES.map((colour) => {
            const linear = colour.map((channel) => (channel / 255) ** 2.2);
            return matrix.map((row) => 255 * Math.max(row[0] * linear[0] + row[1] * linear[1] + row[2] * linear[2], 0) ** (1 / 2.2));
        });
        seen.forEach((one, i) => seen.slice(i + 1).forEach((other, j) => {
            const distance = Math.hypot(...one.map((channel, k) => channel - other[k]));
            assert.ok(distance > 30, `${who}: ${i} and ${i + 1 + j} differ by ${distance.toFixed(0)}`);
        }));
    }
});
