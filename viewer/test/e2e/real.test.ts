import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { resolve } from "node:path";
import { after, before, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import { openContainer } from "../../src/data/container.ts";
import { readRecording, type Recording } from "../../src/data/recording.ts";
import { fitting, pixelOf } from "../../src/numbers/camera.ts";
import { HERE } from "../pages.ts";
import { difference, drawn, launch, open, picture, setTime } from "./browser.ts";

/** The program whose run is looked at; without it there is nothing to test here. */
const PROGRAM = process.env["TROPISM"];
const FOLDER = resolve(HERE, "out/smoke");
let browser: Browser;

before(async () => { browser = await launch(); });
after(async () => { await browser.close(); });

/** One line of trajectories.csv. */
interface Row {
    time: number;
    axon: number;
    status: string;
    x: number;
    y: number;
    heading: number;
}

function trajectories(): Row[] {
    const [header, ...lines] = readFileSync(resolve(FOLDER, "trajectories.csv"), "utf8").trim().split("\n");
    assert.equal(header, "time [h],axon,status,x [um],y [um],heading [deg]");
    return lines.map((line) => {
        const [time, axon, status, x, y, heading] = line.split(",");
        return { time: Number(time), axon: Number(axon), status, x: Number(x), y: Number(y), heading: Number(heading) };
    });
}

/** The rows of the frame nearest to a time, of those times that lie on a frame of the recording. */
function rowsNear(rows: Row[], recording: Recording, hours: number): Row[] {
    const onFrames = [...new Set(rows.map(({ time }) => time))].filter((time) => recording.frames.some((frame) => Math.abs(frame - time) < 1e-9));
    const time = onFrames.reduce((best, each) => (Math.abs(each - hours) < Math.abs(best - hours) ? each : best));
    return rows.filter((row) => row.time === time);
}

/** The cones that a pointer can tell from all others. */
function apart(rows: Row[], reach: number): Row[] {
    return rows.filter((row) => rows.every((other) => other === row || Math.hypot(other.x - row.x, other.y - row.y) > reach));
}

/** What the card says, by the words at its left. */
async function card(page: Page): Promise<Record<string, string>> {
    await page.locator(".card").waitFor({ state: "visible" });
    return page.locator(".card").evaluate((element) => Object.fromEntries([
        ["title", element.querySelector("h3")?.textContent ?? ""],
        ...[...element.querySelectorAll("dt")].map((term) => [term.textContent ?? "", term.nextElementSibling?.textContent ?? ""]),
    ]));
}

/** The numbers in a text, which has the minus of print. */
const numbersIn = (text: string): number[] => (text.replaceAll("−", "-").match(/-?\d+(\.\d+)?/g) ?? []).map(Number);

/** Half a unit of the third digit, with which the card writes a length, and half a step of a recording's positions. */
function lengthError(value: number, recording: Recording, axis: 0 | 1): number {
    const digit = 10 ** Math.max(Math.floor(Math.log10(Math.max(Math.abs(value), 1e-3))) - 2, -5);
    return 0.5 * digit + (recording.box[axis + 2] - recording.box[axis]) / 65535;
}

test("the report of a real run shows what the run wrote", { skip: PROGRAM ? false : "TROPISM names no program" }, async () => {
    execFileSync(PROGRAM as string, [resolve(HERE, "../scenarios/smoke.json"), "--out", FOLDER], { stdio: "pipe" });
    const recording = readRecording(await openContainer(new Uint8Array(readFileSync(resolve(FOLDER, "recording.bin")))));
    const all = trajectories();
    const { page, complaints } = await open(browser, `file://${resolve(FOLDER, "report.html")}`);
    const box = await page.locator(".pane").boundingBox();
    assert.ok(box);
    const camera = fitting(recording.box, box);
    const pictures = [];
    for (const hours of [4, 10]) {
        await page.mouse.move(5, 5);
        const rows = rowsNear(all, recording, hours);
        await setTime(page, rows[0].time);
        pictures.push(await picture(page));
        const known = apart(rows, 3 * camera.scale);
        assert.ok(known.length >= 5, `only ${known.length} cones stand apart`);
        for (const row of known) {
            const [x, y] = pixelOf(camera, box, [row.x, row.y]);
            await page.mouse.move(box.x + x, box.y + y);
            await drawn(page);
            const told = await card(page);
            assert.equal(told["title"], `Axon ${row.axon}`);
            assert.equal(told["status"], row.status);
            const [atX, atY] = numbersIn(told["cone at"]);
            assert.ok(Math.abs(atX - row.x) <= lengthError(row.x, recording, 0), `x ${atX}, ${row.x} written`);
            assert.ok(Math.abs(atY - row.y) <= lengthError(row.y, recording, 1), `y ${atY}, ${row.y} written`);
            // A heading is one of 256, written in whole degrees.
            const turned = Math.abs(((numbersIn(told["heading"])[0] - row.heading + 540) % 360) - 180);
            assert.ok(turned <= 0.5 + 180 / 256, `heading ${told["heading"]}, ${row.heading} written`);
        }
    }
    assert.ok(difference(pictures[0], pictures[1]) > 0.01, "the slider moves nothing");
    assert.deepEqual(complaints, []);
    await page.context().close();
});
