/**
 * How long frames take while time runs and while the view moves: printed, not judged, as it depends on the machine and on
 * what else runs there. REPORT names the pages to open, with commas between them, which then take turns; without it a
 * synthetic recording of 10,000 axons is made.
 */
import { resolve } from "node:path";
import { after, before, test } from "node:test";
import type { Browser, Page } from "playwright-core";
import { launch, open, setTime } from "../e2e/browser.ts";
import { page as report, SAMPLE_REPORT, writePage } from "../pages.ts";
import { sampleRecording } from "../sample.ts";

/** Milliseconds before it is watched, milliseconds that it is watched, and how often. */
const SETTLING = 1500;
const WATCHED = 4000;
const ROUNDS = 5;
const KINDS = ["play", "drag", "wheel"] as const;
type Kind = (typeof KINDS)[number];

/** What was seen of one kind of movement in one page. */
interface Seen {
    intervals: number[];
    /** Milliseconds of processor time, by kind of process. */
    processor: Record<string, number>;
    vertices: string;
}

let browser: Browser;
before(async () => { browser = await launch(); });
after(async () => { await browser.close(); });

function pages(): string[] {
    const named = process.env["REPORT"];
    if (named) return named.split(",").map((path) => `file://${resolve(path)}`);
    const bytes = sampleRecording({ axons: 10_000, vertices: 43, frames: 73, columns: 124, struck: 0 });
    return [writePage("frames.html", report(SAMPLE_REPORT, [{ label: "", bytes }]))];
}

/** Milliseconds of processor time that the browser's processes have used, by their kind. */
async function processorTime(): Promise<Record<string, number>> {
    const session = await browser.newBrowserCDPSession();
    const { processInfo } = await session.send("SystemInfo.getProcessInfo");
    await session.detach();
    const used: Record<string, number> = { renderer: 0, GPU: 0 };
    for (const { type, cpuTime } of processInfo) used[type] = (used[type] ?? 0) + 1000 * cpuTime;
    return used;
}

/** Intervals between frames in ms while something moves in the page. */
function intervals(page: Page): Promise<number[]> {
    return page.evaluate((watched) => new Promise<number[]>((done) => {
        const times: number[] = [];
        const next = (now: number): void => {
            times.push(now);
            if (now - times[0] < watched) requestAnimationFrame(next);
            else done(times.slice(1).map((time, i) => time - times[i]));
        };
        requestAnimationFrame(next);
    }), WATCHED);
}

/** Moves the view at each frame until the page is closed: by drags to and fro, or by the wheel. */
function keepMoving(page: Page, kind: Kind): Promise<void> {
    return page.evaluate((how) => {
        const surface = document.getElementById("surface") as HTMLElement;
        const { left, top, width, height } = surface.getBoundingClientRect();
        const middle = { clientX: left + width / 2, clientY: top + height / 2, bubbles: true, cancelable: true };
        const press = (type: string, dx: number): boolean => surface.dispatchEvent(new PointerEvent(type, { ...middle, pointerId: 1, clientX: middle.clientX + dx }));
        surface.setPointerCapture = () => {}; // A pointer that no hand holds cannot be captured.
        let turn = 0;
        const step = (): void => {
            const swing = Math.sin(turn++ / 15);
            if (how === "drag") press("pointermove", 120 * swing);
            else surface.dispatchEvent(new WheelEvent("wheel", { ...middle, deltaY: -8 * swing }));
            requestAnimationFrame(step);
        };
        press("pointerdown", 0);
        step();
    }, kind);
}

async function watch(url: string, kind: Kind, seen: Seen): Promise<void> {
    const { page } = await open(browser, url, { drawing: "" });
    const end = await page.locator("#time").evaluate((slider: HTMLInputElement) => Number(slider.max));
    await setTime(page, 0.6 * end);
    if (kind === "play") await page.click("#play");
    else await keepMoving(page, kind);
    await page.waitForTimeout(SETTLING);
    const was = await processorTime();
    seen.intervals.push(...await intervals(page));
    const is = await processorTime();
    for (const type of Object.keys(was)) seen.processor[type] = (seen.processor[type] ?? 0) + is[type] - was[type];
    seen.vertices = await page.locator("#canvas").getAttribute("data-vertices") ?? "?";
    await page.context().close();
}

function told({ intervals: all, processor, vertices }: Seen): string {
    const sorted = [...all].sort((a, b) => a - b);
    const at = (share: number): string => sorted[Math.floor(share * (sorted.length - 1))].toFixed(1);
    const cost = (type: string): string => (processor[type] / all.length).toFixed(1);
    return `median ${at(0.5)} ms (quartiles ${at(0.25)} and ${at(0.75)}, 95 % within ${at(0.95)}, ${all.length} frames); ` +
        `processor time a frame: page ${cost("renderer")} ms, graphics ${cost("GPU")} ms; ${vertices} vertices of shafts`;
}

test("times of frames", async () => {
    const urls = pages();
    for (const kind of KINDS) {
        const all: Seen[] = urls.map(() => ({ intervals: [], processor: {}, vertices: "" }));
        for (let round = 0; round < ROUNDS; round++) {
            for (const [i, url] of urls.entries()) await watch(url, kind, all[i]);
        }
        all.forEach((seen, i) => console.log(`${kind}, ${urls[i]}: ${told(seen)}`));
    }
});
