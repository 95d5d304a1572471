/** A headless Chromium with WebGL in software, and pictures out of it. */
import { type Browser, chromium, type Page } from "playwright-core";
import { PNG } from "pngjs";

const OPTIONS = [
    "--headless", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
];

/** How a page is opened. */
export interface Opening {
    width?: number;
    height?: number;
    dark?: boolean;
    touch?: boolean;
    /** Who draws what is many; the program decides by the name of the graphics otherwise. */
    drawing?: "graphics" | "processor" | "";
}

/** A page and what it complained about. */
export interface Opened {
    page: Page;
    complaints: string[];
}

/** The browser: Debian's, or the one that CHROMIUM names. */
export function launch(): Promise<Browser> {
    return chromium.launch({ executablePath: process.env["CHROMIUM"] ?? "/usr/bin/chromium", args: OPTIONS });
}

/** Opens a page and waits until it is drawn. */
export async function open(browser: Browser, url: string, { width = 1200, height = 800, dark = false, touch = false, drawing = "graphics" }: Opening = {}): Promise<Opened> {
    const context = await browser.newContext({ viewport: { width, height }, colorScheme: dark ? "dark" : "light", hasTouch: touch });
    const page = await context.newPage();
    page.setDefaultTimeout(60_000);
    const complaints: string[] = [];
    page.on("console", (message) => { if (["error", "warning"].includes(message.type()) && !/GPU stall|software WebGL|swiftshader/i.test(message.text())) complaints.push(message.text()); });
    page.on("pageerror", (error) => complaints.push(String(error)));
    page.on("request", (request) => { if (!/^(file|data|blob):/.test(request.url())) complaints.push(`asked for ${request.url()}`); });
    await page.goto(drawing ? `${url}#drawing=${drawing}` : url);
    await page.waitForSelector("html[data-ready]");
    await drawn(page);
    return { page, complaints };
}

/** Waits for two frames. */
export function drawn(page: Page): Promise<void> {
    return page.evaluate(() => new Promise<void>((done) => requestAnimationFrame(() => requestAnimationFrame(() => done()))));
}

/** Moves the slider to a time. */
export async function setTime(page: Page, hours: number): Promise<void> {
    await page.locator("#time").evaluate((slider: HTMLInputElement, time) => {
        slider.value = String(time);
        slider.dispatchEvent(new Event("input"));
    }, hours);
    await drawn(page);
}

/** What the canvas shows. */
export async function picture(page: Page): Promise<PNG> {
    await drawn(page);
    return PNG.sync.read(await page.locator("#canvas").screenshot());
}

/** Share of pixels in which two pictures of one size differ by more than a tenth of a channel. */
export function difference(one: PNG, other: PNG): number {
    if (one.width !== other.width || one.height !== other.height) return 1;
    let differing = 0;
    for (let i = 0; i < one.data.length; i += 4) {
        if ([0, 1, 2].some((channel) => Math.abs(one.data[i + channel] - other.data[i + channel]) > 26)) differing++;
    }
    return differing / (one.data.length / 4);
}

/** A picture of a third of the width and height, each pixel the mean of nine. */
export function thumbnail(picture: PNG): PNG {
    const small = new PNG({ width: Math.floor(picture.width / 3), height: Math.floor(picture.height / 3) });
    for (let y = 0; y < small.height; y++) {
        for (let x = 0; x < small.width; x++) {
            for (let channel = 0; channel < 4; channel++) {
                let sum = 0;
                for (let k = 0; k < 9; k++) sum += picture.data[4 * ((3 * y + Math.floor(k / 3)) * picture.width + 3 * x + (k % 3)) + channel];
                small.data[4 * (y * small.width + x) + channel] = Math.round(sum / 9);
            }
        }
    }
    return small;
}
