import assert from "node:assert/strict";
import { test } from "node:test";
import { bytesOfBase64, DamagedRecording, joinDeltaPlanes, openContainer } from "../../src/data/container.ts";
import { measuresOf } from "../../src/data/measures.ts";
import { readRecording } from "../../src/data/recording.ts";
import { packContainer, sampleRecording, splitDeltaPlanes } from "../sample.ts";

const OPTIONS = { axons: 7, vertices: 12, frames: 5, columns: 4, struck: 0.5 };
const own = (bytes: Uint8Array): Uint8Array<ArrayBuffer> => new Uint8Array(bytes);
const damaged = (words: RegExp) => (error: unknown): boolean => error instanceof DamagedRecording && words.test(error.message);

test("differences of rows in byte planes are undone, past 65535 too", () => {
    const items = Uint16Array.from([65535, 1, 2, 40000, 0, 65535, 1, 39999, 7, 8, 9, 10]);
    assert.deepEqual(joinDeltaPlanes(splitDeltaPlanes(items, 4), 4), items);
    assert.deepEqual(joinDeltaPlanes(new Uint8Array([5, 255, 0, 255]), 1), Uint16Array.from([5, 4]));
});

test("a container gives back its arrays", async () => {
    const items = Uint16Array.from({ length: 30 }, (_, i) => (i * 7919) & 0xffff);
    const births = Float32Array.from([1.5, -2, 0.25]);
    const bytes = packContainer({ version: 1 }, { tips: { items, shape: [5, 3, 2] }, births: { items: births, shape: [3] } });
    const container = await openContainer(own(bytes));
    assert.deepEqual(container.array("tips"), items);
    assert.deepEqual(container.array("births"), births);
    assert.deepEqual(container.shape("tips"), [5, 3, 2]);
    assert.equal(container.array("absent"), null);
});

test("what is wrong with a container is said", async () => {
    const whole = packContainer({ version: 1 }, { births: { items: new Float32Array(4), shape: [4] } });
    const changed = (change: (bytes: Uint8Array) => Uint8Array): Promise<unknown> => openContainer(own(change(own(whole))));
    await assert.rejects(changed((bytes) => bytes.subarray(0, 5)), damaged(/5 bytes/));
    await assert.rejects(changed((bytes) => { bytes[0] = 65; return bytes; }), damaged(/begins with "AROPREC1"/));
    await assert.rejects(changed((bytes) => { bytes[10] = 9; return bytes; }), damaged(/header should end/));
    await assert.rejects(changed((bytes) => { bytes[12] = 63; return bytes; }), damaged(/not JSON/));
    await assert.rejects(changed((bytes) => bytes.subarray(0, bytes.length - 6)), damaged(/cannot be inflated/));
    await assert.rejects(openContainer(own(packContainer({ version: 2 }, {}))), damaged(/version 2/));
    assert.throws(() => bytesOfBase64("%%%"), damaged(/base64/));
});

test("arrays that do not fit are refused when they are read", async () => {
    const open = async (entry: object): Promise<unknown> => {
        const bytes = packContainer({ version: 1 }, {});
        const length = new DataView(bytes.buffer).getUint32(8, true);
        const header = new TextEncoder().encode(JSON.stringify({ version: 1, arrays: { a: entry } }));
        const begin = Math.ceil((12 + header.length) / 8) * 8;
        const whole = new Uint8Array(begin + bytes.length - Math.ceil((12 + length) / 8) * 8);
        whole.set(bytes.subarray(0, 8));
        new DataView(whole.buffer).setUint32(8, header.length, true);
        whole.set(header, 12);
        whole.set(bytes.subarray(Math.ceil((12 + length) / 8) * 8), begin);
        return (await openContainer(whole)).array("a");
    };
    await assert.rejects(open({ offset: 0, length: 4, type: "f64", shape: [4] }), damaged(/type "f64"/));
    await assert.rejects(open({ offset: 0, length: 4, type: "u8", shape: [5] }), damaged(/holds 5 items, not 4/));
    await assert.rejects(open({ offset: 0, length: 4, type: "u8", shape: [4] }), damaged(/bytes 0 to 4 of 0/));
    await assert.rejects(open({ offset: 0, length: 0, type: "u8", shape: [0], coding: "runs" }), damaged(/coding "runs"/));
});

test("a sample is read whole, and its counts are those of its tips", async () => {
    const recording = readRecording(await openContainer(own(sampleRecording(OPTIONS))));
    assert.equal(recording.axonCount, 7);
    assert.equal(recording.frames.length, 5);
    assert.equal(recording.shafts.cell.length, 7 * 12);
    assert.ok(recording.moves && recording.shafts.end !== null);
    const stored = recording.measures;
    const counted = measuresOf({ ...recording, measures: {} });
    for (const name of ["born", "growing", "arrived"]) assert.deepEqual(counted[name], stored[name], name);
});

test("a recording that lacks or contradicts something is refused with its name", async () => {
    const container = await openContainer(own(sampleRecording(OPTIONS)));
    const changed = (header: object, without = ""): unknown =>
        readRecording({ ...container, header: { ...container.header, ...header }, array: (name) => (name === without ? null : container.array(name)) });
    assert.throws(() => changed({}, "shaft_cell"), damaged(/no array shaft_cell/));
    assert.throws(() => changed({ frames: [] }), damaged(/no frames/));
    assert.throws(() => changed({ frames: [0, 1] }), damaged(/mesh has 5 frames, the recording 2/));
    assert.throws(() => changed({ box: [0, 0, 0, 1] }), damaged(/box/));
    assert.throws(() => changed({ axon_count: 9 }), damaged(/shaft_start has 8 items where 10/));
    assert.throws(() => changed({ cues: [{ name: "a", frames: [77] }] }), damaged(/cue 0: its frames \[77\]/));
});
